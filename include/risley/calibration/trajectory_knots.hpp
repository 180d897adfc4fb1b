// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_shots.hpp"

namespace risley::calibration {

/// Errors of a trajectory along the axes of a map: of the position to the east, the north and up,
/// and of the attitude about those three axes. (A turn about up is an error of the heading.)
inline constexpr int kPoseErrors = 6;

/// How the errors of a trajectory go on: each is a Gauss-Markov process of its own, of covariance
/// sigma^2 exp(-|t - t'| / correlation_time). On top comes white noise of the attitude, about each
/// axis the same, independent from sample to sample.
struct PoseErrorProcess {
  std::array<double, kPoseErrors> sigma{};             ///< m and rad
  std::array<double, kPoseErrors> correlation_time{};  ///< s
  double white_attitude = 0;                           ///< rad
  double sample_interval = 0.005;                      ///< s
};

/// @throws InvalidArgument for sigmas that are not above 0, or correlation times or a sample
///         interval that are not
void require_process(const PoseErrorProcess& process);

/// Knots between which corrections of a trajectory are linear. Every strip has knots of its own.
struct TrajectoryKnots {
  /// Between a knot and the next one of the same strip.
  struct Interval {
    std::size_t knot = 0;  ///< at its beginning
    std::int64_t begin_ns = 0, end_ns = 0;
    std::size_t first_shot = 0, end_shot = 0;
  };
  std::vector<std::int64_t> time_ns;  ///< [knots], ascending, of the recording's clock
  std::vector<std::uint16_t> strip;   ///< [knots]
  std::vector<Interval> intervals;

  std::size_t size() const { return time_ns.size(); }
};

/// Knots at equal distances from the first to the last shot of every strip.
/// @param spacing  s; a strip has as many intervals as come closest to it, at least one
/// @throws InvalidArgument as require_flight_shots, for a spacing that is not above 0, and for
///         more than 100,000 knots
TrajectoryKnots make_knots(const FlightShots& shots, double spacing);

/// The same corrections at other knots: those between, and beyond the ends those at them.
/// @param corrections  [6, from.size()]
Eigen::MatrixXd resampled(const TrajectoryKnots& from, const Eigen::MatrixXd& corrections,
                          const TrajectoryKnots& to);

/// What the process says of one component of the corrections at all knots, the inverse of its
/// covariance, which is tridiagonal.
struct KnotInformation {
  std::vector<double> diagonal;  ///< [knots]
  std::vector<double> next;      ///< [knots - 1] between a knot and the next
};
KnotInformation knot_information(const TrajectoryKnots& knots, const PoseErrorProcess& process,
                                 int component);

/// Covariance of what a component does between two knots beside the straight line through its
/// values there, at the middles of equal parts of the interval [parts, parts].
Eigen::MatrixXd covariance_between_knots(const PoseErrorProcess& process, int component,
                                         double spacing, int parts);

}  // namespace risley::calibration
