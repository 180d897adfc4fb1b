// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "risley/calibration/flight_judgement.hpp"

#include "calibration/flight_start.hpp"

namespace risley::calibration {

/// The last equations of a calibration in flight and their inputs; all of it must outlive this.
struct FlightEvidence {
  const FlightShots& shots;
  const ShotPoses& poses;
  const PlaneOfShot& plane;
  const FlightModel& model;
  const FlightWeights& weights;
  const FlightPriors& priors;
  const Eigen::VectorXd& prior_sigma;  ///< [globals]
  std::size_t considered = 0;          ///< number of the last free parameters: held, and possibly
                                       ///< off
  const FlightSystem& system;
  const Eigen::VectorXd* inverse_diagonal = nullptr;  ///< of the system, if already known [globals,
                                                      ///< errors]: effect of unstated errors, one
                                                      ///< sigma each, on the globals; or none.
  Eigen::MatrixXd further{};
  const RoughGround* ground = nullptr;  ///< or none: planes
};

/// Conclusions from the evidence of a calibration, real or planned.
FlightJudgement judge_flight(const FlightEvidence& evidence);

}  // namespace risley::calibration
