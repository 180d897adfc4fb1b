// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/calibration/plane_points.hpp"

#include "calibration/shot_labels.hpp"

namespace risley::calibration {

/// All shots of one recording and their positions in the adjustment.
struct LabelledShots {
  RangedShots shots;    ///< at rotation angles from all recordings together
  double pointing = 0;  ///< pointing_of_angles()
  Labels labels;
};

/// Shots of one view of a problem against its plane.
struct ViewDistances {
  std::vector<double> azimuth, zenith;  ///< of the beams, rad
  std::vector<double> distance, sigma;  ///< from the plane, m
  std::vector<double> incidence;        ///< rad
  std::vector<std::size_t> rows;        ///< of the recording
};

/// @param recording  that the view is of
/// @param labels  of its shots: those with the view's row are selected
ViewDistances view_distances(const PlanarProblem& problem, std::size_t view,
                             const LabelledShots& recording, const std::vector<int>& labels);

}  // namespace risley::calibration
