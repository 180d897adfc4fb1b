// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "risley/core/vector3.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/simulation/platform.hpp"
#include "risley/trajectories/interpolation.hpp"

namespace risley::simulation {

/// Poses of a platform's sensor at each shot, in the axes of a scene.
class PlatformPoses {
 public:
  /// @param last_shot_ns  of the recording, since its first shot
  /// @throws InvalidArgument if the trajectory has no pose for a part of the recording, naming both
  /// intervals; for a geocentric trajectory and a scene without origin; and as
  /// first_clock_reading_ns
  PlatformPoses(const Platform& platform, const scenes::Scene& scene, std::int64_t last_shot_ns);
  PlatformPoses(const PlatformPoses&) = delete;
  PlatformPoses& operator=(const PlatformPoses&) = delete;

  std::int64_t first_clock_ns() const { return first_clock_ns_; }

  /// Of the sensor's frame in the scene.
  struct SensorPose {
    Eigen::Matrix3d rotation;
    Eigen::Vector3d position;

    Vector3<double> direction(const Vector3<double>& of_sensor) const;
    Vector3<double> point(const Vector3<double>& of_sensor) const;
  };

  /// Poses in sequence; each thread has its own.
  class Cursor {
   public:
    explicit Cursor(const PlatformPoses& poses) : poses_(&poses), cursor_(poses.poses_) {}
    /// @param shot_ns  since the first shot, [0, last_shot_ns]
    SensorPose at(std::int64_t shot_ns);

   private:
    const PlatformPoses* poses_;
    trajectories::Interpolation::Cursor cursor_;
  };

 private:
  std::int64_t trajectory_time_ns(std::int64_t shot_ns) const;

  Platform platform_;
  trajectories::Interpolation poses_;
  std::int64_t first_clock_ns_ = 0, offset_ns_ = 0;
  Eigen::Matrix3d body_from_sensor_;
  Eigen::Vector3d lever_arm_;
  Eigen::Matrix3d scene_from_frame_;
  Eigen::Vector3d origin_;  ///< of the scene, in the trajectory's frame
};

}  // namespace risley::simulation
