// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_recordings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"

#include "calibration/belief.hpp"

namespace risley::calibration {
namespace {

/// The recordings by their first times.
std::vector<std::size_t> by_time(const std::vector<RangedRecording>& recordings) {
  std::vector<std::size_t> order(recordings.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (const RangedRecording& recording : recordings) {
    require_length("time_ns", recording.time_ns.size(), recording.shots.size());
    require_at_least("shots of " + recording.name, recording.shots.size(), 1);
  }
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) {
    return recordings[a].time_ns.front() < recordings[b].time_ns.front();
  });
  for (std::size_t i = 1; i < order.size(); ++i) {
    const RangedRecording &one = recordings[order[i - 1]], &next = recordings[order[i]];
    if (next.time_ns.front() < one.time_ns.back()) {
      throw InvalidArgument(fmt::format(
          "{} begins before {} ends: the same sensor cannot have made both", next.name, one.name));
    }
  }
  return order;
}

/// Prior knowledge of the sensor before the flight.
sensors::Sensor sensor_before(const sensors::Sensor& given, const Belief& belief) {
  sensors::Sensor sensor = given;
  sensor.angular_velocity = belief.sensor.angular_velocity;
  sensor.combination = belief.sensor.combination;
  if (!given.covariance_names.empty()) return sensor;
  sensor.train = belief.sensor.train;
  for (const sensors::Knowledge& known : belief.sensor.knowledge) {
    if (known.name.starts_with("refractive_index")) sensor.set_knowledge(known);
  }
  return sensor;
}

}  // namespace

FlightRecordings flight_recordings(const std::vector<RangedRecording>& recordings,
                                   const sensors::Sensor& given,
                                   const std::vector<trajectories::FlownStrip>& strips,
                                   std::int64_t shift_ns) {
  require_at_least("recordings", recordings.size(), 1);
  require_between("strips", static_cast<double>(strips.size()), 1,
                  std::numeric_limits<std::uint16_t>::max());
  const std::vector<std::size_t> order = by_time(recordings);
  Belief belief = pooled_belief(recordings);
  const auto prisms = static_cast<std::size_t>(belief.sensor.prisms());
  require_length("prisms of the sensor", given.prisms(), prisms);
  FlightRecordings result;
  result.sensor = sensor_before(given, belief);
  result.believed = belief.sensor.train;
  result.strip_rows.assign(strips.size(), 0);
  FlightShots& shots = result.shots;
  shots.rotation_angle.resize(prisms);
  double squares = 0;
  std::size_t strip = 0;
  for (const std::size_t r : order) {
    const RangedRecording& recording = recordings[r];
    for (std::size_t row = 0; row < recording.shots.size(); ++row) {
      const std::int64_t time_ns = saturating_sum(recording.time_ns[row], shift_ns);
      while (strip < strips.size() && strips[strip].end_ns < time_ns) ++strip;
      if (strip == strips.size() || time_ns < strips[strip].begin_ns) {
        ++result.outside_strips;
        continue;
      }
      for (std::size_t k = 0; k < prisms; ++k) {
        shots.rotation_angle[k].push_back(
            wrap_to_pi(recording.shots.rotation_angle[k][row] + belief.angle_shift[r][k]));
        // The diagonal of an upper triangle, row by row.
        const std::size_t diagonal = k * prisms - k * (k + 1) / 2 + k;
        squares += static_cast<double>(recording.shots.angle_covariance[diagonal][row]);
      }
      shots.beam.push_back(recording.shots.beam.empty() ? std::uint8_t{0}
                                                        : recording.shots.beam[row]);
      shots.range.push_back(recording.shots.range[row]);
      shots.time_ns.push_back(time_ns);
      shots.strip.push_back(static_cast<std::uint16_t>(strip));
      ++result.strip_rows[strip];
    }
  }
  if (shots.size() == 0) {
    throw EstimationError("no shot was made on a strip of the flight");
  }
  result.rotation_angle_sigma = std::sqrt(squares / static_cast<double>(prisms * shots.size()));
  result.angle_shift = std::move(belief.angle_shift);
  return result;
}

}  // namespace risley::calibration
