// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "risley/calibration/flight_adjustment.hpp"

namespace risley::calibration {

/// Prior of any plane: keeps planes with few shots regular and has negligible weight.
inline constexpr double kPlaneTiltSigma = 10, kPlaneOffsetSigma = 1000;  // rad, m

/// Prior of a plane, of its two tilts and its offset.
struct PlaneKnowledge {
  Eigen::Vector3d information{1 / (kPlaneTiltSigma * kPlaneTiltSigma),
                              1 / (kPlaneTiltSigma * kPlaneTiltSigma),
                              1 / (kPlaneOffsetSigma * kPlaneOffsetSigma)};
  Eigen::Vector3d off{0, 0, 0};  ///< from the current value to the known one
};

PlaneKnowledge knowledge_of(const PlanePrior& prior, const GroundPlane& plane);

}  // namespace risley::calibration
