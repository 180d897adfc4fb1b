// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/planned_shots.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "risley/calibration/rays.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/trajectories/interpolation.hpp"

#include "calibration/eigen_vectors.hpp"

namespace risley::calibration {
namespace {

/// Shots of a piece, including those not chosen, and of one task.
constexpr std::uint64_t kPlannedPieceShots = std::uint64_t{1} << 18U;
constexpr std::size_t kTaskShots = 16384;
constexpr std::uint64_t kChoice = 1701, kPenetration = 1702;  // random streams
constexpr double kBillion = 1e9;

/// Shots of one strip before their end points are known.
struct FiredShots {
  std::vector<std::uint64_t> number;
  std::vector<std::int64_t> time_ns;  // of the trajectory
  FlightShots shots;
};

void fire(const PlannedFlight& planned, std::uint64_t first, std::uint64_t last,
          std::int64_t begin_ns, double share, std::uint64_t seed, FiredShots& fired) {
  const sensors::Sensor& sensor = planned.sensor;
  const RandomStream choice(seed, kChoice);
  fired = {};
  const std::vector<double> start = sensor.sequence && !sensor.sequence->rotation_angle.empty()
                                        ? sensor.sequence->rotation_angle
                                        : std::vector<double>(sensor.prisms(), 0.0);
  fired.shots.rotation_angle.resize(start.size());
  const auto emitters = static_cast<std::uint64_t>(sensor.train.emitters());
  const auto clock_ns =
      static_cast<std::int64_t>(std::llround(planned.mount.clock_offset.value * kBillion));
  for (std::uint64_t i = first; i < last; ++i) {
    if (share < 1 && choice.uniform(i) >= share) continue;
    const double time = static_cast<double>(i) / sensor.shot_rate;
    fired.number.push_back(i);
    fired.time_ns.push_back(begin_ns + static_cast<std::int64_t>(std::llround(time * kBillion)));
    fired.shots.time_ns.push_back(fired.time_ns.back() - clock_ns);
    if (emitters > 1) fired.shots.beam.push_back(static_cast<std::uint8_t>(i % emitters));
    for (std::size_t k = 0; k < start.size(); ++k) {
      fired.shots.rotation_angle[k].push_back(
          wrap_to_pi(rotation_angle_at(start[k], sensor.angular_velocity[k], time)));
    }
  }
}

/// Sends shots to the terrain. @return their ranges, NaN if a shot ends nowhere
std::vector<double> ranges_of(const PlannedFlight& planned, const scenes::Terrain& terrain,
                              const trajectories::Interpolation& poses, const FiredShots& fired,
                              std::uint64_t seed, PlannedPiece& piece) {
  const std::size_t n = fired.number.size();
  const Rays rays(planned.sensor.train, planned.sensor.geometry, fired.shots.rotation_angle,
                  fired.shots.beam, {0, n});
  const Eigen::Matrix3d turn = trajectories::body_from_sensor(planned.mount);
  const Eigen::Vector3d lever = trajectories::lever_arm(planned.mount);
  const RandomStream penetration(seed, kPenetration);
  std::vector<double> ranges(n, std::numeric_limits<double>::quiet_NaN());
  piece.x.resize(n);
  piece.y.resize(n);
  piece.z.resize(n);
  parallel::for_each((n + kTaskShots - 1) / kTaskShots, [&](std::size_t task) {
    auto cursor = poses.cursor();
    for (std::size_t i = task * kTaskShots; i < std::min(n, (task + 1) * kTaskShots); ++i) {
      if (std::isnan(rays.direction(i).x)) continue;
      const auto pose = cursor.at(fired.time_ns[i]);
      if (!pose) continue;
      const Eigen::Matrix3d attitude = pose->attitude.toRotationMatrix();
      const Eigen::Vector3d start =
          pose->position + attitude * (lever + turn * eigen(rays.origin(i)));
      const Eigen::Vector3d direction = (attitude * (turn * eigen(rays.direction(i)))).normalized();
      const auto hit =
          terrain.nearest_hit(plain(start), plain(direction), planned.sensor.range_maximum,
                              penetration.uniform(fired.number[i]));
      if (!hit || hit->range < planned.sensor.range_minimum ||
          hit->range > planned.sensor.range_maximum) {
        continue;
      }
      const Eigen::Vector3d end = start + hit->range * direction;
      piece.x[i] = end.x();
      piece.y[i] = end.y();
      piece.z[i] = end.z();
      ranges[i] = hit->range;
    }
  });
  return ranges;
}

}  // namespace

trajectories::Flight flown(const PlannedFlight& planned) {
  trajectories::FlightPlan plan = planned.plan;
  plan.origin.reset();  // only the map's axes are needed
  return trajectories::fly(plan);
}

void for_each_planned_piece(const PlannedFlight& planned, const trajectories::Flight& flight,
                            const PlannedShotsOptions& options,
                            const std::function<void(PlannedPiece&)>& function,
                            const Progress& progress) {
  const sensors::Sensor& sensor = planned.sensor;
  trajectories::require_mount(planned.mount);
  require_at_least("prisms of the sensor", sensor.prisms(), 1);
  require_length("angular_velocity of the sensor", sensor.angular_velocity.size(), sensor.prisms());
  require_above("shot rate of the sensor", sensor.shot_rate, 0, "Hz");
  if (options.rate) {
    require_above("rate", *options.rate, 0, "Hz");
    require_between("rate", *options.rate, 0, sensor.shot_rate, "Hz");
  }
  const double share = options.rate ? *options.rate / sensor.shot_rate : 1;
  const scenes::Terrain terrain(planned.terrain);
  const trajectories::Interpolation poses(flight.trajectory);
  const std::int64_t start_ns = flight.trajectory.time_ns.front();
  double done = 0, all = 0;
  for (const trajectories::StripTimes& strip : flight.strips) {
    all += static_cast<double>(strip.end_ns - strip.begin_ns);
  }
  FiredShots fired;
  for (std::size_t s = 0; s < flight.strips.size(); ++s) {
    const trajectories::StripTimes& strip = flight.strips[s];
    const auto number_at = [&](std::int64_t time_ns) {  // rotors never stop
      return static_cast<std::uint64_t>(
          std::ceil(static_cast<double>(time_ns - start_ns) / kBillion * sensor.shot_rate));
    };
    const std::uint64_t first = number_at(strip.begin_ns), end = number_at(strip.end_ns);
    for (std::uint64_t begin = first; begin < end; begin += kPlannedPieceShots) {
      const std::uint64_t last = std::min(begin + kPlannedPieceShots, end);
      progress.report(done / all);
      fire(planned, begin, last, start_ns, share, options.seed, fired);
      PlannedPiece piece;
      piece.fired = fired.number.size();
      const std::vector<double> ranges =
          ranges_of(planned, terrain, poses, fired, options.seed, piece);
      std::vector<std::size_t> rows;
      for (std::size_t i = 0; i < ranges.size(); ++i) {
        if (ranges[i] + sensor.range_offset > 0) rows.push_back(i);
      }
      fired.shots.range = ranges;
      for (double& range : fired.shots.range) range += sensor.range_offset;
      fired.shots.strip.assign(ranges.size(), static_cast<std::uint16_t>(s));
      piece.shots = rows_of(fired.shots, rows);
      for (std::size_t i = 0; i < rows.size(); ++i) {
        piece.x[i] = piece.x[rows[i]];
        piece.y[i] = piece.y[rows[i]];
        piece.z[i] = piece.z[rows[i]];
      }
      for (auto* column : {&piece.x, &piece.y, &piece.z}) column->resize(rows.size());
      function(piece);
      done += static_cast<double>(strip.end_ns - strip.begin_ns) *
              static_cast<double>(last - begin) / static_cast<double>(end - first);
    }
  }
  progress.report(1);
}

}  // namespace risley::calibration
