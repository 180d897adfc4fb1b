// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/plane_equations.hpp"
#include "risley/calibration/plane_points.hpp"
#include "risley/core/progress.hpp"
#include "risley/estimation/free_parameters.hpp"

namespace risley::calibration {

/// How a recording's sensor stood.
struct StationPose {
  std::string name;
  Eigen::Matrix3d scene_from_sensor = Eigen::Matrix3d::Identity();  ///< start value
  Eigen::Matrix3d stated = Eigen::Matrix3d::Identity();             ///< what is known of it
  double sigma = 0;  ///< of each of the three stated rotations, rad; 0: exact
};

/// A wall: its normal is common to all recordings that see it, in the scene's frame.
struct Wall {
  std::string name;
  Vector3<double> normal{1, 0, 0};  ///< start value, unit vector, scene frame
  Vector3<double> stated{1, 0, 0};  ///< what is known of it
  /// How well the stated normal is known, rad per axis; negative: not at all. 0 holds it.
  double normal_sigma = -1;
};

/// What one recording saw of one wall. Each has a distance of its own: nobody measures where in the
/// sensor its origin is, and a rotation about the origin leaves the distance alone.
struct WallView {
  std::size_t recording = 0;  ///< row of PlanarProblem::stations
  std::size_t wall = 0;       ///< row of PlanarProblem::walls
  double distance = 0;        ///< m
  double range_variance = 0;  ///< of one range, m^2
  std::shared_ptr<const RangedShots> shots;
  double side = 1.0;  ///< -1 where the recording saw the wall from behind, against its normal
};

/// Least squares of all recordings together: ranges against explicit planes.
struct PlanarProblem {
  PrismTrain train;  ///< start values
  PrismGeometry geometry;
  std::vector<estimation::FreeParameter> free;  ///< to estimate
  PrismTrain prior;                             ///< where the priors of the parameters stand
  /// Prior sigma of every free parameter [free], SI; empty or infinite: none.
  std::vector<double> prior_sigma;
  double range_offset = 0;            ///< start value, m
  double range_offset_sigma = 0;      ///< prior about 0, m; 0 holds it at 0
  std::vector<StationPose> stations;  ///< [recordings]
  bool stations_known = false;        ///< whether their rotations tie the walls together
  std::vector<Wall> walls;
  std::vector<WallView> views;

  /// What is known of the rotation angles' common errors: parameters that the rotation angles were
  /// computed with. They are not estimated again, but their errors reach the result.
  std::vector<estimation::FreeParameter> considered;
  Eigen::MatrixXd considered_covariance;           ///< [considered, considered], SI
  std::vector<Eigen::MatrixXd> angle_sensitivity;  ///< [recordings] of [prisms, considered]
  /// Covariance of what the angles of one recording have in common beside that [recordings] of
  /// [prisms, prisms], rad^2; empty: nothing.
  std::vector<Eigen::MatrixXd> mean_angle_covariance;
};

/// Residual of a piece of prior knowledge: what it said less what the adjustment found.
struct PriorTest {
  std::string name;  ///< of the station or wall
  bool station = false;
  double misfit = 0;  ///< length of the rotation between both, rad
  double chi2 = 0;    ///< of the misfit
  int degrees_of_freedom = 0;
  double critical = 0;  ///< chi2 that a sound one exceeds once in 10,000
};

/// By how much a solution is off where a quantity that was not adjusted is off by one unit, SI.
struct SolutionResponse {
  Eigen::MatrixXd parameters;    ///< [free, quantities]
  Eigen::VectorXd range_offset;  ///< [quantities]; 0 where it is held, too
};

/// Solution of a problem. Problem holds the adjusted values.
struct PlanarSolution {
  PlanarProblem problem;  ///< train, range offset, stations, walls, distances as adjusted
  bool converged = false;
  int iterations = 0;
  double cost = 0;  ///< shots and priors, at the minimum
  std::size_t shots = 0, lost = 0;
  Eigen::VectorXd parameters;        ///< [free], SI
  Eigen::MatrixXd covariance;        ///< [free, free], common errors of the angles included
  Eigen::MatrixXd noise_covariance;  ///< [free, free], of the ranges' noise and the priors alone
  double range_offset_sigma = 0;     ///< m
  Eigen::VectorXd range_offset_covariance;  ///< with the parameters [free], SI; 0 where it is held
  SolutionResponse considered;              ///< to the considered parameters of the problem
  std::vector<double> distance_sigma;       ///< [views], m
  std::vector<double> normal_sigma;         ///< [walls], of the two angles together, rad
  /// What data, stations and known walls say of the free parameters, everything else eliminated and
  /// without the priors of the parameters themselves [free, free].
  Eigen::MatrixXd information;
  std::vector<PriorTest> prior_tests;
  /// Redundancy of every view: its shots less its share of the unknowns [views].
  std::vector<double> redundancy;
  /// Sum of squared residuals over variances of every view [views].
  std::vector<double> chi2;
};

/// When an adjustment on planes stops.
struct AdjustmentOptions {
  int most_iterations = 50;
  /// Done when a step would lower the cost by less than this (in the unit of one squared sigma).
  double tolerance = 1e-10;
  InstructionSet set = best_instruction_set();
};

/// Levenberg-Marquardt on normal equations that every view accumulates by itself.
/// @throws EstimationError when a beam leaves all planes, or nothing is to be estimated
PlanarSolution adjust(PlanarProblem problem, const AdjustmentOptions& options = {},
                      const Progress& progress = {});

/// Quantities that an adjustment held and that may be off: what moves with one unit of each.
struct HeldQuantities {
  Eigen::MatrixXd train;  ///< flat vector [places, held], SI; 0 in the places of free parameters
  std::vector<Eigen::MatrixXd> rotation_angles;  ///< [recordings] of [prisms, held], rad

  Eigen::Index count() const { return train.cols(); }  ///< of held quantities
};

/// -N^-1 J^T W K with N the normal equations at the solution and K what moves the predicted ranges.
/// @throws InvalidArgument for matrices that do not belong to train, recordings or each other,
///         EstimationError when the normal equations are singular
SolutionResponse held_response(const PlanarProblem& solved, const HeldQuantities& held,
                               InstructionSet set = best_instruction_set());

/// Prior sigmas of free parameters when every angle has the same [free], SI; infinite for others,
/// and for all without one.
/// @param angle_sigma  rad
std::vector<double> prior_sigmas(const std::vector<estimation::FreeParameter>& free,
                                 TrainShape shape, std::optional<double> angle_sigma);

/// Information of the priors on the free parameters [free, free].
Eigen::MatrixXd prior_information(const PlanarProblem& problem);

/// Whether a place of the flat vector is a material that is not adjusted: what the sensor computed
/// with is what light meets.
bool is_held_material(int place, const PlanarProblem& problem);

/// The view of a problem as plane_equations() wants it.
PlaneView plane_view(const PlanarProblem& problem, std::size_t view);

/// Whether a place of the flat vector describes what the prisms are made of (index, wedge), which
/// the sensor and the calibration share, and not how they are mounted.
bool is_material(int place, int prisms);

/// Two unit vectors that make a right-handed orthogonal triad with a unit vector.
std::pair<Vector3<double>, Vector3<double>> tangents_of(const Vector3<double>& normal);

}  // namespace risley::calibration
