// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include "risley/calibration/flight_adjustment.hpp"

namespace risley::calibration {

/// What is known of any plane before: keeps those of few shots regular and weighs nothing.
inline constexpr double kPlaneTiltSigma = 10, kPlaneOffsetSigma = 1000;  // rad, m

/// What is known of a plane before, of its two tilts and its offset.
struct PlaneKnowledge {
  Eigen::Vector3d information{1 / (kPlaneTiltSigma * kPlaneTiltSigma),
                              1 / (kPlaneTiltSigma * kPlaneTiltSigma),
                              1 / (kPlaneOffsetSigma * kPlaneOffsetSigma)};
  Eigen::Vector3d off{0, 0, 0};  ///< of what is known from what there is
};

PlaneKnowledge knowledge_of(const PlanePrior& prior, const GroundPlane& plane);

}  // namespace risley::calibration
