// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/cloud/pointing_model.hpp"
#include "risley/cloud/points.hpp"
#include "risley/cloud/sensor_poses.hpp"
#include "risley/core/instruction_set.hpp"

namespace risley::cloud {

/// Some shots with a range, as columns of one length.
struct PointedShots {
  std::vector<std::vector<double>> rotation_angle;    ///< [prisms][shots], rad
  std::vector<std::vector<double>> angle_covariance;  ///< upper triangle [..][shots], rad^2
  std::vector<double> azimuth, zenith;                ///< as reported, rad
  /// Variance of the rounding, rad^2, rad^2 and m^2.
  std::vector<double> azimuth_rounding, zenith_rounding, range_rounding;
  std::vector<double> range;                          ///< as reported, m
  std::vector<double> intensity;                      ///< as reported; negative: not known
  std::vector<std::uint8_t> beam;                     ///< emitter that fired, from 0
  std::array<std::vector<double>, 3> surface_normal;  ///< NaN where not known

  std::size_t size() const { return range.size(); }
  /// @throws InvalidArgument for a number of prisms that no sensor has
  void resize(int prisms, std::size_t shots);
};

/// Cartesian points of the sensor's frame with covariance [B21 Eq. (31), App. A]. Fills x, y, z,
/// covariance, range, incidence, rotation_angle, residuals and loading, as far as the header
/// announces them; the caller fills the points' other columns. A beam that does not get through the
/// prisms gives NaN. Residuals are exact to 1e-8 of them up to 0.1 rad; larger ones are only large.
/// @param header  of the points: without rotation angles only where the model needs none; with one
/// factor name per factor of the model or none
/// @param poses  of the shots of a model with a mount; the mount's errors then count
/// @throws InvalidArgument for columns, factors or prisms that differ from model and header,
/// emitters that the model does not have, range errors that are not finite or of another number of
/// emitters, and as check_available()
void compute_points(const PointingModel& model, const CloudHeader& header,
                    const PointedShots& shots, Points& points, const SensorPoses& poses = {},
                    InstructionSet set = best_instruction_set());

}  // namespace risley::cloud
