// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/flown_strips.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "risley/core/angle.hpp"
#include "risley/core/median.hpp"
#include "risley/core/require.hpp"

namespace risley::trajectories {
namespace {

constexpr std::int64_t kStripSecond = 1'000'000'000;

/// Motion of the platform over ground during one second.
struct SecondOfFlight {
  std::int64_t begin_ns = 0;
  double course = 0, way = 0;  ///< rad, m
  double heading = 0;          ///< of the body at the beginning of the second, rad
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

/// How far one can go from a given second without turning.
struct Reach {
  std::size_t end = 0;  ///< the first second behind
  double course = 0, length = 0;
};

Reach reach_of(std::span<const SecondOfFlight> seconds, std::size_t begin, double least_way,
               double widest) {
  const SecondOfFlight& first = seconds[begin];
  Reach reach{begin, first.course, 0};
  double lowest = 0, highest = 0, left = 0, right = 0;  // of course and heading, from the first
  double sum = 0;                                       // of courses, from the first
  for (std::size_t i = begin; i < seconds.size(); ++i) {
    const SecondOfFlight& one = seconds[i];
    if (one.way <= 0 || one.way < least_way) break;
    if (i > begin && one.begin_ns != seconds[i - 1].begin_ns + kStripSecond) break;
    const double course = wrap_to_pi(one.course - first.course);
    const double heading = wrap_to_pi(one.heading - first.heading);
    lowest = std::min(lowest, course);
    highest = std::max(highest, course);
    left = std::min(left, heading);
    right = std::max(right, heading);
    if (highest - lowest > widest || right - left > widest) break;
    reach.end = i + 1;
    sum += course;
    reach.course = first.course + sum / static_cast<double>(reach.end - begin);
    reach.length += one.way;
  }
  return reach;
}

}  // namespace

std::vector<FlownStrip> flown_strips(const Interpolation& interpolation,
                                     const FlownStripOptions& options) {
  require_above("widest_course", options.widest_course, 0, "rad");
  require_above("slowest_share", options.slowest_share, 0);
  require_above("shortest_s", options.shortest_s, 0, "s");
  const std::vector<SecondOfFlight> seconds = seconds_of_flight(interpolation);
  if (seconds.empty()) return {};
  std::vector<double> ways;
  ways.reserve(seconds.size());
  for (const SecondOfFlight& second : seconds) ways.push_back(second.way);
  const double least = options.slowest_share * upper_median(ways);

  std::vector<Reach> reach;
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    reach.push_back(reach_of(seconds, i, least, options.widest_course));
  }
  // The longest first: one that begins at the end of a turn would break off too early.
  std::vector<FlownStrip> strips;
  std::vector<bool> taken(seconds.size(), false);
  for (;;) {
    std::size_t begin = 0, longest = 0, free = seconds.size();  // the next that is taken
    for (std::size_t i = seconds.size(); i-- > 0;) {
      if (taken[i]) free = i;
      const std::size_t end = std::min(reach[i].end, free);
      if (end > i && end - i >= longest) {
        longest = end - i;
        begin = i;
      }
    }
    if (longest == 0 || static_cast<double>(longest) < options.shortest_s) break;
    const Reach found =
        reach_of({seconds.data(), begin + longest}, begin, least, options.widest_course);
    strips.push_back({seconds[begin].begin_ns, seconds[found.end - 1].begin_ns + kStripSecond,
                      wrap_to_two_pi(found.course), found.length});
    std::fill_n(taken.begin() + begin, longest, true);
  }
  std::ranges::sort(
      strips, [](const FlownStrip& a, const FlownStrip& b) { return a.begin_ns < b.begin_ns; });
  return strips;
}

}  // namespace risley::trajectories
