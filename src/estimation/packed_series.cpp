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

#include "estimation/entry_checks.hpp"

namespace risley::estimation {
namespace {

/// Numbers that a grid can have.
constexpr std::size_t kGridNumbers = 1 << 16;

/// Appends rows [begin, end) of a column.
template <class T>
void append_part(const std::vector<T>& from, std::size_t begin, std::size_t end,
                 std::vector<T>& to) {
  to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(begin),
            from.begin() + static_cast<std::ptrdiff_t>(end));
}

/// The parts of a range that lie in one block each.
std::vector<ShotRange> blocks_of(ShotRange range) {
  std::vector<ShotRange> blocks;
  for (std::size_t begin = range.begin; begin < range.end; begin = blocks.back().end) {
    const std::size_t next = (begin / PackedSeries::kBlockRows + 1) * PackedSeries::kBlockRows;
    blocks.push_back({begin, std::min(range.end, next)});
  }
  return blocks;
}

/// Of non-decreasing times: the longest step of which all are multiples.
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
  // Only the correspondence of numbers and values matters, not its origin. Added to kWhole, a
  // number is rounded to the integer in its lowest bits.
  constexpr double kWhole = 0x1.8p52;
  const double per_step = 1.0 / std::sqrt(12.0 * static_cast<double>(grid.variance));
  number.resize(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    number[i] = static_cast<std::uint16_t>(
        std::bit_cast<std::uint64_t>(std::clamp(all[i] * per_step, -1e15, 1e15) + kWhole));
    double& met = grid.value[number[i]];
    if (std::isnan(met)) met = all[i];
    if (std::bit_cast<std::uint64_t>(met) != std::bit_cast<std::uint64_t>(all[i])) {
      number = {};
      value = all;
      return;
    }
  }
}

void PackedSeries::Times::put(std::size_t first, std::size_t rows, std::int64_t* to) const {
  const auto put_steps = [=, base = base, step = step](const auto& steps_of) {
    for (std::size_t i = 0; i < rows; ++i) to[i] = base + step * std::int64_t{steps_of(i)};
  };
  if (!time_ns.empty()) {
    std::copy_n(time_ns.data() + first, rows, to);
  } else if (!few_steps.empty()) {
    put_steps([steps = few_steps.data() + first](std::size_t i) { return steps[i]; });
  } else if (!many_steps.empty()) {
    put_steps([steps = many_steps.data() + first](std::size_t i) { return steps[i]; });
  } else {
    put_steps([first](std::size_t i) { return static_cast<std::int64_t>(first + i); });
  }
}

template <class T>
void PackedSeries::Mostly<T>::put(std::size_t first, std::size_t rows, T* to) const {
  if (each.empty()) {
    std::fill_n(to, rows, all);
  } else {
    std::copy_n(each.data() + first, rows, to);
  }
}

void PackedSeries::Angles::put(std::size_t first, std::size_t rows, const Grid& grid,
                               double* to) const {
  if (number.empty()) {
    std::copy_n(value.data() + first, rows, to);
  } else {
    const double* values = grid.value.data();
    const std::uint16_t* numbers = number.data() + first;
    for (std::size_t i = 0; i < rows; ++i) to[i] = values[numbers[i]];
  }
}

std::pair<double, double> PackedSeries::angles(std::size_t row) const {
  const std::size_t block = row / kBlockRows, place = row % kBlockRows;
  if (block >= blocks_.size()) return {tail_.azimuth[place], tail_.zenith[place]};
  return {blocks_[block].azimuth.at(place, azimuth_grid_),
          blocks_[block].zenith.at(place, zenith_grid_)};
}

std::size_t PackedSeries::first_at(ShotRange range, std::int64_t wanted_ns) const {
  require_rows("range", range.begin, range.end, size());
  std::size_t begin = range.begin, left = range.size(), step = 1;
  for (; step < left && time_ns(begin + step - 1) < wanted_ns; step *= 2) {
    begin += step;
    left -= step;
  }
  for (left = std::min(left, step); left > 0;) {
    const std::size_t half = left / 2;
    if (time_ns(begin + half) < wanted_ns) {
      begin += half + 1;
      left -= half + 1;
    } else {
      left = half;
    }
  }
  return begin;
}

template <class See>
void PackedSeries::visit(ShotRange range, const See& see) const {
  require_rows("rows", range.begin, range.end, size());
  for (std::size_t row = range.begin; row < range.end;) {
    const std::size_t block = row / kBlockRows, first = row % kBlockRows;
    const std::size_t rows = std::min(kBlockRows - first, range.end - row);
    see(block < blocks_.size() ? &blocks_[block] : nullptr, first, rows, row - range.begin);
    row += rows;
  }
}

std::vector<std::size_t> PackedSeries::shots_of_beams() const {
  std::vector<std::size_t> shots(largest_beam_ + std::size_t{1}, 0);
  visit({0, size()}, [&](const Block* block, std::size_t, std::size_t rows, std::size_t) {
    if (block != nullptr && block->beam.each.empty()) {
      shots[block->beam.all] += rows;
    } else {
      for (const std::uint8_t beam : block != nullptr ? block->beam.each : tail_.beam)
        ++shots[beam];
    }
  });
  return shots;
}

template <class T, class Put>
void PackedSeries::put_column(ShotRange range, const std::vector<T>& tail, const Put& put,
                              std::vector<T>& out) const {
  out.resize(range.size());
  visit(range, [&](const Block* block, std::size_t first, std::size_t rows, std::size_t at) {
    if (block != nullptr) {
      put(*block, first, rows, out.data() + at);
    } else {
      std::copy_n(tail.data() + first, rows, out.data() + at);
    }
  });
}

template <class T, class Column>
void PackedSeries::put_column(ShotRange range, const std::vector<T>& tail, Column Block::*column,
                              std::vector<T>& out) const {
  put_column(
      range, tail,
      [column](const Block& block, std::size_t first, std::size_t rows, T* to) {
        (block.*column).put(first, rows, to);
      },
      out);
}

void PackedSeries::times(ShotRange range, std::vector<std::int64_t>& out) const {
  put_column(range, tail_.time_ns, &Block::time, out);
}

AngleSeries PackedSeries::rows(ShotRange range) const {
  AngleSeries out;
  rows(range, out);
  return out;
}

void PackedSeries::rows(ShotRange range, AngleSeries& out) const {
  const auto put_angles = [&](const Grid& grid, const std::vector<double>& tail,
                              Angles Block::*column, std::vector<double>& to) {
    put_column(
        range, tail,
        [&grid, column](const Block& block, std::size_t first, std::size_t rows, double* at) {
          (block.*column).put(first, rows, grid, at);
        },
        to);
  };
  times(range, out.time_ns);
  put_angles(azimuth_grid_, tail_.azimuth, &Block::azimuth, out.azimuth);
  put_angles(zenith_grid_, tail_.zenith, &Block::zenith, out.zenith);
  put_column(range, tail_.beam, &Block::beam, out.beam);
  put_column(range, tail_.azimuth_rounding_variance, &Block::azimuth_variance,
             out.azimuth_rounding_variance);
  put_column(range, tail_.zenith_rounding_variance, &Block::zenith_variance,
             out.zenith_rounding_variance);
  out.range.clear();
  out.intensity.clear();
  if (!has_ranges_) return;
  put_column(
      range, tail_.range,
      [](const Block& block, std::size_t first, std::size_t rows, double* to) {
        std::copy_n(block.range.data() + first, rows, to);
      },
      out.range);
  put_column(range, tail_.intensity, &Block::intensity, out.intensity);
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
    if (has_ranges_) {
      append_part(series.range, begin, end, tail_.range);
      if (!series.intensity.empty()) {
        append_part(series.intensity, begin, end, tail_.intensity);
      }
      tail_.intensity.resize(tail_.size(), 0);
    }
    if (tail_.size() == kBlockRows) pack_tail();
  }
}

void PackedSeries::append(const PackedSeries& other, std::span<const std::size_t> rows) {
  for (const std::size_t row : rows) require_place("row", row, other.size());
  if (rows.empty()) return;
  if (size() == 0) has_ranges_ = other.has_ranges_;
  require_length("range", other.has_ranges_ ? rows.size() : 0, has_ranges_ ? rows.size() : 0);
  while (!rows.empty()) {
    // Those of one block, as many as fit the tail.
    const std::size_t block = rows.front() / kBlockRows, before = tail_.size();
    const std::size_t most = std::min(rows.size(), kBlockRows - before);
    std::size_t count = 1;
    while (count < most && rows[count] / kBlockRows == block) ++count;
    const auto gather = [&](const auto& value_at, auto& column) {
      column.resize(before + count);
      auto* const to = column.data() + before;
      for (std::size_t i = 0; i < count; ++i) to[i] = value_at(rows[i] % kBlockRows);
    };
    if (block < other.blocks_.size()) {
      const Block& from = other.blocks_[block];
      const auto angles = [&](const Angles& all, const Grid& grid) {
        return [&](std::size_t i) { return all.at(i, grid); };
      };
      const auto each = [](const auto& all) { return [&](std::size_t i) { return all.at(i); }; };
      gather(each(from.time), tail_.time_ns);
      gather(angles(from.azimuth, other.azimuth_grid_), tail_.azimuth);
      gather(angles(from.zenith, other.zenith_grid_), tail_.zenith);
      gather(each(from.beam), tail_.beam);
      gather(each(from.azimuth_variance), tail_.azimuth_rounding_variance);
      gather(each(from.zenith_variance), tail_.zenith_rounding_variance);
      if (has_ranges_) {
        gather(each(from.range), tail_.range);
        gather(each(from.intensity), tail_.intensity);
      }
    } else {
      for (const std::size_t row : rows.first(count)) tail_.append(other.tail_, row % kBlockRows);
    }
    for (std::size_t i = before; i < tail_.size(); ++i) {
      largest_beam_ = std::max(largest_beam_, tail_.beam[i]);
    }
    if (tail_.size() == kBlockRows) pack_tail();
    rows = rows.subspan(count);
  }
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
                                            tail_.range,
                                            {}});
  if (has_ranges_) block.intensity = mostly(tail_.intensity);
  block.azimuth = Angles(tail_.azimuth, block.azimuth_variance, azimuth_grid_);
  block.zenith = Angles(tail_.zenith, block.zenith_variance, zenith_grid_);
  tail_.clear();
}

std::vector<ShotRange> stretches(const PackedSeries& series, double longest_gap) {
  require_between("longest gap", longest_gap, 0, kMostSeconds, "s");
  std::vector<ShotRange> ranges;
  const auto longest_ns = static_cast<std::int64_t>(longest_gap * 1e9);
  std::int64_t before = 0;
  std::vector<std::int64_t> times;
  for (const ShotRange& some : blocks_of({0, series.size()})) {
    series.times(some, times);
    for (std::size_t i = some.begin; const std::int64_t time : times) {
      if (i == 0 || time <= before || time - before > longest_ns) ranges.push_back({i, i});
      ranges.back().end = ++i;
      before = time;
    }
  }
  return ranges;
}

PackedSeries thinned(const PackedSeries& series, double rate, std::vector<ShotRange>& ranges) {
  PackedSeries result;
  TickSampler ticks(rate);
  const std::vector<std::size_t> shots = series.shots_of_beams();
  for (std::size_t beam = 0; beam < shots.size(); ++beam) {
    if (shots[beam] > 0) ticks.expect(static_cast<std::uint8_t>(beam));
  }
  std::vector<std::size_t> taken;
  const auto put = [&] {
    result.append(series, taken);
    taken.clear();
  };
  for (ShotRange& range : ranges) {
    require_rows("range", range.begin, range.end, series.size());
    const std::size_t begin = result.size();
    if (range.size() > 0) ticks.restart(series.time_ns(range.begin));
    for (std::size_t row = range.begin; row < range.end;
         row = series.first_at({row + 1, range.end}, ticks.next_ns())) {
      if (ticks.take(series.time_ns(row), series.beam(row))) taken.push_back(row);
      if (taken.size() == PackedSeries::kBlockRows) put();
    }
    put();
    range = {begin, result.size()};
  }
  return result;
}

}  // namespace risley::estimation
