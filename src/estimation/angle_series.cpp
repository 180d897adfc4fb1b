// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/angle_series.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "risley/core/angle.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"

namespace risley::estimation {
namespace {

constexpr std::int64_t kHeadNs = 1'000'000'000;
constexpr std::int64_t kResetNs = static_cast<std::int64_t>(kClockReset * 1e9);

/// Appends rows of a recording to a series.
void append_rows(const recordings::Observations& o, ShotRange rows, bool ranges,
                 AngleSeries& series) {
  const auto copy = [rows](const auto& from, auto& to) {
    const auto first = from.begin() + static_cast<std::ptrdiff_t>(rows.begin);
    to.insert(to.end(), first, first + static_cast<std::ptrdiff_t>(rows.size()));
  };
  const auto variances = [rows](const std::vector<float>& step, std::vector<float>& to) {
    const std::size_t before = to.size();
    to.resize(before + rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      to[before + i] = step[rows.begin + i] * step[rows.begin + i] / 12.0F;
    }
  };
  copy(o.time_ns, series.time_ns);
  copy(o.azimuth, series.azimuth);
  copy(o.zenith, series.zenith);
  copy(o.beam, series.beam);
  variances(o.azimuth_resolution, series.azimuth_rounding_variance);
  variances(o.zenith_resolution, series.zenith_rounding_variance);
  if (ranges) {
    copy(o.range, series.range);
    copy(o.intensity, series.intensity);
  }
}

}  // namespace

void AngleSeries::append(std::int64_t shot_time_ns, double shot_azimuth, double shot_zenith,
                         std::uint8_t shot_beam, float shot_azimuth_variance,
                         float shot_zenith_variance) {
  time_ns.push_back(shot_time_ns);
  azimuth.push_back(shot_azimuth);
  zenith.push_back(shot_zenith);
  beam.push_back(shot_beam);
  azimuth_rounding_variance.push_back(shot_azimuth_variance);
  zenith_rounding_variance.push_back(shot_zenith_variance);
}

void AngleSeries::clear() {
  for_each_column<kSeriesColumns>([](auto& column) { column.clear(); }, *this);
}

void AngleSeries::append(const AngleSeries& other, std::size_t row) {
  require_place("row", row, other.size());
  append(other.time_ns[row], other.azimuth[row], other.zenith[row], other.beam[row],
         other.azimuth_rounding_variance[row], other.zenith_rounding_variance[row]);
  if (!other.range.empty()) range.push_back(other.range[row]);
  if (!other.intensity.empty()) {
    intensity.resize(size() - 1, 0);
    intensity.push_back(other.intensity[row]);
  }
}

AngleSeries rows_of(const AngleSeries& series, std::size_t begin, std::size_t end) {
  require_rows("rows", begin, end, series.size());
  AngleSeries rows;
  for (std::size_t i = begin; i < end; ++i) rows.append(series, i);
  return rows;
}

TickSampler::TickSampler(double rate) : rate_(rate) { require_above("rate", rate, 0, "Hz"); }

bool TickSampler::take_at_tick(std::int64_t time_ns, std::uint8_t beam) {
  if (had_turn_ == seen_) had_turn_.reset();
  if (had_turn_[beam]) {
    // A missing beam delays the others for one round only.
    if (++waited_ < seen_.count()) return false;
    had_turn_.reset();
  }
  had_turn_.set(beam);
  waited_ = 0;
  // Times are rounded to 1 ns: a shot at a tick may seem to come before it.
  const double since = 1e-9 * (static_cast<double>(time_ns - origin_ns_) + 0.6);
  const double tick = std::floor(since * rate_) + 1.0;
  next_ns_ = origin_ns_ + std::llround(tick / rate_ * 1e9);
  return true;
}

std::size_t thinning_stride(const AngleSeries& series, ShotRange rows, std::size_t most) {
  require_rows("rows", rows.begin, rows.end, series.size());
  require_at_least("most", static_cast<long long>(most), 1);
  std::size_t beams = 1;
  for (std::size_t i = rows.begin; i < rows.end; ++i) {
    beams = std::max<std::size_t>(beams, series.beam[i] + std::size_t{1});
  }
  std::size_t stride = std::max<std::size_t>(1, rows.size() / most);
  while (std::gcd(stride, beams) != 1) ++stride;
  return stride;
}

std::int64_t median_step_ns(std::span<const std::int64_t> time_ns) {
  require_at_least("number of times", static_cast<long long>(time_ns.size()), 2);
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < std::min(time_ns.size(), kMedianSteps); ++i) {
    steps.push_back(time_ns[i] - time_ns[i - 1]);
  }
  return upper_median(steps);
}

void mirror(AngleSeries& series, bool axis_up) { mirror(series.azimuth, series.zenith, axis_up); }

void mirror(std::span<double> azimuth, std::span<double> zenith, bool axis_up) {
  if (axis_up) {
    for (double& angle : azimuth) angle = -angle;
  } else {
    for (double& angle : zenith) angle = kPi - angle;
  }
}

ShotSelector::ShotSelector(const SelectionOptions& options)
    : options_(options), ticks_(options.rate.value_or(1.0)) {}

void ShotSelector::add(const recordings::Observations& o) {
  // Adjacent rows are copied together, column by column.
  ShotRange head_run, series_run;
  std::optional<std::int64_t> first_time_ns;
  if (head_.size() > 0) first_time_ns = head_.time_ns.front();
  const auto take = [&](AngleSeries& series, ShotRange& run, std::size_t row) {
    if (row != run.end) {
      append_rows(o, run, options_.ranges, series);
      run.begin = row;
    }
    run.end = row + 1;
  };
  for (std::size_t i = 0; i < o.size(); ++i) {
    ++counts_.rows;
    if (!o.valid[i] || !std::isfinite(o.azimuth[i]) || !std::isfinite(o.zenith[i])) {
      ++counts_.invalid;
      continue;
    }
    const bool first = !first_time_ns;
    const std::int64_t step = first ? 1 : o.time_ns[i] - last_time_ns_;
    if (step <= 0 && step >= -kResetNs) {
      // The rows before the first one of a piece are no longer known.
      const bool further = i == 0 ? o.return_number[i] > 1 : recordings::is_further_return(o, i);
      ++(step < 0 ? counts_.out_of_order : further ? counts_.further_returns : counts_.equal_times);
      continue;
    }
    if (step < 0) ++counts_.clock_resets;
    if (first || step < 0) ticks_.restart(o.time_ns[i]);
    if (first) first_time_ns = o.time_ns[i];
    last_time_ns_ = o.time_ns[i];
    // The head ends at the first reset.
    if (counts_.clock_resets == 0 && o.time_ns[i] - *first_time_ns <= kHeadNs) {
      take(head_, head_run, i);
    }
    if (!options_.rate || ticks_.take(o.time_ns[i], o.beam[i])) {
      take(series_, series_run, i);
      if (options_.rows) rows_.push_back(static_cast<std::size_t>(counts_.rows - 1));
    }
  }
  append_rows(o, head_run, options_.ranges, head_);
  append_rows(o, series_run, options_.ranges, series_);
}

}  // namespace risley::estimation
