// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace risley::cloud {

/// Poses of a sensor at the times of some shots, as columns of one length.
struct SensorPoses {
  std::array<std::vector<double>, 9>
      turn;  ///< frame of the trajectory from sensor, column by column
  std::array<std::vector<double>, 3> reference;  ///< the trajectory's reference point, its frame, m
  /// Of the sensor's origin, m/s, and of turning, rad/s, some milliseconds before at most; axes of
  /// the sensor.
  std::array<std::vector<double>, 3> velocity, rate;
  std::vector<std::uint16_t> strip;  ///< from 1; 0: of none
  /// From the reference point to the sensor's origin, axes of the sensor, m.
  Eigen::Vector3d lever_arm{0, 0, 0};

  std::size_t size() const { return strip.size(); }
  void resize(std::size_t shots);  ///< gives every column this many rows
  /// Keeps only these rows. @param rows  ascending @throws InvalidArgument
  void keep(std::span<const std::size_t> rows);
};

}  // namespace risley::cloud
