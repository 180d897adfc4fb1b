// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "risley/estimation/estimate.hpp"

namespace risley::estimation {

/// Errors of a sensor's points in the terms of lidar odometry: each point's own, one sigma each,
/// and those common to all points, which do not average out.
struct NoiseModel {
  double azimuth = 0, zenith = 0;  ///< noise and rounding of reported directions, rad
  /// Along either axis across the beam, the root mean square over both axes and the shots, rad.
  double direction = 0;
  double range_distance = 0;  ///< at which the range's sigma is stated, m
  double range = 0;           ///< noise and rounding there, at normal incidence, m
  std::string range_source;   ///< source, from the sensor
  /// Of the directions of a unit, rad; empty if not stated.
  std::optional<double> shared_direction;
  std::string shared_direction_source;
  /// Of the zero of the ranges, m; empty if not stated.
  std::optional<double> shared_range;
  std::string shared_range_source;

  /// Variance of a point across a surface, where that is stated, whatever the angle of incidence:
  /// that of the range and that of the direction together, m^2.
  double point_variance() const;
};

/// The noise of directions from an estimate; ranges, and common errors, from the preset.
/// @param nominal  the sensor at the start of the estimate
NoiseModel noise_model(const Estimate& estimate, const sensors::Sensor& nominal);

}  // namespace risley::estimation
