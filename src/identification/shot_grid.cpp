// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/shot_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"

namespace risley::identification {
namespace {

constexpr std::size_t kFewestShots = 40;
/// Recorded times this share of a step off the grid are not rounded whole steps.
constexpr double kLargestOffset = 0.3;

}  // namespace

ShotGrid shot_grid(const estimation::AngleSeries& series, estimation::ShotRange rows) {
  if (rows.size() < kFewestShots) {
    throw EstimationError(
        fmt::format("the longest stretch of the recording without a gap holds {} valid shots, at "
                    "least {} are needed to identify a train",
                    rows.size(), kFewestShots));
  }
  ShotGrid grid;
  grid.origin_ns = series.time_ns[rows.begin];
  std::vector<double> stamp;
  for (std::size_t i = rows.begin; i < rows.end; ++i) {
    stamp.push_back(1e-9 * static_cast<double>(series.time_ns[i] - grid.origin_ns));
    grid.azimuth.push_back(series.azimuth[i]);
    grid.zenith.push_back(series.zenith[i]);
  }
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamp.size(); ++i) steps.push_back(stamp[i] - stamp[i - 1]);
  grid.step = upper_median(steps);
  if (!(grid.step > 0)) {
    throw EstimationError(
        fmt::format("more than half of the shots have the same time as the shot before: give their "
                    "rate ({}), so that times are counted",
                    name_of(kSetting.shot_rate)));
  }
  grid.slot.assign(stamp.size(), 0);
  double first = 0;  // time of slot 0 on the fitted grid
  for (int round = 0; round < 4; ++round) {
    for (std::size_t i = 1; i < stamp.size(); ++i) {
      const double steps_since = std::round((stamp[i] - stamp[i - 1]) / grid.step);
      grid.slot[i] =
          grid.slot[i - 1] + std::max<std::int64_t>(1, static_cast<std::int64_t>(steps_since));
    }
    const double n = static_cast<double>(stamp.size());
    double mean_slot = 0, mean_time = 0, square = 0, product = 0;
    for (std::size_t i = 0; i < stamp.size(); ++i) {
      mean_slot += static_cast<double>(grid.slot[i]) / n;
      mean_time += stamp[i] / n;
    }
    for (std::size_t i = 0; i < stamp.size(); ++i) {
      const double slot = static_cast<double>(grid.slot[i]) - mean_slot;
      square += slot * slot;
      product += slot * (stamp[i] - mean_time);
    }
    grid.step = product / square;
    first = mean_time - grid.step * mean_slot;
  }
  double largest = 0;
  for (std::size_t i = 0; i < stamp.size(); ++i) {
    const double offset = stamp[i] - first - grid.step * static_cast<double>(grid.slot[i]);
    largest = std::max(largest, std::abs(offset));
  }
  grid.regular = largest < kLargestOffset * grid.step;
  grid.time = stamp;
  if (grid.regular) {
    for (std::size_t i = 0; i < stamp.size(); ++i) {
      grid.time[i] = grid.step * static_cast<double>(grid.slot[i]);
    }
  }
  std::array<bool, 256> seen{};
  for (std::size_t i = rows.begin; i < rows.end; ++i) seen[series.beam[i]] = true;
  std::array<std::uint8_t, 256> place{};
  std::uint8_t emitters = 0;
  for (std::size_t beam = 0; beam < seen.size(); ++beam) {
    place[beam] = emitters;
    if (seen[beam]) ++emitters;
  }
  grid.emitters = emitters;
  for (std::size_t i = rows.begin; i < rows.end; ++i) {
    grid.emitter.push_back(place[series.beam[i]]);
  }
  return grid;
}

ShotGrid rows_of(const ShotGrid& grid, std::span<const std::size_t> rows) {
  ShotGrid part;
  part.origin_ns = grid.origin_ns;
  part.step = grid.step;
  part.regular = grid.regular;
  part.emitters = grid.emitters;
  for (const std::size_t i : rows) {
    require_place("rows", i, grid.size());
    part.slot.push_back(grid.slot[i]);
    part.time.push_back(grid.time[i]);
    part.azimuth.push_back(grid.azimuth[i]);
    part.zenith.push_back(grid.zenith[i]);
    part.emitter.push_back(grid.emitter[i]);
  }
  return part;
}

ShotGrid rows_of(const ShotGrid& grid, std::size_t begin, std::size_t end) {
  require_rows("rows", begin, end, grid.size());
  std::vector<std::size_t> rows(end - begin);
  std::iota(rows.begin(), rows.end(), begin);
  return rows_of(grid, rows);
}

}  // namespace risley::identification
