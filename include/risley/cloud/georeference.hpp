// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/cloud/map_projection.hpp"
#include "risley/cloud/point_distribution.hpp"
#include "risley/cloud/points.hpp"
#include "risley/cloud/sensor_poses.hpp"
#include "risley/cloud/station.hpp"
#include "risley/core/instruction_set.hpp"
#include "risley/core/warning.hpp"
#include "risley/recordings/observations.hpp"
#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/flown_strips.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::cloud {

/// The carrier of a moving sensor, and the frame of its points.
struct MovingPlatform {
  trajectories::Trajectory trajectory;
  trajectories::Mount mount;
  /// Errors of the trajectory; without them points include only those of sensor and mount.
  std::optional<trajectories::ErrorModel> errors;
  /// The map, see MapProjection; empty: UTM on WGS 84 with ellipsoidal heights. Trajectories in a
  /// local frame have no map.
  std::string crs;
  std::string datum = "EPSG:4979";  ///< of the trajectory's positions, see MapProjection
};

/// A stationary sensor, such as on a tripod, and the frame of its points.
struct StandingSensor {
  StandingPose pose;
  std::uint16_t number = 1;  ///< of its station, from 1: Points::point_source
  std::string crs;           ///< as MovingPlatform; none for a pose in a local frame
  std::string datum;         ///< of the pose, see MapProjection
};

/// Points of a sensor on a platform or a tripod: from its own frame to a map, with the covariance
/// due to the trajectory; errors of a mount and of a stationary pose are common factors of the
/// PointingModel. May be used by several threads. docs/theory/cloud.md
class Georeference {
 public:
  /// @param platform         must outlive this
  /// @param recording_clock  of the points' times
  /// @param first_time_ns    of the recording, which decides weeks and days
  /// @throws InvalidArgument as MapProjection, Interpolation, require_mount; for a map and a
  /// trajectory in a local frame
  Georeference(const MovingPlatform& platform, recordings::TimeReference recording_clock,
               std::int64_t first_time_ns);
  /// @param sensor  must outlive this
  /// @throws InvalidArgument as MapProjection; for a map and a pose in a local frame
  explicit Georeference(const StandingSensor& sensor);
  ~Georeference();
  Georeference(const Georeference&) = delete;
  Georeference& operator=(const Georeference&) = delete;

  /// The poses at those times that have one: all, for a stationary sensor.
  /// @param times_ns  of the recording, mostly ascending: other orders take longer
  /// @param rows      which times they are, ascending
  void find_poses(std::span<const std::int64_t> times_ns, SensorPoses& poses,
                  std::vector<std::size_t>& rows,
                  InstructionSet set = best_instruction_set()) const;

  /// Fills a cloud's header with frame, times, strips and trajectory.
  void announce(CloudHeader& header) const;

  /// Turns points of the sensor's frame into points of the map: coordinates, covariances, loadings,
  /// times and strips.
  /// @param poses  of every point
  /// @throws InvalidArgument for columns of other lengths, and as check_available()
  void apply(Points& points, const SensorPoses& poses,
             InstructionSet set = best_instruction_set()) const;

  /// Remarks for the user: no errors of the trajectory, an unknown clock, a change of datum.
  std::vector<Warning> warnings() const;
  /// From the recording's clock to the trajectory's time, with the mount's offset, ns; 0 without.
  std::int64_t clock_shift_ns() const;
  /// The strips of a flight, in the order of their numbers from 1.
  const std::vector<trajectories::FlownStrip>& strips() const;
  /// The ways of the sensor along them, on the points' map; none if the trajectory has no pose at
  /// an end of one.
  std::vector<StripLine> strip_lines() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace risley::cloud
