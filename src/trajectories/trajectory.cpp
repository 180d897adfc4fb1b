// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "trajectories/row_order.hpp"

namespace risley::trajectories {
namespace {

/// Largest distance of two times: half of the range of 64 bits, so that differences fit.
constexpr std::int64_t kLongestSpan_ns = (std::int64_t{1} << 62) - 1;

/// @throws InvalidArgument that names the column and the row
void require_finite_row(std::string_view column, std::size_t row, const Eigen::Vector3d& value,
                        std::string_view unit) {
  if (value.allFinite()) return;
  throw InvalidArgument(fmt::format("{}[{}] = ({}, {}, {}) {}, allowed finite", column, row,
                                    value.x(), value.y(), value.z(), unit));
}

void require_lengths(const Trajectory& trajectory) {
  require_length("position", trajectory.position.size(), trajectory.size());
  require_length("attitude", trajectory.attitude.size(), trajectory.size());
  require_length_or_none("velocity", trajectory.velocity.size(), trajectory.size());
  require_length_or_none("accuracy", trajectory.accuracy.size(), trajectory.size());
}

}  // namespace

namespace {

/// [TimeScale], names in files and in sentences.
struct ScaleName {
  const char *name, *words;
};
constexpr ScaleName kScaleNames[] = {{"unknown", "of a scale that the file does not name"},
                                     {"gps-second-of-week", "GPS second of week"},
                                     {"utc-second-of-day", "UTC second of day"},
                                     {"gps", "GPS second since 1980"},
                                     {"adjusted-gps", "adjusted GPS second"},
                                     {"utc-unix", "UTC second since 1970"}};

}  // namespace

std::string to_string(TimeScale scale) { return kScaleNames[static_cast<int>(scale)].name; }
std::string words_of(TimeScale scale) { return kScaleNames[static_cast<int>(scale)].words; }

std::string to_string(Frame frame) { return frame == Frame::geocentric ? "geocentric" : "local"; }

Eigen::Quaterniond ned_from_body(const RollPitchHeading& angles) {
  require_finite("roll", angles.roll, "rad");
  require_finite("pitch", angles.pitch, "rad");
  require_finite("heading", angles.heading, "rad");
  return Eigen::AngleAxisd(angles.heading, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(angles.pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(angles.roll, Eigen::Vector3d::UnitX());
}

RollPitchHeading roll_pitch_heading(const Eigen::Quaterniond& ned_from_body) {
  require_unit_length("attitude", ned_from_body.norm());
  const Eigen::Matrix3d turn = ned_from_body.normalized().toRotationMatrix();
  // The nose in ned axes is the first column. Only its horizontal part has a heading.
  const double level = std::hypot(turn(0, 0), turn(1, 0));
  RollPitchHeading angles;
  angles.pitch = std::atan2(-turn(2, 0), level);
  constexpr double kVertical = 1e-12;  // rad
  if (level < kVertical) {
    angles.heading = wrap_to_two_pi(std::atan2(-turn(0, 1), turn(1, 1)));
    return angles;
  }
  angles.roll = std::atan2(turn(2, 1), turn(2, 2));
  angles.heading = wrap_to_two_pi(std::atan2(turn(1, 0), turn(0, 0)));
  return angles;
}

void require_trajectory(const Trajectory& trajectory) {
  require_at_least("records", trajectory.size(), 1);
  require_lengths(trajectory);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const std::int64_t time_ns = trajectory.time_ns[i];
    if (i > 0 && time_ns <= trajectory.time_ns[i - 1]) {
      throw InvalidArgument(fmt::format("time_ns[{}] = {}, allowed later than time_ns[{}] = {}", i,
                                        time_ns, i - 1, trajectory.time_ns[i - 1]));
    }
    if (saturating_difference(time_ns, trajectory.time_ns[0]) > kLongestSpan_ns) {
      throw InvalidArgument(
          fmt::format("time_ns[{}] = {}, allowed within 146 years of the first", i, time_ns));
    }
    require_finite_row("position", i, trajectory.position[i], "m");
    const double length = trajectory.attitude[i].norm();
    if (!(std::abs(length - 1) < 1e-6)) {
      throw InvalidArgument(
          fmt::format("attitude[{}] has length {:.9g}, expected a unit quaternion", i, length));
    }
    if (trajectory.frame == Frame::geocentric) {
      const double distance = trajectory.position[i].norm();
      const double least = kSemiMajorAxis * (1 - kFlattening) + kLowestHeight;
      if (!(distance >= least && distance <= kSemiMajorAxis + kHighestHeight)) {
        throw InvalidArgument(
            fmt::format("position[{}] is {:.9g} m from the centre of the Earth, allowed {:.9g} to "
                        "{:.9g}",
                        i, distance, least, kSemiMajorAxis + kHighestHeight));
      }
    }
    if (!trajectory.velocity.empty()) {
      require_finite_row("velocity", i, trajectory.velocity[i], "m/s");
    }
    if (!trajectory.accuracy.empty()) {
      const PoseAccuracy& accuracy = trajectory.accuracy[i];
      require_finite_row("accuracy.position", i, accuracy.position, "m");
      require_finite_row("accuracy.attitude", i, {accuracy.roll, accuracy.pitch, accuracy.heading},
                         "rad");
      const double least =
          std::min({accuracy.position.minCoeff(), accuracy.roll, accuracy.pitch, accuracy.heading});
      if (least < 0) {
        throw InvalidArgument(fmt::format("accuracy[{}] has {:g}, allowed 0 and more", i, least));
      }
    }
  }
}

Eigen::Matrix3d ned_axes(Frame frame, const Eigen::Vector3d& position) {
  if (frame == Frame::geocentric) return geocentric_from_ned(geodetic_from_geocentric(position));
  Eigen::Matrix3d axes;
  axes << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return axes;
}

RollPitchHeading roll_pitch_heading(Frame frame, const Eigen::Vector3d& position,
                                    const Eigen::Quaterniond& frame_from_body) {
  return roll_pitch_heading(Eigen::Quaterniond(ned_axes(frame, position)).conjugate() *
                            frame_from_body);
}

RowOrder row_order(const std::vector<std::int64_t>& times) {
  RowOrder order;
  TimeOrder& found = order.times;
  std::int64_t latest = times.empty() ? 0 : times.front();
  bool in_order = true;
  for (std::size_t i = 1; i < times.size(); ++i) {
    in_order = in_order && times[i] > times[i - 1];
    if (times[i] < latest) {
      ++found.moved;
      const std::int64_t back = saturating_difference(latest, times[i]);
      if (back > found.largest_back_ns) {
        found.largest_back_ns = back;
        found.largest_back_at = i;
      }
    }
    latest = std::max(latest, times[i]);
  }
  if (in_order) return order;
  std::vector<std::size_t> rows(times.size());
  std::iota(rows.begin(), rows.end(), std::size_t{0});
  std::ranges::stable_sort(rows, [&](std::size_t a, std::size_t b) { return times[a] < times[b]; });
  for (const std::size_t row : rows) {
    if (order.rows.empty() || times[row] != times[order.rows.back()]) {
      order.rows.push_back(row);
      continue;
    }
    if (found.repeated++ == 0) found.repeated_at = row;
  }
  return order;
}

TimeOrder order_by_time(Trajectory& trajectory) {
  require_lengths(trajectory);
  const RowOrder order = row_order(trajectory.time_ns);
  if (order.rows.empty()) return order.times;
  reorder(trajectory.position, order.rows);
  reorder(trajectory.attitude, order.rows);
  reorder(trajectory.velocity, order.rows);
  reorder(trajectory.accuracy, order.rows);
  reorder(trajectory.time_ns, order.rows);
  return order.times;
}

}  // namespace risley::trajectories
