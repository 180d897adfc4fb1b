// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/calibration/calibrate.hpp"

#include "calibration/labelled_shots.hpp"

namespace risley::calibration {

/// Takes regions that stand off their wall out of the labels. They are looked for among the
/// outliers too, where most shots of a larger step are.
/// @param[in,out] recordings  of the problem
std::vector<SurfaceStep> leave_out_steps(const PlanarProblem& problem,
                                         std::vector<LabelledShots>& recordings);

}  // namespace risley::calibration
