// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "risley/recordings/observations.hpp"

namespace risley::cloud {

/// Places of the upper triangle of a symmetric 3 x 3 matrix in Points::covariance.
enum CovarianceTerm : std::size_t { kXX, kXY, kXZ, kYY, kYZ, kZZ, kCovarianceTerms };

/// Points with their uncertainty, as columns of one length (or empty where CloudHeader says that
/// they are not there), in the frame that CloudHeader names.
struct Points {
  std::vector<std::int64_t> time_ns;  ///< as recorded
  std::vector<double> x, y, z;        ///< m
  /// Covariance of each point, all its sources together, m^2.
  std::array<std::vector<double>, kCovarianceTerms> covariance;
  /// The part of it that the point shares with no other, m^2.
  std::array<std::vector<double>, kCovarianceTerms> own_covariance;
  std::vector<double> range;  ///< from where the beam leaves the sensor, range offset taken off, m
  std::vector<double> incidence;  ///< between beam and surface normal, rad; NaN where not known
  std::vector<std::vector<double>> rotation_angle;  ///< [prisms], rad, [0, 2 pi)
  /// Reported direction minus that of the smoothed rotation angles, rad.
  std::vector<double> azimuth_residual, zenith_residual;
  std::vector<std::uint8_t> intensity;          ///< as the sensor reports it, 0-255
  std::vector<std::uint8_t> return_number;      ///< from 1
  std::vector<std::uint8_t> number_of_returns;  ///< of the point's shot
  std::vector<std::uint8_t> tag, beam;          ///< as in recordings::Observations
  std::vector<std::uint16_t> point_source;      ///< strip of a flight from 1; 0: of none
  /// What one standard deviation of each common factor moves the point by, m [factors][3]. The
  /// covariance of two different points is the sum of the outer products of their loadings.
  std::vector<std::array<std::vector<double>, 3>> loading;

  std::size_t size() const { return time_ns.size(); }
  /// Keeps only these rows. @param rows  ascending @throws InvalidArgument
  void keep(std::span<const std::size_t> rows);
};

/// What the coordinates of a cloud are.
struct PointFrame {
  std::string text = "of the sensor: X forward, Y left, Z up";  ///< origin as in [B21 Fig. 5]
  std::array<std::string, 3> axes{"forward", "left", "up"};
  std::string wkt;  ///< OGC WKT 1 of a map; empty for other frames
  /// Formats that store multiples of a step store them from here on, m.
  std::array<double, 3> offset{};
};

/// What the errors of a trajectory do to points: point i at x_i, taken at time t_i from r_i, moves
/// by L_i e(t_i), L_i = [I, -[x_i - r_i]x]; the six of e are shifts to north, east and up, m, and
/// rotations about north, east and down, rad. docs/theory/cloud.md
struct TrajectoryErrors {
  /// Each of the six fades with time: the covariance of two times is their sigmas times
  /// exp(-|t_i - t_j| / correlation_time), s.
  std::array<double, 6> correlation_time{};
  /// Parts on top that are alike within a sample of the trajectory and independent from sample to
  /// sample, m and rad; and how long a sample lasts, s.
  std::array<double, 6> white{};
  double sample_interval = 0;
  std::int64_t first_sample_ns = 0;  ///< begin of sample 0
  /// North, east and down as columns, axes of the points, in the middle of the flight.
  std::array<std::array<double, 3>, 3> axes_from_ned{{{0, 1, 0}, {1, 0, 0}, {0, 0, -1}}};
  /// Where the sensor was, about once a second: time as the points have it and place, axes of the
  /// points. Between them a straight line is off by millimetres, which costs nothing here.
  std::vector<std::int64_t> time_ns;
  std::vector<std::array<double, 3>> position;  ///< m
  std::vector<std::array<double, 6>> sigma;     ///< of the fading parts, m and rad
};

/// What is known of a cloud before its first point.
struct CloudHeader {
  std::string sensor;  ///< manufacturer and model, e.g. "Livox Mid-40"
  std::string serial;  ///< empty when unknown
  recordings::TimeReference time_reference = recordings::TimeReference::relative;
  int prisms = 2;
  PointFrame frame;
  bool has_covariance = true;
  bool has_own_covariance = false;  ///< only together with has_covariance
  bool has_point_source = false;    ///< points have the number of their strip
  /// Rotation angles and residuals are known.
  bool has_rotation_angles = true;
  /// Names of the common factors whose loadings the points carry; empty without loadings.
  std::vector<std::string> factors;
  /// What the trajectory's errors have in common from point to point, of a moving sensor.
  std::optional<TrajectoryErrors> trajectory;
  /// How the cloud was made: name and value pairs such as command, version, input_sha256.
  std::vector<std::pair<std::string, std::string>> provenance;

  /// Gives every column that this header announces so many rows, and empties the others.
  /// @throws InvalidArgument for a number of prisms that no sensor has
  void resize(Points& points, std::size_t rows) const;
};

}  // namespace risley::cloud
