// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/calibration/planar_adjustment.hpp"

namespace risley::calibration {

/// The paper's adjustment: Cartesian points of the measured ranges [B21 Eq. (31)], a best-fit plane
/// of each wall by singular value decomposition, and unweighted point-to-plane distances made small
/// [B21 Eq. (32)], minimised until the standard deviation of unit weight converges. The planes' own
/// unknowns are eliminated from the derivatives; otherwise the parameters would work against the
/// fit. Uses only train, geometry, free parameters and shots of a problem: no weights, no priors,
/// no range offset, no stations; every view is a separate wall. The covariance is sigma_0^2 (A^T
/// A)^-1 of the distances found.
/// @throws EstimationError when shots lie on one line
PlanarSolution adjust_as_paper(PlanarProblem problem, int most_iterations = 50,
                               const Progress& progress = {});

}  // namespace risley::calibration
