// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/flown_strips.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"

namespace risley::trajectories {
namespace {

constexpr std::int64_t kStripSecond = 1'000'000'000;

/// How the platform moves over ground during one second.
struct SecondOfFlight {
  std::int64_t begin_ns = 0;
  double course = 0, way = 0;  ///< rad, m
  double heading = 0;          ///< of the body where the second begins, rad
};

/// The whole seconds of a flight that have poses at both ends and no gap between.
std::vector<SecondOfFlight> seconds_of_flight(const Interpolation& interpolation) {
  const Trajectory& all = interpolation.trajectory();
  std::vector<SecondOfFlight> seconds;
  Interpolation::Cursor cursor = interpolation.cursor();
  std::optional<Pose> before;
  for (std::int64_t t = all.time_ns.front(); t <= all.time_ns.back(); t += kStripSecond) {
    const std::optional<Pose> pose = cursor.at(t);
    if (before && pose) {
      const Eigen::Vector3d way =
          ned_axes(all.frame, before->position).transpose() * (pose->position - before->position);
      const double heading =
          roll_pitch_heading(all.frame, before->position, before->attitude).heading;
      seconds.push_back(
          {t - kStripSecond, std::atan2(way.y(), way.x()), way.head<2>().norm(), heading});
    }
    before = pose;
  }
  return seconds;
}

}  // namespace

std::vector<FlownStrip> flown_strips(const Interpolation& interpolation,
                                     const FlownStripOptions& options) {
  require_above("fastest_turn", options.fastest_turn, 0, "rad/s");
  require_above("widest_course", options.widest_course, 0, "rad");
  require_above("slowest_share", options.slowest_share, 0);
  require_above("shortest_s", options.shortest_s, 0, "s");
  const std::vector<SecondOfFlight> seconds = seconds_of_flight(interpolation);
  if (seconds.empty()) return {};
  std::vector<double> ways;
  for (const SecondOfFlight& second : seconds) ways.push_back(second.way);
  const auto middle = ways.begin() + static_cast<std::ptrdiff_t>(ways.size() / 2);
  std::nth_element(ways.begin(), middle, ways.end());
  const double least = options.slowest_share * *middle;

  std::vector<FlownStrip> strips;
  for (std::size_t i = 0; i < seconds.size();) {
    std::size_t end = i;
    double lowest = 0, highest = 0, course = seconds[i].course, length = 0;
    double left = 0, right = 0;  // of the heading in the beginning
    while (end < seconds.size() && seconds[end].way > 0 && seconds[end].way >= least) {
      if (end > i) {
        if (seconds[end].begin_ns != seconds[end - 1].begin_ns + kStripSecond) break;
        const double turn = wrap_to_pi(seconds[end].course - course);
        if (std::abs(turn) > options.fastest_turn) break;
        course += turn;
      }
      const double off = course - seconds[i].course;
      if (std::max(highest, off) - std::min(lowest, off) > options.widest_course) break;
      const double turned = wrap_to_pi(seconds[end].heading - seconds[i].heading);
      if (std::max(right, turned) - std::min(left, turned) > options.widest_course) break;
      left = std::min(left, turned);
      right = std::max(right, turned);
      lowest = std::min(lowest, off);
      highest = std::max(highest, off);
      length += seconds[end].way;
      ++end;
    }
    if (end == i) {
      ++i;
      continue;
    }
    const std::int64_t begin_ns = seconds[i].begin_ns;
    const std::int64_t end_ns = seconds[end - 1].begin_ns + kStripSecond;
    if (1e-9 * static_cast<double>(end_ns - begin_ns) >= options.shortest_s) {
      const double mean = seconds[i].course + 0.5 * (lowest + highest);
      strips.push_back({begin_ns, end_ns, wrap_to_two_pi(mean), length});
    }
    i = end;
  }
  return strips;
}

}  // namespace risley::trajectories
