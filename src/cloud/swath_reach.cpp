// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/swath_reach.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/sensors/scan_pattern.hpp"

namespace risley::cloud {
namespace {

/// Time after which a scan has covered its whole field of view, s, and number of shots that show
/// this.
constexpr double kFieldAfter = 30, kFieldShots = 300'000;
constexpr double kLowestBeam = 0.17364817766693033;  // sine of 10 degrees

}  // namespace

SwathReach swath_reach(const sensors::Sensor& sensor, const trajectories::Mount& mount) {
  trajectories::require_mount(mount);
  require_at_least("prisms of the sensor", sensor.prisms(), 1);
  const Eigen::Matrix3d turn = trajectories::body_from_sensor(mount);
  sensors::ScanPatternOptions options;
  if (!sensor.sequence) {
    options.rotation_angle.assign(sensor.prisms(), 0.0);
  }
  options.every = static_cast<std::uint64_t>(
      std::max(1.0, std::floor(kFieldAfter * sensor.shot_rate / kFieldShots)));
  const sensors::ScanPattern pattern = sensors::scan_pattern(
      sensor, 0, static_cast<std::size_t>(std::min(kFieldShots, kFieldAfter * sensor.shot_rate)),
      options);
  constexpr double kNothing = -std::numeric_limits<double>::infinity();
  SwathReach reach{kNothing, kNothing, kNothing, kNothing};
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (std::isnan(pattern.azimuth[i])) continue;
    const Vector3<double> d =
        direction_from_angles(SphericalAngles<double>{pattern.azimuth[i], pattern.zenith[i]});
    const Eigen::Vector3d beam = turn * Eigen::Vector3d(d.x, d.y, d.z);
    if (beam.z() < kLowestBeam) {
      throw InvalidArgument(
          fmt::format("a beam of the sensor points {:.1f} degrees below the horizon of a level "
                      "platform, at least 10 are needed: are the sensor's axes in the mount right?",
                      degrees_from_radians(std::asin(std::clamp(beam.z(), -1.0, 1.0)))));
    }
    const double ahead = beam.x() / beam.z(), right = beam.y() / beam.z();
    reach.ahead = std::max(reach.ahead, ahead);
    reach.behind = std::max(reach.behind, -ahead);
    reach.right = std::max(reach.right, right);
    reach.left = std::max(reach.left, -right);
  }
  if (!(reach.ahead > kNothing)) throw EstimationError("no beam passes through the prisms");
  return reach;
}

}  // namespace risley::cloud
