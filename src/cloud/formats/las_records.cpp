// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The points of a file: columns packed into records.
#include <algorithm>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <xsimd/xsimd.hpp>

#include "risley/core/error.hpp"
#include "risley/core/gps_time.hpp"

#include "cloud/formats/las_bytes.hpp"
#include "cloud/formats/las_layout.hpp"

namespace risley::cloud::las {
namespace {

using recordings::las::kGpsOrigin;
using recordings::las::kIntensityFactor;
using recordings::las::kSecond;

/// Greatest X, Y or Z in steps of the scale: they are stored as 32-bit integers.
constexpr double kMaxSteps = std::numeric_limits<std::int32_t>::max();
/// Added to a number of steps, it rounds it to the nearest integer, whose 32 bits are then the
/// low half of the sum.
constexpr double kRoundingShift = 0x1.8p52;

double seconds(std::int64_t time_ns, std::int64_t shift) {
  const std::int64_t whole = time_ns / kSecond;
  return static_cast<double>(whole + shift) + static_cast<double>(time_ns - whole * kSecond) / 1e9;
}

}  // namespace

void Layout::pack_coordinates(const Points& points, std::size_t first, std::size_t rows,
                              Summary& summary) {
  using Batch = xsimd::batch<double>;
  const std::size_t whole = rows - rows % Batch::size;
  const std::vector<double>* const columns[] = {&points.x, &points.y, &points.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double* from = columns[axis]->data() + first;
    double* to = coordinates_[axis].data();
    const double offset = offset_[axis];
    Batch low(summary.low[axis]), high(summary.high[axis]);
    auto inside = Batch(0.0) == Batch(0.0);
    for (std::size_t i = 0; i < whole; i += Batch::size) {
      const Batch steps = (Batch::load_unaligned(from + i) - Batch(offset)) / Batch(scale_);
      inside = inside & (xsimd::abs(steps) <= Batch(kMaxSteps));
      low = xsimd::min(low, steps);
      high = xsimd::max(high, steps);
      (steps + Batch(kRoundingShift)).store_unaligned(to + i);
    }
    bool all_inside = xsimd::all(inside);
    std::array<double, Batch::size> lows, highs;
    low.store_unaligned(lows.data());
    high.store_unaligned(highs.data());
    double least = *std::ranges::min_element(lows);
    double greatest = *std::ranges::max_element(highs);
    for (std::size_t i = whole; i < rows; ++i) {
      const double steps = (from[i] - offset) / scale_;
      all_inside = all_inside && std::fabs(steps) <= kMaxSteps;
      least = std::min(least, steps);
      greatest = std::max(greatest, steps);
      to[i] = steps + kRoundingShift;
    }
    if (!all_inside) {
      const double* wrong = std::find_if(from, from + rows, [this, offset](double value) {
        return !(std::fabs((value - offset) / scale_) <= kMaxSteps);
      });
      throw InvalidArgument(
          fmt::format("point {}: {} = {} m, allowed {} to {} m (las_scale = {} m)",
                      summary.points + static_cast<std::uint64_t>(wrong - from) + 1, "XYZ"[axis],
                      *wrong, offset - kMaxSteps * scale_, offset + kMaxSteps * scale_, scale_));
    }
    summary.low[axis] = least;
    summary.high[axis] = greatest;
  }
}

void Layout::pack_returns(const Points& points, std::size_t first, std::size_t rows,
                          Summary& summary) {
  constexpr unsigned kMost = 15;
  const std::uint8_t* number = points.return_number.data() + first;
  const std::uint8_t* total = points.number_of_returns.data() + first;
  const auto possible = [=](std::size_t i) {
    return static_cast<unsigned>(number[i] >= 1) & static_cast<unsigned>(number[i] <= total[i]) &
           static_cast<unsigned>(total[i] <= kMost);
  };
  unsigned all_possible = 1;
  for (std::size_t i = 0; i < rows; ++i) all_possible &= possible(i);
  if (all_possible == 0) {
    std::size_t i = 0;
    while (possible(i) != 0) ++i;
    const std::uint64_t point = summary.points + i + 1;
    if (total[i] < 1 || total[i] > kMost) {
      throw InvalidArgument(
          fmt::format("point {}: number_of_returns = {}, allowed 1 to {}", point, total[i], kMost));
    }
    throw InvalidArgument(
        fmt::format("point {}: return_number = {}, allowed 1 to {}", point, number[i], total[i]));
  }
  const std::uint8_t* intensity = points.intensity.data() + first;
  for (std::size_t i = 0; i < rows; ++i) {
    const std::uint32_t bits = std::uint32_t{number[i]} | (std::uint32_t{total[i]} << 4);
    returns_[i] = (std::uint32_t{intensity[i]} * kIntensityFactor) | (bits << 16);
  }
  // Two tables, because a count must not wait for the one just before it.
  std::array<std::array<std::uint32_t, 16>, 2> counts{};
  for (std::size_t i = 0; i < rows; ++i) ++counts[i % 2][number[i]];
  for (std::size_t k = 0; k < 15; ++k) {
    summary.points_by_return[k] += counts[0][k + 1] + counts[1][k + 1];
  }
}

void Layout::pack_times(const Points& points, std::size_t first, std::size_t rows) {
  const std::int64_t* time = points.time_ns.data() + first;
  if (gps_time_) {
    for (std::size_t i = 0; i < rows; ++i) {
      times_[i] = seconds(time[i], leap_seconds(time[i]) - kGpsOrigin);
    }
  } else {
    for (std::size_t i = 0; i < rows; ++i) times_[i] = seconds(time[i], 0);
  }
}

void Layout::pack(const Points& points, std::size_t first, std::size_t rows, std::uint8_t* out,
                  Summary& summary) {
  if (rows == 0) return;
  pack_coordinates(points, first, rows, summary);
  pack_returns(points, first, rows, summary);
  pack_times(points, first, rows);

  // Classification, flags, scan angle and user data are 0, the point source is 1 for one file.
  constexpr std::uint8_t kConstant[] = {0, 0, 0, 0, 1, 0};
  const std::uint16_t* source = has_point_source_ ? points.point_source.data() + first : nullptr;
  std::uint8_t* to = out;
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::memcpy(to + 4 * axis, &coordinates_[axis][i], 4);
    }
    std::memcpy(to + 12, &returns_[i], 4);
    std::memcpy(to + 16, kConstant, sizeof kConstant);
    to += 16 + sizeof kConstant;
    if (source != nullptr) put<std::uint16_t>(to - 2, source[i]);
    to = put<double>(to, times_[i]) + extra_.record_bytes();
  }
  extra_.pack(points, first, rows, out + base_record_bytes(), record_bytes());
  if (summary.points == 0) summary.first_time_ns = points.time_ns[first];
  summary.points += rows;
}

}  // namespace risley::cloud::las
