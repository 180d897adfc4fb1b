// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/plane_equations.hpp"
#include "risley/calibration/plane_points.hpp"
#include "risley/calibration/wall_shape.hpp"
#include "risley/core/progress.hpp"
#include "risley/estimation/free_parameters.hpp"

namespace risley::calibration {

/// How a recording's sensor stood.
struct StationPose {
  std::string name;
  Eigen::Matrix3d scene_from_sensor = Eigen::Matrix3d::Identity();  ///< start value
  Eigen::Matrix3d stated = Eigen::Matrix3d::Identity();             ///< what is known of it
  /// Of each of the three stated rotations, rad; 0: exact, infinite: nothing is known.
  double sigma = 0;
  /// Of the sensor's origin in the scene's frame, m; it determines which places of a wall two
  /// recordings share.
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
};

/// A wall: its normal is common to all recordings that see it, in the scene's frame.
struct Wall {
  std::string name;
  Vector3<double> normal{1, 0, 0};  ///< start value, unit vector, scene frame
  Vector3<double> stated{1, 0, 0};  ///< what is known of it
  /// Uncertainty of the stated normal, rad per axis; negative: unknown. 0 holds it.
  double normal_sigma = -1;
  WallGrid grid = {};  ///< empty: the wall is flat
};

/// One recording's view of one wall. Each has its own distance: the position of the origin within
/// the sensor is not measured, and a rotation about the origin leaves the distance unchanged.
struct WallView {
  std::size_t recording = 0;  ///< row of PlanarProblem::stations
  std::size_t wall = 0;       ///< row of PlanarProblem::walls
  double distance = 0;        ///< m
  double range_variance = 0;  ///< of one range, m^2
  std::shared_ptr<const RangedShots> shots;
  double side = 1.0;  ///< -1 if the recording saw the wall from behind, against its normal
  /// First shot in every cell of the wall's grid and the end of the last [cells + 1]; empty if the
  /// wall is flat.
  std::vector<std::uint32_t> cell_begin = {};
};

/// Prior knowledge of one size of the prisms.
struct SizePrior {
  PrismSize size;
  double value = 0;  ///< m
  double sigma = 0;  ///< m, 0: exact
};

/// The variable of a range error term.
enum class RangeTermKind { near, incidence, per_decade, emitter };

/// A term of the range errors in addition to the constant one, see sensors::RangeErrors.
struct RangeTerm {
  std::string name;  ///< as in presets
  double value = 0;  ///< start value, SI
  double prior = 0;  ///< its known values, SI
  double sigma = 0;  ///< how well, SI; 0 holds it
  RangeTermKind kind = RangeTermKind::near;
  int emitter = 0;  ///< emitter with this error, from 0
};

/// Full angles of the beam, rad.
struct BeamDivergence {
  double horizontal = 0, vertical = 0;
};

/// Least squares of all recordings together: ranges against explicit planes.
struct PlanarProblem {
  PrismTrain train;  ///< start values
  PrismGeometry geometry;
  std::vector<estimation::FreeParameter> free;  ///< to estimate
  PrismTrain prior;                             ///< mean of the parameters' priors
  /// Prior sigma of every free parameter [free], SI; empty or infinite: none.
  std::vector<double> prior_sigma;
  double range_offset = 0;             ///< start value, m
  double range_offset_sigma = 0;       ///< prior about 0, m; 0 holds it at 0
  std::vector<RangeTerm> range_terms;  ///< [terms of the views' shots]
  BeamDivergence divergence;           ///< for the term of incidence
  /// Of the geometry, which holds their start values; empty: the geometry is exact.
  std::vector<SizePrior> sizes;
  std::vector<StationPose> stations;  ///< [recordings]
  bool stations_known = false;        ///< whether their rotations connect the walls
  std::vector<Wall> walls;
  std::vector<WallView> views;
  /// Prior for the shape of walls that have a grid.
  ShapePrior shape;

  /// Prior knowledge of the rotation angles' common errors: parameters with which the rotation
  /// angles were computed. They are not estimated again, but their errors propagate to the result.
  std::vector<estimation::FreeParameter> considered;
  Eigen::MatrixXd considered_covariance;           ///< [considered, considered], SI
  std::vector<Eigen::MatrixXd> angle_sensitivity;  ///< [recordings] of [prisms, considered]
  /// Covariance of the common errors of one recording's angles in addition to that [recordings] of
  /// [prisms, prisms], rad^2; empty: nothing.
  std::vector<Eigen::MatrixXd> mean_angle_covariance;
};

/// Residual of a piece of prior knowledge: stated less adjusted value.
struct PriorTest {
  std::string name;  ///< of the station or wall
  bool station = false;
  double misfit = 0;  ///< length of the rotation between both, rad
  double chi2 = 0;    ///< of the misfit
  int degrees_of_freedom = 0;
  double critical = 0;  ///< chi2 that a correct one exceeds once in 10,000
};

/// Shift of a solution for an error of one unit, SI, in a quantity that was not adjusted.
struct SolutionResponse {
  Eigen::MatrixXd parameters;  ///< [free, quantities]
  Eigen::MatrixXd numbers;     ///< [numbers, quantities]
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
  /// Sizes of the prisms and range errors that were adjusted, by their names, with their values.
  std::vector<std::string> numbers;
  Eigen::VectorXd number_values;            ///< [numbers], SI
  Eigen::MatrixXd number_covariance;        ///< [numbers, numbers], SI
  Eigen::MatrixXd number_cross_covariance;  ///< with the parameters [numbers, free], SI
  SolutionResponse considered;              ///< to the considered parameters of the problem
  std::vector<double> distance_sigma;       ///< [views], m
  std::vector<double> normal_sigma;         ///< [walls], of the two angles together, rad
  /// Information of data, stations and known walls on the free parameters, everything else
  /// eliminated and without the priors of the parameters themselves [free, free].
  Eigen::MatrixXd information;
  std::vector<PriorTest> prior_tests;
  /// Redundancy of every view: its shots less its share of the unknowns [views].
  std::vector<double> redundancy;
  /// Sum of squared residuals over variances of every view [views].
  std::vector<double> chi2;
  /// Estimate of the walls' shape; without weights if all walls are flat.
  ShapeSolution shape;

  /// Row of a number, or -1 if it was not adjusted.
  Eigen::Index number(std::string_view name) const;
  /// Its sigma, SI; 0 if it was not adjusted.
  double number_sigma(std::string_view name) const;
};

/// Convergence criteria of an adjustment on planes.
struct AdjustmentOptions {
  int most_iterations = 50;
  /// Done when a step would lower the cost by less than this (in the unit of one squared sigma).
  double tolerance = 1e-10;
  InstructionSet set = best_instruction_set();
};

/// Lays a grid over every wall and sorts the shots of its views by the grid's cells. The cell
/// follows from where a shot meets its plane in the problem.
void lay_grids(PlanarProblem& problem);

/// Levenberg-Marquardt on normal equations that every view accumulates by itself. Where walls have
/// grids: Gauss-Newton steps with the walls' shape integrated out, from the start values of an
/// adjustment on flat walls.
/// @throws EstimationError when a beam leaves all planes, or there is nothing to estimate
PlanarSolution adjust(PlanarProblem problem, const AdjustmentOptions& options = {},
                      const Progress& progress = {});

/// Held quantities that may be wrong, and the effect of one unit of each.
struct HeldQuantities {
  Eigen::MatrixXd train;  ///< flat vector [places, held], SI; 0 in the places of free parameters
  std::vector<Eigen::MatrixXd> rotation_angles;  ///< [recordings] of [prisms, held], rad

  Eigen::Index count() const { return train.cols(); }  ///< of held quantities
};

/// -N^-1 J^T W K with N the normal equations at the solution and K the derivatives of the predicted
/// ranges.
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

/// Whether a place of the flat vector is a material that is not adjusted: the sensor's own value is
/// the true one.
bool is_held_material(int place, const PlanarProblem& problem);

/// Value of a prism's own size in a geometry that has a value for every prism, m.
double size_value(const PrismGeometry& geometry, const PrismSize& size);

/// The view of a problem in the form for plane_equations().
PlaneView plane_view(const PlanarProblem& problem, std::size_t view);

/// Whether a place of the flat vector describes the material of the prisms (index, wedge), which
/// the sensor and the calibration share, and not their mounting.
bool is_material(int place, int prisms);

/// Two unit vectors that form a right-handed orthogonal triad with a unit vector.
std::pair<Vector3<double>, Vector3<double>> tangents_of(const Vector3<double>& normal);

}  // namespace risley::calibration
