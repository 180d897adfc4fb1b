// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/angle_series.hpp"

#include <cmath>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::estimation {
namespace {

constexpr std::int64_t kHeadNs = 1'000'000'000;

}  // namespace

ShotSelector::ShotSelector(const SelectionOptions& options) : options_(options) {
  if (options_.rate && !(*options_.rate > 0)) {
    throw InvalidArgument(fmt::format("rate = {} Hz, allowed above 0", *options_.rate));
  }
}

void ShotSelector::add(const recordings::Observations& o) {
  const auto append = [&](AngleSeries& series, std::size_t i) {
    const auto variance = [](float step) { return double(step) * double(step) / 12.0; };
    series.time_ns.push_back(o.time_ns[i]);
    series.azimuth.push_back(o.azimuth[i]);
    series.zenith.push_back(o.zenith[i]);
    series.azimuth_rounding_variance.push_back(variance(o.azimuth_resolution[i]));
    series.zenith_rounding_variance.push_back(variance(o.zenith_resolution[i]));
  };
  for (std::size_t i = 0; i < o.size(); ++i) {
    ++counts_.rows;
    if (!o.valid[i] || !std::isfinite(o.azimuth[i]) || !std::isfinite(o.zenith[i])) {
      ++counts_.invalid;
      continue;
    }
    const bool first = head_.size() == 0;
    if (!first && o.time_ns[i] <= last_time_ns_) {
      ++(o.time_ns[i] == last_time_ns_ ? counts_.further_returns : counts_.out_of_order);
      continue;
    }
    last_time_ns_ = o.time_ns[i];
    if (first || o.time_ns[i] - head_.time_ns.front() <= kHeadNs) append(head_, i);
    if (options_.rate && !first && o.time_ns[i] < next_tick_) continue;
    append(series_, i);
    if (options_.rate) {
      // Ticks stand on a fixed grid, so that gaps and jitter do not move them.
      const double since = 1e-9 * double(o.time_ns[i] - series_.time_ns.front());
      const double tick = std::floor(since * *options_.rate + 1e-6) + 1.0;
      next_tick_ = series_.time_ns.front() + std::llround(tick / *options_.rate * 1e9);
    }
  }
}

}  // namespace risley::estimation
