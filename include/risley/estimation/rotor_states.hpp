// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// Estimated rotor states at some shots, as columns of one length.
struct RotorStates {
  std::vector<std::int64_t> time_ns;                  ///< as recorded
  std::vector<std::vector<double>> rotation_angle;    ///< [prisms][shots], rad, unwrapped
  std::vector<std::vector<double>> angular_velocity;  ///< [prisms][shots], rad/s
  /// Covariance of the rotation angles, upper triangle row by row [prisms (prisms+1)/2][shots].
  std::vector<std::vector<double>> rotation_angle_covariance;
  std::vector<std::vector<double>> angular_velocity_sigma;  ///< [prisms][shots], rad/s
  std::vector<double> azimuth_residual, zenith_residual;    ///< observed minus estimated, rad
  std::vector<unsigned char> outlier;                       ///< 1 if the shot was rejected

  std::size_t size() const { return time_ns.size(); }
  /// Number of columns of rotation angles.
  int prisms() const { return static_cast<int>(rotation_angle.size()); }

  /// Gives every column this many rows.
  void resize(int prisms, std::size_t shots);
};

/// All columns.
inline constexpr ColumnPlace<RotorStates, std::vector<std::int64_t>, std::vector<double>,
                             std::vector<unsigned char>, std::vector<std::vector<double>>>
    kRotorStateColumns[] = {&RotorStates::time_ns,
                            &RotorStates::rotation_angle,
                            &RotorStates::angular_velocity,
                            &RotorStates::rotation_angle_covariance,
                            &RotorStates::angular_velocity_sigma,
                            &RotorStates::azimuth_residual,
                            &RotorStates::zenith_residual,
                            &RotorStates::outlier};

/// Rows [begin, end).
RotorStates rows_of(const RotorStates& states, ShotRange rows);

}  // namespace risley::estimation
