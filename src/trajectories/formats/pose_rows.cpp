// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "trajectories/formats/pose_rows.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/saturating.hpp"

#include "trajectories/row_order.hpp"

namespace risley::trajectories {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
/// Largest delay of a record; a larger step back indicates another flight or another clock.
constexpr std::int64_t kLatest_ns = kSecond_ns;
constexpr double kFastest = 1e4;        // m/s
constexpr double kFarthest = 1e7;       // m, from the origin of a map
constexpr double kWorstPosition = 1e5;  // m
constexpr double kWorstAngle = kTwoPi;  // rad

}  // namespace

std::optional<std::int64_t> period_ns(TimeScale scale) {
  if (scale == TimeScale::gps_second_of_week) return 604'800 * kSecond_ns;
  if (scale == TimeScale::utc_second_of_day) return 86'400 * kSecond_ns;
  return std::nullopt;
}

int unwrap_times(std::vector<std::int64_t>& times_ns, std::int64_t period) {
  constexpr int kMost = 1000;  // weeks; no flight takes longer
  int periods = 0, most = 0;
  std::int64_t before = times_ns.empty() ? 0 : times_ns.front();
  for (std::int64_t& time : times_ns) {
    const std::int64_t back = before - saturating_sum(time, periods * period);
    if (back > period / 2 && periods < kMost) ++periods;
    if (back < -period / 2 && periods > 0) --periods;
    time = saturating_sum(time, periods * period);
    before = time;
    most = std::max(most, periods);
  }
  return most;
}

TimeScale scale_by_size(const std::vector<std::int64_t>& ascending) {
  constexpr std::int64_t kFirst_ns = 883'612'800 * kSecond_ns,
                         kLast_ns = 4'102'444'800 * kSecond_ns;
  const bool fits =
      !ascending.empty() && ascending.front() >= kFirst_ns && ascending.back() <= kLast_ns;
  return fits ? TimeScale::utc_unix : TimeScale::unknown;
}

std::vector<Warning> order_warnings(const TimeOrder& found, std::size_t records,
                                    const std::function<FilePlace(std::size_t)>& place_of) {
  std::vector<Warning> warnings;
  if (found.moved > 0) {
    warnings.push_back(
        {kWarning.rows_sorted,
         fmt::format("records that come after later ones: {} of {}, by up to {:.6f} s; all were "
                     "sorted by time",
                     found.moved, records, 1e-9 * static_cast<double>(found.largest_back_ns)),
         place_of(found.largest_back_at)});
  }
  if (found.repeated > 0) {
    warnings.push_back(
        {kWarning.content_left_out,
         fmt::format("records that repeat the time of an earlier one: {}; they were ignored",
                     found.repeated),
         place_of(found.repeated_at)});
  }
  return warnings;
}

Eigen::Quaterniond right_down_from_left_up(const Eigen::Quaterniond& q) {
  return {-q.x(), q.w(), q.z(), -q.y()};  // q i
}

Eigen::Quaterniond left_up_from_right_down(const Eigen::Quaterniond& q) {
  return {q.x(), -q.w(), -q.z(), q.y()};  // q (-i)
}

std::optional<Eigen::Quaterniond> unit_quaternion(const Eigen::Quaterniond& q) {
  const double length = q.norm();
  if (!(std::abs(length - 1) < 0.01)) return std::nullopt;
  if (std::abs(length - 1) < 1e-14) return q;
  return q.normalized();
}

PoseRows::PoseRows(std::string path, RowContents contents)
    : path_(std::move(path)), contents_(std::move(contents)) {
  trajectory_.format = contents_.format;
  trajectory_.time_scale = contents_.time_scale;
  trajectory_.gps_week = contents_.gps_week;
  trajectory_.frame = contents_.frame;
}

void PoseRows::add(const PoseRow& row, const FilePlace& place) {
  const auto check = [&](std::string_view name, double value, double least, double most,
                         std::string_view unit, std::string_view hint = "") {
    if (value >= least && value <= most) return;
    refuse(trajectory_.size(), place,
           fmt::format("{} = {:.10g} {}, allowed {:.6g} to {:.6g}{}", name, value, unit, least,
                       most, hint));
  };
  const auto finite = [&](std::string_view name, const Eigen::Vector3d& values, double most,
                          std::string_view unit) {
    for (const double value : values) check(name, value, -most, most, unit);
  };
  constexpr double kTurn_deg = 365;  // rounded values lie beyond 360
  if (contents_.frame == Frame::geocentric) {
    const auto in_degrees = [](double angle) { return degrees_from_radians(angle); };
    constexpr std::string_view kHint =
        "; are degrees stored where radians belong, or the other way round?";
    check("latitude", in_degrees(row.place.latitude), -90 - 1e-9, 90 + 1e-9, "deg", kHint);
    check("longitude", in_degrees(row.place.longitude), -360, 360, "deg", kHint);
    check("ellipsoidal height", row.place.height, kLowestHeight, kHighestHeight, "m");
    Geodetic within = row.place;
    within.latitude = std::clamp(within.latitude, -kPi / 2, kPi / 2);
    within.longitude = std::clamp(within.longitude, -kTwoPi, kTwoPi);
    check("roll", in_degrees(row.angles.roll), -kTurn_deg, kTurn_deg, "deg", kHint);
    check("pitch", in_degrees(row.angles.pitch), -90.0001, 90.0001, "deg", kHint);
    check("heading", in_degrees(row.angles.heading), -2 * kTurn_deg, 2 * kTurn_deg, "deg", kHint);
    trajectory_.attitude.push_back(Eigen::Quaterniond(geocentric_from_ned(within)) *
                                   ned_from_body(row.angles));
    trajectory_.attitude.back().normalize();
    trajectory_.position.push_back(geocentric_from_geodetic(within));
  } else {
    finite("position", row.position, kFarthest, "m");
    trajectory_.position.push_back(row.position);
    trajectory_.attitude.push_back(row.attitude);
  }
  if (contents_.has_velocity) {
    finite("velocity", row.velocity, kFastest, "m/s");
    trajectory_.velocity.push_back(row.velocity);
  }
  if (contents_.has_wander) {
    check("wander angle", degrees_from_radians(row.wander), -kTurn_deg, kTurn_deg, "deg");
    wander_.push_back(row.wander);
  }
  if (contents_.has_accuracy) {
    for (const double value : row.accuracy.position) {
      check("accuracy of the position", value, 0, kWorstPosition, "m");
    }
    for (const double value : {row.accuracy.roll, row.accuracy.pitch, row.accuracy.heading}) {
      check("accuracy of the attitude", value, 0, kWorstAngle, "rad");
    }
    trajectory_.accuracy.push_back(row.accuracy);
  }
  trajectory_.time_ns.push_back(row.time_ns);
  places_.push_back(place);
}

void PoseRows::refuse(std::size_t row, const FilePlace& place, const std::string& problem) const {
  const bool placed = place.line || place.byte_offset;
  throw FileError(path_, place, placed ? problem : fmt::format("record {}: {}", row + 1, problem));
}

void PoseRows::make_times_run_on() {
  const auto period = period_ns(contents_.time_scale);
  if (!period) return;
  const int crossings = unwrap_times(trajectory_.time_ns, *period);
  trajectory_.week_crossings = crossings;
  if (crossings == 0) return;
  warn(warnings(), kWarning.clock_wrapped,
       "{} ends within the trajectory: times were continued beyond it",
       contents_.time_scale == TimeScale::gps_second_of_week ? "the GPS week (604800 s)"
                                                             : "the day (86400 s)");
}

void PoseRows::put_in_order() {
  const RowOrder order = row_order(trajectory_.time_ns);
  const TimeOrder& found = order.times;
  trajectory_.time_order = found;
  if (found.largest_back_ns > kLatest_ns) {
    refuse(found.largest_back_at, places_[found.largest_back_at],
           fmt::format("time jumps back by {:.6f} s, to {:.6f} s; expected one flight with one "
                       "clock: keep only its records",
                       1e-9 * static_cast<double>(found.largest_back_ns),
                       1e-9 * static_cast<double>(trajectory_.time_ns[found.largest_back_at])));
  }
  if (order.rows.empty()) return;
  const auto place_of = [this](std::size_t row) { return places_[row]; };
  append(warnings(), order_warnings(found, trajectory_.size(), place_of));
  reorder(wander_, order.rows);
  static_cast<void>(order_by_time(trajectory_));
}

Trajectory PoseRows::finish() {
  if (trajectory_.size() == 0) throw FileError(path_, {}, "holds no record");
  make_times_run_on();
  put_in_order();
  if (!wander_.empty()) {
    std::vector<double> sorted = wander_;
    std::ranges::sort(sorted);
    trajectory_.wander = AngleSpread{sorted.front(), sorted[sorted.size() / 2], sorted.back()};
  }
  settle_velocities(trajectory_, wander_, contents_.velocity_axes);
  return std::move(trajectory_);
}

}  // namespace risley::trajectories
