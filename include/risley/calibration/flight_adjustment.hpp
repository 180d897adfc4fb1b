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

/// What is known of a plane before a flight.
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
  std::vector<PlanePrior> planes{};  ///< of those that are known, at most one for each
  std::vector<ProcessBreak> breaks{};  ///< of the process, at knots of the model
};

/// Values of the unknowns [globals], the boresight as a rotation vector of up to half a turn.
Eigen::VectorXd unknown_values(const FlightModel& model);

/// Derivatives of unknown_values() by the unknowns [globals, globals]: the identity but for the
/// boresight, whose unknowns are rotations after the one there is.
Eigen::MatrixXd value_rates(const FlightModel& model);

/// Normal equations with the planes eliminated and factorised: unknowns are the corrections at all
/// knots, six by six, and behind them the globals.
class FlightSystem {
 public:
  /// @throws InvalidArgument for sizes that do not fit, EstimationError when the equations
  /// determine some
  ///         unknown nothing at all and no prior does
  FlightSystem(const FlightEquations& equations, const FlightModel& model,
               const FlightPriors& priors);
  FlightSystem(FlightSystem&&) noexcept;
  FlightSystem& operator=(FlightSystem&&) noexcept;
  ~FlightSystem();

  Eigen::Index size() const;     ///< 6 knots + globals
  Eigen::Index globals() const;  ///< of these

  /// Solution of the equations: what to add to all unknowns [size], and to the planes' [3, planes].
  struct Step {
    Eigen::VectorXd unknowns;
    Eigen::MatrixXd planes;
    /// By how much the cost would fall beyond what the planes alone could do, in squared sigmas.
    double promised = 0;
  };
  /// The Gauss-Newton step that these equations ask for.
  Step step() const;

  /// Columns of the inverse of the equations times `right` [size, columns]; rows of what is held
  /// count nothing.
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
  /// By how much the unknowns move where a held global is off by one unit [size, held].
  Eigen::MatrixXd held_changes() const;
  /// The priors' part of the equations times columns [size, columns].
  Eigen::MatrixXd prior_times(const Eigen::MatrixXd& columns) const;

 private:
  struct ReducedEquations;
  std::unique_ptr<ReducedEquations> reduced_;
};

/// Adds a step to a model.
void apply(const FlightSystem::Step& step, FlightModel& model);

/// When an adjustment in flight stops, and how it weighs the ground.
struct FlightAdjustmentOptions {
  int most_steps = 10;
  double tolerance = 1e-2;  ///< done when a step promises less, in squared sigmas
  /// Columns of a cell that leans as its surroundings do, but for noise, are those of its
  /// surroundings; its plane is adjusted as ever.
  bool smooth = false;
  InstructionSet set = best_instruction_set();
};

/// What an adjustment in flight arrived at.
struct FlightAdjustment {
  FlightModel model;  ///< adjusted
  int steps = 0;
  bool converged = false;
  double promised = 0;  ///< by the last step, in squared sigmas
  double cost = 0;      ///< of the shots, before the last step
  std::size_t shots = 0, lost = 0, outliers = 0;
};

/// Gauss-Newton steps on shots whose planes are given.
/// @throws EstimationError when steps grow beyond all bounds; as flight_equations, FlightSystem
FlightAdjustment adjust_flight(const FlightShots& shots, const ShotPoses& poses,
                               const PlaneOfShot& plane, FlightModel model,
                               const FlightWeights& weights, const FlightPriors& priors,
                               const FlightAdjustmentOptions& options = {},
                               const Progress& progress = {});

/// How ground departs from its planes, which all strips see alike: a covariance between the patches
/// of a cell, of some cells that stand for all.
struct RoughGround {
  static constexpr int kSide = 3;                 ///< patches along a side of a cell
  static constexpr int kPatches = kSide * kSide;  ///< of a cell
  /// Along the ranges, between the patches, m^2.
  Eigen::Matrix<double, kPatches, kPatches> covariance =
      Eigen::Matrix<double, kPatches, kPatches>::Zero();
  std::vector<std::int8_t> patch;  ///< [shots]; -1: of a cell that does not count
  double cells_for_each = 1;       ///< that counts
};

/// How far linear functions of the solution are off.
/// @param functionals  [size, functions], of the unknowns of the system
/// @return covariance of all [functions, functions]: of the ranges' own noise, of the white noise
///         of the attitude that the shots of a sample share, of what the trajectory's process does
///         between knots, and of the priors, whatever the weights were
/// @param ground  rough ground, or nullptr: planes
/// @throws as flight_equations
Eigen::MatrixXd flight_covariance(const FlightShots& shots, const ShotPoses& poses,
                                  const PlaneOfShot& plane, const FlightModel& model,
                                  const FlightWeights& weights, const FlightPriors& priors,
                                  const FlightSystem& system, const Eigen::MatrixXd& functionals,
                                  const RoughGround* ground = nullptr,
                                  InstructionSet set = best_instruction_set());

}  // namespace risley::calibration
