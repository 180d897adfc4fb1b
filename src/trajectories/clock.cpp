// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/clock.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/core/gps_time.hpp"
#include "risley/core/require.hpp"

namespace risley::trajectories {
namespace {

constexpr std::int64_t kClockSecond = 1'000'000'000;

/// The multiple of a period that brings a time nearest to the middle of a trajectory.
std::int64_t nearest_period(const Trajectory& trajectory, std::int64_t time_ns,
                            std::int64_t period_ns) {
  const std::int64_t first = trajectory.time_ns.front();
  const std::int64_t middle = first + (trajectory.time_ns.back() - first) / 2;
  const double periods = static_cast<double>(middle - time_ns) / static_cast<double>(period_ns);
  return std::llround(periods) * period_ns;
}

std::string seconds_words(std::int64_t time_ns) {
  return fmt::format("{:.3f} s", 1e-9 * static_cast<double>(time_ns));
}

}  // namespace

std::optional<std::int64_t> shift_from_utc_ns(const Trajectory& trajectory, std::int64_t utc_ns) {
  require_at_least("records of the trajectory", trajectory.size(), 1);
  const std::int64_t gps = (leap_seconds(utc_ns) - kGpsEpoch) * kClockSecond;
  switch (trajectory.time_scale) {
    case TimeScale::unknown:
      return {};
    case TimeScale::utc_unix:
      return 0;
    case TimeScale::gps:
      return gps;
    case TimeScale::adjusted_gps:
      return gps - kGpsAdjustment * kClockSecond;
    case TimeScale::gps_second_of_week: {
      if (trajectory.gps_week) return gps - *trajectory.gps_week * kWeek * kClockSecond;
      return gps + nearest_period(trajectory, utc_ns + gps, kWeek * kClockSecond);
    }
    case TimeScale::utc_second_of_day:
      return nearest_period(trajectory, utc_ns, kDay * kClockSecond);
  }
  return {};
}

std::optional<std::int64_t> shift_to_utc_ns(const Trajectory& trajectory) {
  require_at_least("records of the trajectory", trajectory.size(), 1);
  std::int64_t to_gps = 0;  // GPS time since 1980, s
  switch (trajectory.time_scale) {
    case TimeScale::utc_unix:
      return 0;
    case TimeScale::gps:
      break;
    case TimeScale::adjusted_gps:
      to_gps = kGpsAdjustment;
      break;
    case TimeScale::gps_second_of_week:
      if (!trajectory.gps_week) return {};
      to_gps = *trajectory.gps_week * kWeek;
      break;
    case TimeScale::unknown:
    case TimeScale::utc_second_of_day:
      return {};
  }
  const std::int64_t shift = (to_gps + kGpsEpoch) * kClockSecond;
  const std::int64_t gps_ns = trajectory.time_ns.front() + shift;
  const std::int64_t about = gps_ns - leap_seconds(gps_ns) * kClockSecond;
  return shift - leap_seconds(about) * kClockSecond;
}

std::string interval_words(const Trajectory& trajectory) {
  require_at_least("records of the trajectory", trajectory.size(), 1);
  return fmt::format("from {} to {} ({})", seconds_words(trajectory.time_ns.front()),
                     seconds_words(trajectory.time_ns.back()), words_of(trajectory.time_scale));
}

std::string no_overlap_words(const Trajectory& trajectory, std::int64_t first_ns,
                             std::int64_t last_ns,
                             std::optional<std::int64_t> stamps_after_times_ns) {
  if (first_ns <= trajectory.time_ns.back() && last_ns >= trajectory.time_ns.front()) {
    return fmt::format(
        "no shot of the recording has a pose: the trajectory runs {}, the recording from {} to {} "
        "by the same clock, where the trajectory has a gap",
        interval_words(trajectory), seconds_words(first_ns), seconds_words(last_ns));
  }
  std::string words = fmt::format(
      "the recording and the trajectory share no time: the trajectory runs {}, the recording from "
      "{} to {} by the same clock",
      interval_words(trajectory), seconds_words(first_ns), seconds_words(last_ns));
  // What would bring them together.
  constexpr std::int64_t kLeap = 18;  // since 2017
  const std::array<std::pair<std::int64_t, const char*>, 7> causes{{
      {kLeap, "one counts GPS time and the other UTC"},
      {-kLeap, "one counts GPS time and the other UTC"},
      {kWeek, "they are a week apart: one passed the end of the GPS week"},
      {-kWeek, "they are a week apart: one passed the end of the GPS week"},
      {kGpsAdjustment, "one counts adjusted GPS time, the other GPS time"},
      {-kGpsEpoch, "one counts from 1970, the other GPS time from 1980"},
      {-kGpsEpoch + kLeap, "one counts UTC from 1970, the other GPS time from 1980"},
  }};
  if (stamps_after_times_ns) {
    const std::int64_t shift =
        *stamps_after_times_ns +
        shift_from_utc_ns(trajectory, first_ns + *stamps_after_times_ns).value_or(0);
    if (first_ns + shift <= trajectory.time_ns.back() &&
        last_ns + shift >= trajectory.time_ns.front()) {
      return words +
             fmt::format(
                 "; they come from two clocks: the times of the recording count from power-on of "
                 "the "
                 "sensor, the stamps of its messages are UTC. By the stamps, they overlap when "
                 "{:.6f} s are added to the recording's times (clock_offset_s of the mount)",
                 1e-9 * static_cast<double>(shift));
    }
  }
  for (const auto& [seconds, cause] : causes) {
    const std::int64_t shift = seconds * kClockSecond;
    if (first_ns + shift <= trajectory.time_ns.back() &&
        last_ns + shift >= trajectory.time_ns.front()) {
      return words + fmt::format(
                         "; they overlap when {} s are added to the recording's times: probably {} "
                         "(clock_offset_s of the mount)",
                         seconds, cause);
    }
  }
  for (const auto& [period, name] : {std::pair{kWeek, "weeks"}, std::pair{kDay, "days"}}) {
    const std::int64_t shift = nearest_period(trajectory, first_ns, period * kClockSecond);
    if (shift != 0 && first_ns + shift <= trajectory.time_ns.back() &&
        last_ns + shift >= trajectory.time_ns.front()) {
      return words + fmt::format(
                         "; apart from whole {}, they overlap: the two clocks start from different "
                         "ones (clock_offset_s of the mount: {} s)",
                         name, shift / kClockSecond);
    }
  }
  return words + "; are they of the same flight?";
}

}  // namespace risley::trajectories
