// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "risley/recordings/observations.hpp"

namespace risley::cloud {

/// Places of the upper triangle of a symmetric 3 x 3 matrix in Points::covariance.
enum CovarianceTerm : std::size_t { kXX, kXY, kXZ, kYY, kYZ, kZZ, kCovarianceTerms };

/// Points with their uncertainty, as columns of one length (or empty where CloudHeader says that
/// they are not there). Frame of the sensor: X forward, Y left, Z up, origin as in [B21 Fig. 5].
struct Points {
  std::vector<std::int64_t> time_ns;  ///< as recorded
  std::vector<double> x, y, z;        ///< m
  /// Covariance of each point, all its sources together, m^2.
  std::array<std::vector<double>, kCovarianceTerms> covariance;
  std::vector<double> range;  ///< from where the beam leaves the sensor, range offset taken off, m
  std::vector<double> incidence;  ///< between beam and surface normal, rad; NaN where not known
  std::vector<std::vector<double>> rotation_angle;  ///< [prisms], rad, [0, 2 pi)
  /// Reported direction minus that of the smoothed rotation angles, rad.
  std::vector<double> azimuth_residual, zenith_residual;
  std::vector<std::uint8_t> intensity;          ///< as the sensor reports it, 0-255
  std::vector<std::uint8_t> return_number;      ///< from 1
  std::vector<std::uint8_t> number_of_returns;  ///< of the point's shot
  std::vector<std::uint8_t> tag, beam;          ///< as in recordings::Observations
  /// What one standard deviation of each common factor moves the point by, m [factors][3]. The
  /// covariance of two different points is the sum of the outer products of their loadings.
  std::vector<std::array<std::vector<double>, 3>> loading;

  std::size_t size() const { return time_ns.size(); }
  /// Keeps only these rows. @param rows  ascending @throws InvalidArgument
  void keep(std::span<const std::size_t> rows);
};

/// What is known of a cloud before its first point.
struct CloudHeader {
  std::string sensor;  ///< maker and model, e.g. "Livox Mid-40"
  std::string serial;  ///< empty when unknown
  recordings::TimeReference time_reference = recordings::TimeReference::relative;
  int prisms = 2;
  bool has_covariance = true;
  /// Rotation angles and residuals are known.
  bool has_rotation_angles = true;
  /// Names of the common factors whose loadings the points carry; empty without loadings.
  std::vector<std::string> factors;
  /// How the cloud was made: name and value pairs such as command, version, input_sha256.
  std::vector<std::pair<std::string, std::string>> provenance;

  /// Gives every column that this header announces so many rows, and empties the others.
  /// @throws InvalidArgument for a number of prisms that no sensor has
  void resize(Points& points, std::size_t rows) const;
};

}  // namespace risley::cloud
