// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_shots.hpp"
#include "risley/calibration/trajectory_knots.hpp"
#include "risley/core/instruction_set.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/optics/beam_origin.hpp"

namespace risley::calibration {

/// A piece of ground, local frame. Its unknowns are two tilts about its centre, of the normal
/// towards tangents_of(normal), and an offset along the normal.
struct GroundPlane {
  Eigen::Vector3d normal{0, 0, 1};  ///< unit vector
  Eigen::Vector3d centre{0, 0, 0};  ///< a point of it, m
};

/// What is the same for a whole flight, in the order of the unknowns.
///   0 .. 2   boresight, a rotation about the sensor's X, Y, Z after the one there is, rad
///   3 .. 5   lever arm, body axes, m
///   6        range offset, m
///   7        clock offset, s
///   8 ..     free parameters of the train
///   behind   drift of the clock, s/s, and delay of the attitudes, s, where these are tested
struct FlightUnknowns {
  int free = 0;
  bool drift = false, delay = false;
  static constexpr int boresight(int axis) { return axis; }          ///< about X, Y, Z: 0 to 2
  static constexpr int lever_arm(int axis) { return 3 + axis; }      ///< along X, Y, Z: 0 to 2
  static constexpr int range_offset() { return 6; }                  ///< m
  static constexpr int clock_offset() { return 7; }                  ///< s
  static constexpr int parameter(int number) { return 8 + number; }  ///< of the free ones, from 0
  int clock_drift() const { return 8 + free; }                       ///< only where drift is set
  int attitude_delay() const { return 8 + free + (drift ? 1 : 0); }  ///< only where delay is set
  int size() const { return attitude_delay() + (delay ? 1 : 0); }
};

/// The quantities that predict the range of a shot. A point p of the sensor's frame is at
///
///     position + R (lever_arm + nominal * boresight * p),
///
/// with position and R of the trajectory at the shot's time + clock_offset, moved and turned by the
/// corrections: position + d, exp(turn) R.
struct FlightModel {
  PrismTrain train;
  PrismGeometry geometry;
  std::vector<estimation::FreeParameter> free;
  Eigen::Matrix3d nominal = Eigen::Matrix3d::Identity();    ///< body from sensor, as designed
  Eigen::Matrix3d boresight = Eigen::Matrix3d::Identity();  ///< after it
  Eigen::Vector3d lever_arm{0, 0, 0};                       ///< m
  double range_offset = 0;                                  ///< m
  double clock_offset = 0;                                  ///< s
  TrajectoryKnots knots;
  Eigen::MatrixXd corrections;  ///< [6, knots], see kCorrections
  std::vector<GroundPlane> planes;

  /// If given, a drift of the clock of 0 about this time, ns, is one more unknown: its derivatives
  /// give the drift.
  std::optional<std::int64_t> drift_about_ns;
  /// One more unknown: the delay of the trajectory's attitudes, now 0 s. A record then has the
  /// attitude of the body that long before the record's time.
  bool attitude_delay = false;

  /// The unknowns of this model beside the knots and the planes.
  FlightUnknowns unknowns() const {
    return {static_cast<int>(free.size()), drift_about_ns.has_value(), attitude_delay};
  }
};

/// "boresight_x_deg", ..., "lever_arm_x_m", ..., "range_offset_m", "clock_offset_s" and the
/// parameters by their names.
std::vector<std::string> unknown_names(const FlightModel& model);

/// How much a shot counts.
struct FlightWeights {
  double range_variance = 0;           ///< of one range, m^2
  double rotation_angle_variance = 0;  ///< of each rotation angle, independent, rad^2
  /// White noise of the poses common to the shots of a sample, in the order of the corrections, 1
  /// sigma, m and rad. Weights treat it as each shot's own, as many times its variance as a sample
  /// has shots, so that planes stay apart from each other.
  std::array<double, kCorrections> white{};
  double sample_interval = 0.005;  ///< s
  /// Residual at which a shot has half weight, m; 0: all have equal weight.
  double cauchy_scale = 0;
  double gate = 0;  ///< residual beyond which a shot is ignored, in its sigmas; 0: none
};

/// Sums of a plane's columns with those of one interval between knots.
struct PlaneBlock {
  std::uint32_t plane = 0, interval = 0;
  std::size_t at = 0;  ///< in FlightEquations::plane_products
};

/// Normal equations of a flight in blocks. Unknowns are those of FlightUnknowns, six of every knot,
/// three of every plane.
struct FlightEquations {
  int globals = 0;           ///< FlightUnknowns::size()
  Eigen::MatrixXd hessian;   ///< [globals, globals], J^T W J
  Eigen::VectorXd gradient;  ///< [globals], J^T W residual
  /// Of the two knots of every interval: [12, globals], [12, 12], [12].
  std::vector<Eigen::MatrixXd> knot_global, knot_hessian;
  std::vector<Eigen::VectorXd> knot_gradient;
  /// Of a plane's three unknowns: [3][globals + 12 + residual + 3], row by row.
  std::vector<PlaneBlock> plane_blocks;
  std::vector<double> plane_products;
  double cost = 0;           ///< sum of the squared residuals times their weights
  std::size_t shots = 0;     ///< that have a plane
  std::size_t lost = 0;      ///< of these: do not meet it
  std::size_t outliers = 0;  ///< of these: beyond the gate
};

/// Plane of every shot, or kNoPlane.
using PlaneOfShot = std::vector<std::int32_t>;
/// Marks a shot without a plane in PlaneOfShot.
inline constexpr std::int32_t kNoPlane = -1;

/// Residuals and derivatives of every shot that has a plane, summed up. The range of a shot is
/// predicted from its plane,
///   rho = n.(centre - start) / n.direction,   d rho = -(n.dx) / (n.direction)
/// where dx is what an unknown does to the point that the beam meets, so derivatives hold the
/// predicted range and no noise. docs/theory/flight.md The derivative of the beam's origin by the
/// prisms' parameters is left out. The sums do not depend on the number of threads.
/// @param poses  at a clock offset close to the model's: the rest is extrapolated
/// @throws InvalidArgument for columns, labels, knots or matrices that do not belong together,
/// non-finite numbers, variances not above 0; as check_available()
FlightEquations flight_equations(const FlightShots& shots, const ShotPoses& poses,
                                 const PlaneOfShot& plane, const FlightModel& model,
                                 const FlightWeights& weights,
                                 InstructionSet set = best_instruction_set());

/// Rows of the design matrix of some shots of one interval.
struct FlightRows {
  std::size_t interval = 0;
  std::size_t begin = 0, end = 0;        ///< shots of the piece, in the order of their times
  std::span<const std::uint32_t> shots;  ///< rows that have a plane
  int columns = 0;                       ///< globals + 6 + 3 + 3
  /// [shots][columns]: globals, the six errors of the pose, the plane's three unknowns, residual
  /// (m, NaN where lost), the shot's own variance without that of the attitude (m^2), weight
  /// (1/m^2).
  std::span<const double> values;
};

/// The pieces of a flight over which equations are summed, each within one interval.
std::size_t flight_pieces(const FlightModel& model);

/// Calls a function with the rows of every piece, in parallel; `piece` counts from 0 in the order
/// of time and below flight_pieces().
/// @throws as flight_equations
void for_each_flight_piece(
    const FlightShots& shots, const ShotPoses& poses, const PlaneOfShot& plane,
    const FlightModel& model, const FlightWeights& weights,
    const std::function<void(std::size_t piece, const FlightRows& rows)>& function,
    InstructionSet set = best_instruction_set());

}  // namespace risley::calibration
