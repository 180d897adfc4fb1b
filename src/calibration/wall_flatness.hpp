// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/calibration/calibrate.hpp"

#include "calibration/labelled_shots.hpp"

namespace risley::calibration {

/// Removes regions that stand off their wall from the labels. The search includes the outliers,
/// which hold most shots of a larger step.
/// @param[in,out] recordings  of the problem
std::vector<SurfaceStep> leave_out_steps(const PlanarProblem& problem,
                                         std::vector<LabelledShots>& recordings);

}  // namespace risley::calibration
