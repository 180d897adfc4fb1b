// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/trajectory_audit.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"
#include "risley/trajectories/geodesy.hpp"

namespace risley::trajectories {
namespace {

constexpr double kSecondsPerNs = 1e-9;

void include(Extent& extent, double value, bool first) {
  extent.min = first ? value : std::min(extent.min, value);
  extent.max = first ? value : std::max(extent.max, value);
}

/// A function of many values, separately for each accuracy.
template <class Function>
PoseAccuracy for_each_accuracy(const std::vector<PoseAccuracy>& all, Function&& function) {
  const auto of = [&](auto&& get) {
    std::vector<double> values;
    values.reserve(all.size());
    for (const PoseAccuracy& one : all) values.push_back(get(one));
    return function(values);
  };
  PoseAccuracy result;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    result.position[axis] = of([axis](const PoseAccuracy& one) { return one.position[axis]; });
  }
  result.roll = of([](const PoseAccuracy& one) { return one.roll; });
  result.pitch = of([](const PoseAccuracy& one) { return one.pitch; });
  result.heading = of([](const PoseAccuracy& one) { return one.heading; });
  return result;
}

RecordTimes times_of(const std::vector<std::int64_t>& times_ns, std::int64_t median_ns,
                     std::vector<TrajectoryGap> gaps) {
  RecordTimes times;
  times.records = times_ns.size();
  times.first_ns = times_ns.front();
  times.last_ns = times_ns.back();
  times.duration_s = kSecondsPerNs * static_cast<double>(times.last_ns - times.first_ns);
  if (median_ns > 0) times.rate_hz = 1 / (kSecondsPerNs * static_cast<double>(median_ns));
  times.gaps = std::move(gaps);
  for (const TrajectoryGap& gap : times.gaps) {
    times.gaps_total_s +=
        kSecondsPerNs * static_cast<double>(gap.end_ns - gap.begin_ns - median_ns);
  }
  return times;
}

std::string time_words(std::int64_t time_ns) {
  return fmt::format("{:.3f} s", kSecondsPerNs * static_cast<double>(time_ns));
}

}  // namespace

TrajectoryAudit audit_trajectory(const Trajectory& t, const InterpolationOptions& options,
                                 const Progress& progress) {
  const Interpolation interpolation(t, options);
  TrajectoryAudit audit;
  audit.warnings = t.warnings;
  audit.times = times_of(t.time_ns, interpolation.median_step_ns(), interpolation.gaps());
  if (t.frame == Frame::geocentric) audit.latitude = audit.longitude = Extent{};
  std::size_t next_gap = 0, fastest_at = 0, turning_at = 0;
  double widest_turn = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    constexpr std::size_t kOften = 4096;
    if (i % kOften == 0) progress.report(static_cast<double>(i) / static_cast<double>(t.size()));
    const bool first = i == 0;
    if (t.frame == Frame::geocentric) {
      const Geodetic place = geodetic_from_geocentric(t.position[i]);
      include(*audit.latitude, place.latitude, first);
      include(*audit.longitude, place.longitude, first);
      include(audit.height, place.height, first);
    } else {
      include(audit.height, t.position[i].z(), first);
    }
    const RollPitchHeading angles = roll_pitch_heading(t.frame, t.position[i], t.attitude[i]);
    include(audit.roll, angles.roll, first);
    include(audit.pitch, angles.pitch, first);
    if (first) continue;
    const auto& gaps = interpolation.gaps();
    if (next_gap < gaps.size() && gaps[next_gap].row == i - 1) {
      ++next_gap;
      continue;
    }
    const double step = kSecondsPerNs * static_cast<double>(t.time_ns[i] - t.time_ns[i - 1]);
    const double speed = (t.position[i] - t.position[i - 1]).norm() / step;
    const double turn = t.attitude[i].angularDistance(t.attitude[i - 1]);
    if (speed > audit.fastest) {
      audit.fastest = speed;
      fastest_at = i;
    }
    if (turn / step > audit.fastest_turning) {
      audit.fastest_turning = turn / step;
      turning_at = i;
    }
    widest_turn = std::max(widest_turn, turn);
  }
  if (!audit.times.gaps.empty()) {
    const auto longest = std::ranges::max_element(
        audit.times.gaps,
        [](const auto& a, const auto& b) { return a.end_ns - a.begin_ns < b.end_ns - b.begin_ns; });
    warn(audit.warnings, kWarning.trajectory_gaps,
         "{} {} without records, the longest {:.3f} s from {}: there are no poses in them",
         audit.times.gaps.size(), audit.times.gaps.size() == 1 ? "gap" : "gaps",
         kSecondsPerNs * static_cast<double>(longest->end_ns - longest->begin_ns),
         time_words(longest->begin_ns));
  }
  constexpr double kImpossibleSpeed = 1000;             // m/s
  constexpr double kWideTurn = 30 * kRadiansPerDegree;  // between records
  constexpr double kImpossibleTurning = 1500 * kRadiansPerDegree;
  if (audit.fastest > kImpossibleSpeed) {
    warn(audit.warnings, kWarning.trajectory_jumps,
         "the position moves by {:.0f} m/s at {}: it jumps", audit.fastest,
         time_words(t.time_ns[fastest_at]));
  }
  if (audit.fastest_turning > kImpossibleTurning) {
    warn(audit.warnings, kWarning.trajectory_jumps,
         "the attitude turns by {:.0f} degrees per second at {}: it jumps",
         degrees_from_radians(audit.fastest_turning), time_words(t.time_ns[turning_at]));
  } else if (widest_turn > kWideTurn) {
    warn(audit.warnings, kWarning.trajectory_gaps,
         "the attitude turns by up to {:.0f} degrees between records: they are too few for poses "
         "between them",
         degrees_from_radians(widest_turn));
  }
  if (t.velocity_frame && t.velocity_frame->name == "undecided") {
    warn(audit.warnings, kWarning.velocity_frame, "velocities are left out: {}",
         t.velocity_frame->reason);
  }
  if (t.time_scale == TimeScale::unknown) {
    warn(audit.warnings, kWarning.clock_unknown,
         "the origin of the times is not stated: a clock offset must align the recording's clock "
         "with them");
  }
  if (!t.accuracy.empty()) audit.accuracy = for_each_accuracy(t.accuracy, median);
  return audit;
}

AccuracyAudit audit_accuracies(const AccuracyRecords& accuracies) {
  const std::vector<std::int64_t>& times = accuracies.time_ns;
  require_at_least("records", times.size(), 1);
  require_length("accuracy", accuracies.accuracy.size(), times.size());
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) {
    if (times[i] <= times[i - 1]) {
      throw InvalidArgument(
          fmt::format("time_ns[{}] = {}, allowed later than {}", i, times[i], times[i - 1]));
    }
    steps.push_back(static_cast<double>(times[i] - times[i - 1]));
  }
  std::vector<double> ordered = steps;
  const double usual = steps.empty() ? 0 : median(ordered);
  std::vector<TrajectoryGap> gaps;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] > InterpolationOptions{}.gap_steps * usual) {
      gaps.push_back({i, times[i], times[i + 1]});
    }
  }
  AccuracyAudit audit;
  audit.times = times_of(times, std::llround(usual), std::move(gaps));
  audit.median = for_each_accuracy(accuracies.accuracy, median);
  audit.worst = for_each_accuracy(accuracies.accuracy, [](const std::vector<double>& values) {
    return *std::ranges::max_element(values);
  });
  return audit;
}

std::string angle_words(double angle) {
  require_finite("angle", angle, "rad");
  const double degrees = degrees_from_radians(angle), minutes = 60 * degrees;
  return fmt::format("{:.2g} degree ({:.1f} arc-minute{})", degrees, minutes,
                     fmt::format("{:.1f}", minutes) == "1.0" ? "" : "s");
}

}  // namespace risley::trajectories
