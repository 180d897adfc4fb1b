// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_shots.hpp"
#include "risley/trajectories/error_process.hpp"

namespace risley::calibration {

/// Corrections of a pose along the axes of a local frame: a shift along x (east), y (north) and
/// z (up), and a rotation about these three axes.
inline constexpr int kCorrections = 6;

/// The error of the trajectory whose process a correction follows: position east, north and up,
/// tilts about east and north, heading. @throws InvalidArgument for another correction
trajectories::PoseError error_of(int correction);

/// Knots between which corrections of a trajectory are linear. Every strip has its own knots.
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

/// Equidistant knots from the first to the last shot of every strip.
/// @param spacing  s; a strip has the number of intervals that comes closest to it, at least one
/// @throws InvalidArgument as require_flight_shots, for a spacing not above 0, and for more than
/// 100,000 knots
TrajectoryKnots make_knots(const FlightShots& shots, double spacing);

/// The same corrections at other knots: interpolated, and constant beyond the ends.
/// @param corrections  [6, from.size()]
Eigen::MatrixXd resampled(const TrajectoryKnots& from, const Eigen::MatrixXd& corrections,
                          const TrajectoryKnots& to);

/// A possible jump of a trajectory's errors beyond the process.
struct ProcessBreak {
  std::size_t knot = 0;                      ///< before it
  std::array<double, kCorrections> sigma{};  ///< of the jump, m and rad
};

/// The process of one correction from knot to knot: its expected value is `decay` times that at the
/// previous knot, with a deviation of `sigma`. The first knot has a decay of 0.
struct KnotSteps {
  std::vector<double> decay, sigma;  ///< [knots]
};
/// Steps of a correction from knot to knot. Sigmas of the process below 1e-7 (m, rad) are raised to
/// that. @param correction  from 0, see kCorrections
KnotSteps knot_steps(const TrajectoryKnots& knots, const trajectories::ErrorProcess& process,
                     int correction, const std::vector<ProcessBreak>& breaks = {});

/// A process as prior of one correction at all knots: the inverse of its covariance, which is
/// tridiagonal. Sigmas below 1e-7 (m, rad) are raised to that.
/// @param process  at the knots' times
struct KnotInformation {
  std::vector<double> diagonal;  ///< [knots]
  std::vector<double> next;      ///< [knots - 1] between a knot and the next
};
/// A process as prior of one correction. @param correction  from 0, see kCorrections
KnotInformation knot_information(const TrajectoryKnots& knots,
                                 const trajectories::ErrorProcess& process, int correction,
                                 const std::vector<ProcessBreak>& breaks = {});

/// Covariance of what a correction does within an interval beside the straight line through its
/// values at the ends, at the middles of equal parts [parts, parts]; with the sigma that the
/// process has in the middle of the interval.
/// @throws InvalidArgument for an interval that is not longer than 0, and less than one part
Eigen::MatrixXd covariance_between_knots(const trajectories::ErrorProcess& process, int correction,
                                         std::int64_t begin_ns, std::int64_t end_ns, int parts);

/// Corrections at a time: linear between the knots of a strip, elsewhere the expectation of the
/// process.
/// @param corrections  [6, knots]
/// @throws InvalidArgument for corrections that do not match the knots, and for no knots
Eigen::Matrix<double, kCorrections, 1> correction_at(const TrajectoryKnots& knots,
                                                     const Eigen::MatrixXd& corrections,
                                                     const trajectories::ErrorProcess& process,
                                                     std::int64_t time_ns);

/// Standard deviations of corrections at a time: linear between the knots of a strip, elsewhere
/// those of the nearest knot enlarged by the process.
/// @param knot_sigma  [6, knots]
/// @throws as correction_at
Eigen::Matrix<double, kCorrections, 1> correction_sigma_at(
    const TrajectoryKnots& knots, const Eigen::MatrixXd& knot_sigma,
    const trajectories::ErrorProcess& process, std::int64_t time_ns);

}  // namespace risley::calibration
