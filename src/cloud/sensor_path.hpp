// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "risley/cloud/sensor_poses.hpp"
#include "risley/core/instruction_set.hpp"
#include "risley/trajectories/flown_strips.hpp"
#include "risley/trajectories/interpolation.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::cloud {

/// Path of a sensor on a mount along a trajectory, at times of the trajectory.
class SensorPath {
 public:
  /// @param trajectory     must outlive this
  /// @param interpolation  of that trajectory; must outlive this
  SensorPath(const trajectories::Trajectory& trajectory,
             const trajectories::Interpolation& interpolation, const trajectories::Mount& mount);

  const std::vector<trajectories::FlownStrip>& strips() const { return strips_; }
  /// The poses of the times that have one.
  /// @param times_ns  mostly ascending: other orders take longer
  /// @param rows      which times they are, ascending
  void find(std::span<const std::int64_t> times_ns, SensorPoses& poses,
            std::vector<std::size_t>& rows, InstructionSet set) const;

 private:
  class Cell;

  const trajectories::Trajectory& trajectory_;
  const trajectories::Interpolation& interpolation_;
  std::vector<trajectories::FlownStrip> strips_;
  Eigen::Matrix3d body_from_sensor_;
  Eigen::Vector3d lever_arm_;  ///< axes of the sensor
};

}  // namespace risley::cloud
