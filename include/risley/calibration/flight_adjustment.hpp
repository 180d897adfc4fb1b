// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_equations.hpp"
#include "risley/core/progress.hpp"

namespace risley::calibration {

/// Prior knowledge of a plane before a flight.
struct PlanePrior {
  std::size_t plane = 0;
  Eigen::Vector3d place{0, 0, 0};  ///< on it, local frame, m
  double sigma = 0;                ///< of the place along the normal, m
  std::optional<Eigen::Vector3d> normal{};
  double normal_sigma = 0;  ///< of each of its two tilts, rad
};

/// What is known before a flight.
struct FlightPriors {
  trajectories::ErrorProcess process;  ///< of the trajectory, at times of the recording's clock
  Eigen::VectorXd mean;                ///< [globals], SI; the boresight as a rotation vector
  Eigen::MatrixXd information;       ///< [globals, globals], inverse of its covariance; 0: nothing
  std::vector<bool> held{};          ///< [globals]: not to be adjusted; empty: none
  std::vector<PlanePrior> planes{};  ///< of the known ones, at most one for each
  std::vector<ProcessBreak> breaks{};  ///< of the process, at knots of the model
};

/// Values of the unknowns [globals], the boresight as a rotation vector of up to half a turn.
Eigen::VectorXd unknown_values(const FlightModel& model);

/// Derivatives of unknown_values() with respect to the unknowns [globals, globals]: the identity
/// except for the boresight, where the unknowns are rotations after the current one.
Eigen::MatrixXd value_rates(const FlightModel& model);

/// Normal equations with the planes eliminated and factorised: unknowns are the corrections at all
/// knots, six by six, followed by the globals.
class FlightSystem {
 public:
  /// @throws InvalidArgument for sizes that do not fit, EstimationError when neither the equations
  /// nor a prior determine some unknown
  FlightSystem(const FlightEquations& equations, const FlightModel& model,
               const FlightPriors& priors);
  FlightSystem(FlightSystem&&) noexcept;
  FlightSystem& operator=(FlightSystem&&) noexcept;
  ~FlightSystem();

  Eigen::Index size() const;     ///< 6 knots + globals
  Eigen::Index globals() const;  ///< of these

  /// Solution of the equations: the increments of all unknowns [size], and of the planes' [3,
  /// planes].
  struct Step {
    Eigen::VectorXd unknowns;
    Eigen::MatrixXd planes;
    /// Decrease of the cost beyond that of the planes alone, in squared sigmas.
    double promised = 0;
  };
  /// The Gauss-Newton step of these equations.
  Step step() const;

  /// Columns of the inverse of the equations times `right` [size, columns]; rows of held unknowns
  /// are ignored.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& right) const;
  /// The planes' part of such columns [3 planes, columns].
  Eigen::MatrixXd planes_of(const Eigen::MatrixXd& solution) const;
  /// The inverse of the equations [size, size].
  Eigen::MatrixXd inverse() const;
  /// The part of inverse() that neighbouring knots share, in less memory than the whole.
  struct Band {
    Eigen::VectorXd diagonal;  ///< [size]
    /// [6 (knots - 1)]: between a correction at a knot and the same one at the next.
    Eigen::VectorXd next;
  };
  /// Zero where a global is held.
  Band inverse_band() const;
  /// Diagonal of inverse() [size], in less memory than the whole.
  Eigen::VectorXd inverse_diagonal() const { return inverse_band().diagonal; }
  /// Shift of the unknowns for an error of one unit in a held global [size, held].
  Eigen::MatrixXd held_changes() const;
  /// The priors' part of the equations times columns [size, columns].
  Eigen::MatrixXd prior_times(const Eigen::MatrixXd& columns) const;

 private:
  struct ReducedEquations;
  std::unique_ptr<ReducedEquations> reduced_;
};

/// Adds a step to a model.
void apply(const FlightSystem::Step& step, FlightModel& model);

/// Convergence criteria of an adjustment in flight, and its weighting of the ground.
struct FlightAdjustmentOptions {
  int most_steps = 10;
  double tolerance = 1e-2;  ///< done when a step promises less, in squared sigmas
  /// Columns of a cell that differs from its surroundings only by noise are those of its
  /// surroundings; its plane is adjusted normally.
  bool smooth = false;
  InstructionSet set = best_instruction_set();
};

/// Result of an adjustment in flight.
struct FlightAdjustment {
  FlightModel model;  ///< adjusted
  int steps = 0;
  bool converged = false;
  double promised = 0;  ///< by the last step, in squared sigmas
  double cost = 0;      ///< of the shots, before the last step
  std::size_t shots = 0, lost = 0, outliers = 0;
};

/// Gauss-Newton steps on shots with given planes.
/// @throws EstimationError when steps grow without bound; as flight_equations, FlightSystem
FlightAdjustment adjust_flight(const FlightShots& shots, const ShotPoses& poses,
                               const PlaneOfShot& plane, FlightModel model,
                               const FlightWeights& weights, const FlightPriors& priors,
                               const FlightAdjustmentOptions& options = {},
                               const Progress& progress = {});

/// Departure of the ground from its planes, the same for all strips: a covariance between the
/// patches of a cell, of some cells that represent all.
struct RoughGround {
  static constexpr int kSide = 3;                 ///< patches along a side of a cell
  static constexpr int kPatches = kSide * kSide;  ///< of a cell
  /// Along the ranges, between the patches, m^2.
  Eigen::Matrix<double, kPatches, kPatches> covariance =
      Eigen::Matrix<double, kPatches, kPatches>::Zero();
  std::vector<std::int8_t> patch;  ///< [shots]; -1: of a cell that does not count
  double cells_for_each = 1;       ///< that counts
};

/// Errors of linear functions of the solution.
/// @param functionals  [size, functions], of the unknowns of the system
/// @return covariance of all [functions, functions]: of the ranges' own noise, of the white
/// attitude noise common to the shots of a sample, of the trajectory's process between knots, and
/// of the priors, whatever the weights were
/// @param ground  rough ground, or nullptr: planes
/// @throws as flight_equations
Eigen::MatrixXd flight_covariance(const FlightShots& shots, const ShotPoses& poses,
                                  const PlaneOfShot& plane, const FlightModel& model,
                                  const FlightWeights& weights, const FlightPriors& priors,
                                  const FlightSystem& system, const Eigen::MatrixXd& functionals,
                                  const RoughGround* ground = nullptr,
                                  InstructionSet set = best_instruction_set());

}  // namespace risley::calibration
