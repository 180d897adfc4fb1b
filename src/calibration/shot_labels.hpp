// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/calibration/plane_points.hpp"

namespace risley::calibration {

/// A shot belongs to a plane within this many sigmas: 3 of 1000 with normal noise do not.
inline constexpr double kGate = 3.0;
/// Shots beyond the gate and within this many sigmas are outliers of their plane. The search for
/// its steps extends as far: docs/theory/calibration.md
inline constexpr double kNearby = 10.0;

/// A view of fewer shots is dropped: its range variance would be known to no better than a quarter,
/// sqrt(2 / 30).
inline constexpr std::size_t kLeastViewShots = 30;

/// Typical sigma of a direction due to the rotation angles' covariance, rad.
double pointing_of_angles(const RangedShots& shots);

/// Which view of its recording each shot belongs to.
struct Labels {
  std::vector<int> view;          ///< [shots], row of PlanarProblem::views, -1: none
  std::vector<int> nearby;        ///< [shots], the same with the outliers of each plane
  std::vector<std::size_t> near;  ///< [views], rejected shots near a plane
};

/// Assigns every shot to the plane that explains its range best, in sigmas. Where two planes meet,
/// ranges cannot separate them; shots there are assigned to neither, and the decision uses only the
/// predicted ranges: a choice by the measured one would keep those whose noise points away from the
/// other plane.
/// @param pointing  1 sigma of the directions, rad
Labels label_shots(const PlanarProblem& problem, std::size_t recording, const RangedShots& shots,
                   double pointing);

/// Gives the views of one recording their labelled shots, with their shares in the range terms.
void hand_out(const RangedShots& shots, const std::vector<int>& view, std::size_t recording,
              PlanarProblem& problem);

}  // namespace risley::calibration
