// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "risley/calibration/flight_judgement.hpp"

#include "calibration/flight_start.hpp"

namespace risley::calibration {

/// The last equations of a calibration in flight and what they were made of; all of it must outlive
/// this.
struct FlightEvidence {
  const FlightShots& shots;
  const ShotPoses& poses;
  const PlaneOfShot& plane;
  const FlightModel& model;
  const FlightWeights& weights;
  const FlightPriors& priors;
  const Eigen::VectorXd& prior_sigma;  ///< [globals]
  std::size_t considered = 0;          ///< number of the last free parameters: held, and may be off
  const FlightSystem& system;
  const Eigen::VectorXd* inverse_diagonal = nullptr;  ///< of the system, where it is known already
  /// [globals, errors]: what unstated errors, one sigma each, do to the globals; or none.
  Eigen::MatrixXd further{};
  const RoughGround* ground = nullptr;  ///< or none: planes
};

/// What the evidence shows: of a calibration that was made, or of one that is planned.
FlightJudgement judge_flight(const FlightEvidence& evidence);

}  // namespace risley::calibration
