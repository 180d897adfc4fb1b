// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/packed_series.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "risley/core/require.hpp"

namespace risley::estimation {
namespace {

/// Numbers that a grid can have.
constexpr std::size_t kGridNumbers = 1 << 16;

void require_columns(const AngleSeries& series) {
  const std::size_t size = series.size();
  require_length("azimuth", series.azimuth.size(), size);
  require_length("zenith", series.zenith.size(), size);
  require_length_or_none("beam", series.beam.size(), size);
  require_length("azimuth_rounding_variance", series.azimuth_rounding_variance.size(), size);
  require_length("zenith_rounding_variance", series.zenith_rounding_variance.size(), size);
  require_length_or_none("range", series.range.size(), size);
}

/// Appends rows [begin, end) of a column.
template <class T>
void append_part(const std::vector<T>& from, std::size_t begin, std::size_t end,
                 std::vector<T>& to) {
  to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(begin),
            from.begin() + static_cast<std::ptrdiff_t>(end));
}

/// Of times that do not decrease: the longest step of which all are multiples.
std::int64_t common_step(const std::vector<std::int64_t>& time_ns) {
  std::int64_t step = 0;
  for (const std::int64_t time : time_ns) {
    const std::int64_t since = time - time_ns.front();
    if (step == 0 || since % step != 0) step = std::gcd(step, since);
    if (step == 1) break;
  }
  return std::max<std::int64_t>(step, 1);
}

}  // namespace

PackedSeries::Times::Times(const std::vector<std::int64_t>& all)
    : base(all.front()), step(all[1] - all[0]) {
  const auto even = [&](std::size_t i) {
    return all[i] == base + step * static_cast<std::int64_t>(i);
  };
  std::size_t first_odd = 2;
  while (first_odd < all.size() && even(first_odd)) ++first_odd;
  if (first_odd == all.size()) return;
  if (!std::is_sorted(all.begin(), all.end())) {  // the clock was reset
    time_ns = all;
    return;
  }
  step = common_step(all);
  const std::int64_t most = (all.back() - base) / step;
  const auto put_steps = [&](auto& steps) {
    using Steps = typename std::remove_reference_t<decltype(steps)>::value_type;
    steps.reserve(all.size());
    for (const std::int64_t time : all) steps.push_back(static_cast<Steps>((time - base) / step));
  };
  if (most <= std::numeric_limits<std::uint16_t>::max()) {
    put_steps(few_steps);
  } else if (most <= std::numeric_limits<std::uint32_t>::max()) {
    put_steps(many_steps);
  } else {
    time_ns = all;
  }
}

PackedSeries::Angles::Angles(const std::vector<double>& all, const Mostly<float>& variance,
                             Grid& grid) {
  if (variance.each.empty() && variance.all > 0 && grid.variance == 0) {
    grid.variance = variance.all;
    grid.value.assign(kGridNumbers, std::numeric_limits<double>::quiet_NaN());
  }
  if (!variance.each.empty() || !(variance.all > 0) || variance.all != grid.variance) {
    value = all;
    return;
  }
  // What counts is that a number stands for one value; how it came about does not.
  const double per_step = 1.0 / std::sqrt(12.0 * static_cast<double>(grid.variance));
  number.resize(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    number[i] = static_cast<std::uint16_t>(
        static_cast<std::int64_t>(std::nearbyint(std::clamp(all[i] * per_step, -1e15, 1e15))));
    double& met = grid.value[number[i]];
    if (std::isnan(met)) met = all[i];
    if (std::bit_cast<std::uint64_t>(met) != std::bit_cast<std::uint64_t>(all[i])) {
      number = {};
      value = all;
      return;
    }
  }
}

std::pair<double, double> PackedSeries::angles(std::size_t row) const {
  const std::size_t block = row / kBlockRows, place = row % kBlockRows;
  if (block >= blocks_.size()) return {tail_.azimuth[place], tail_.zenith[place]};
  return {blocks_[block].azimuth.at(place, azimuth_grid_),
          blocks_[block].zenith.at(place, zenith_grid_)};
}

AngleSeries PackedSeries::rows(ShotRange range) const {
  AngleSeries out;
  rows(range, out);
  return out;
}

void PackedSeries::rows(ShotRange range, AngleSeries& out) const {
  require_rows("rows", range.begin, range.end, size());
  const std::size_t count = range.size();
  out.time_ns.resize(count);
  out.azimuth.resize(count);
  out.zenith.resize(count);
  out.beam.resize(count);
  out.azimuth_rounding_variance.resize(count);
  out.zenith_rounding_variance.resize(count);
  out.range.resize(has_ranges_ ? count : 0);
  for (std::size_t row = range.begin, at = 0; row < range.end;) {
    const std::size_t first = row % kBlockRows;
    const std::size_t rows = std::min(kBlockRows - first, range.end - row);
    const auto put = [&](const auto& value, auto& column) {
      auto* const to = column.data() + at;
      for (std::size_t i = 0; i < rows; ++i) to[i] = value(first + i);
    };
    const auto copy = [&](const auto& from, auto& column) {
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first), rows,
                  column.begin() + static_cast<std::ptrdiff_t>(at));
    };
    const auto unpack = [&](const auto& mostly, auto& column) {
      if (!mostly.each.empty()) return copy(mostly.each, column);
      std::fill_n(column.begin() + static_cast<std::ptrdiff_t>(at), rows, mostly.all);
    };
    const auto unpack_times = [&](const Times& times, auto& column) {
      if (!times.time_ns.empty()) return copy(times.time_ns, column);
      const auto put_steps = [&](const auto& steps_of) {
        const std::int64_t base = times.base, step = times.step;
        put([&](std::size_t i) { return base + step * std::int64_t{steps_of(i)}; }, column);
      };
      if (!times.few_steps.empty()) {
        const std::uint16_t* steps = times.few_steps.data();
        put_steps([=](std::size_t i) { return steps[i]; });
      } else if (!times.many_steps.empty()) {
        const std::uint32_t* steps = times.many_steps.data();
        put_steps([=](std::size_t i) { return steps[i]; });
      } else {
        put_steps([](std::size_t i) { return static_cast<std::int64_t>(i); });
      }
    };
    const auto unpack_angles = [&](const Angles& angles, const Grid& grid, auto& column) {
      if (angles.number.empty()) return copy(angles.value, column);
      const double* value = grid.value.data();
      const std::uint16_t* number = angles.number.data();
      put([=](std::size_t i) { return value[number[i]]; }, column);
    };
    if (row / kBlockRows < blocks_.size()) {
      const Block& block = blocks_[row / kBlockRows];
      unpack_times(block.time, out.time_ns);
      unpack_angles(block.azimuth, azimuth_grid_, out.azimuth);
      unpack_angles(block.zenith, zenith_grid_, out.zenith);
      unpack(block.beam, out.beam);
      unpack(block.azimuth_variance, out.azimuth_rounding_variance);
      unpack(block.zenith_variance, out.zenith_rounding_variance);
      if (has_ranges_) copy(block.range, out.range);
    } else {
      copy(tail_.time_ns, out.time_ns);
      copy(tail_.azimuth, out.azimuth);
      copy(tail_.zenith, out.zenith);
      copy(tail_.beam, out.beam);
      copy(tail_.azimuth_rounding_variance, out.azimuth_rounding_variance);
      copy(tail_.zenith_rounding_variance, out.zenith_rounding_variance);
      if (has_ranges_) copy(tail_.range, out.range);
    }
    row += rows;
    at += rows;
  }
}

void PackedSeries::append(const AngleSeries& series) {
  require_columns(series);
  if (series.size() == 0) return;
  if (size() == 0) has_ranges_ = !series.range.empty();
  require_length("range", series.range.size(), has_ranges_ ? series.size() : 0);
  for (const std::uint8_t beam : series.beam) largest_beam_ = std::max(largest_beam_, beam);
  for (std::size_t begin = 0, end = 0; begin < series.size(); begin = end) {
    end = std::min(series.size(), begin + kBlockRows - tail_.size());
    append_part(series.time_ns, begin, end, tail_.time_ns);
    append_part(series.azimuth, begin, end, tail_.azimuth);
    append_part(series.zenith, begin, end, tail_.zenith);
    if (!series.beam.empty()) append_part(series.beam, begin, end, tail_.beam);
    tail_.beam.resize(tail_.size(), 0);
    append_part(series.azimuth_rounding_variance, begin, end, tail_.azimuth_rounding_variance);
    append_part(series.zenith_rounding_variance, begin, end, tail_.zenith_rounding_variance);
    if (has_ranges_) append_part(series.range, begin, end, tail_.range);
    if (tail_.size() == kBlockRows) pack_tail();
  }
}

void PackedSeries::append(const PackedSeries& other, std::size_t row) {
  require_place("row", row, other.size());
  if (size() == 0) has_ranges_ = other.has_ranges_;
  const std::size_t place = row % kBlockRows;
  if (row / kBlockRows < other.blocks_.size()) {
    const Block& block = other.blocks_[row / kBlockRows];
    tail_.append(block.time.at(place), block.azimuth.at(place, other.azimuth_grid_),
                 block.zenith.at(place, other.zenith_grid_), block.beam.at(place),
                 block.azimuth_variance.at(place), block.zenith_variance.at(place));
    if (has_ranges_) tail_.range.push_back(block.range[place]);
  } else {
    tail_.append(other.tail_, place);
  }
  largest_beam_ = std::max(largest_beam_, tail_.beam.back());
  if (tail_.size() == kBlockRows) pack_tail();
}

void PackedSeries::change(const std::function<void(AngleSeries& rows)>& change_rows) {
  PackedSeries changed;
  AngleSeries some;
  for (std::size_t block = 0; block < blocks_.size(); ++block) {
    rows({block * kBlockRows, (block + 1) * kBlockRows}, some);
    blocks_[block] = {};
    change_rows(some);
    changed.append(some);
  }
  if (tail_.size() > 0) {
    change_rows(tail_);
    changed.append(tail_);
  }
  *this = std::move(changed);
}

void PackedSeries::pack_tail() {
  const auto mostly = [](const auto& column) {
    Mostly<typename std::remove_reference_t<decltype(column)>::value_type> packed{column.front(),
                                                                                  {}};
    const bool same = std::all_of(column.begin(), column.end(),
                                  [&](const auto& value) { return value == packed.all; });
    if (!same) packed.each = column;
    return packed;
  };
  Block& block = blocks_.emplace_back(Block{Times(tail_.time_ns),
                                            {},
                                            {},
                                            mostly(tail_.beam),
                                            mostly(tail_.azimuth_rounding_variance),
                                            mostly(tail_.zenith_rounding_variance),
                                            tail_.range});
  block.azimuth = Angles(tail_.azimuth, block.azimuth_variance, azimuth_grid_);
  block.zenith = Angles(tail_.zenith, block.zenith_variance, zenith_grid_);
  for (auto* column : {&tail_.azimuth, &tail_.zenith, &tail_.range}) column->clear();
  tail_.time_ns.clear();
  tail_.beam.clear();
  tail_.azimuth_rounding_variance.clear();
  tail_.zenith_rounding_variance.clear();
}

std::vector<ShotRange> stretches(const PackedSeries& series, double longest_gap) {
  require_between("longest gap", longest_gap, 0, kMostSeconds, "s");
  std::vector<ShotRange> ranges;
  const auto longest_ns = static_cast<std::int64_t>(longest_gap * 1e9);
  std::int64_t before = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    const std::int64_t time = series.time_ns(i);
    if (i == 0 || time <= before || time - before > longest_ns) ranges.push_back({i, i});
    ranges.back().end = i + 1;
    before = time;
  }
  return ranges;
}

PackedSeries thinned(const PackedSeries& series, double rate, std::vector<ShotRange>& ranges) {
  PackedSeries rows;
  TickSampler ticks(rate);
  for (ShotRange& range : ranges) {
    require_rows("range", range.begin, range.end, series.size());
    const std::size_t begin = rows.size();
    if (range.size() > 0) ticks.restart(series.time_ns(range.begin));
    for (std::size_t i = range.begin; i < range.end; ++i) {
      if (ticks.take(series.time_ns(i), series.beam(i))) rows.append(series, i);
    }
    range = {begin, rows.size()};
  }
  return rows;
}

}  // namespace risley::estimation
