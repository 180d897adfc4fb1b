// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace risley::calibration {

/// Residuals of one wall in one recording, as columns of one length.
struct SurfaceResiduals {
  std::span<const double> azimuth, zenith;  ///< of the beams, rad
  std::span<const double> distance;         ///< from the plane, m
  std::span<const double> sigma;            ///< of the distance, m
};

/// A compact region that stands off its surroundings: a door frame, a picture, a recess.
struct StepRegion {
  double height = 0;               ///< against its surroundings, m
  double azimuth = 0, zenith = 0;  ///< middle, rad
  double solid_angle = 0;          ///< that its cells fill, sr
  std::size_t points = 0;
  double significance = 0;  ///< height over its sigma
  /// Of the residuals. A step of more than four sigmas of a point takes only its own rows from the
  /// cells on its border; a lower one takes all of their rows, because noise would decide which are
  /// its own.
  std::vector<std::size_t> rows;
};

/// Steps and unevenness found in the residuals of a surface.
struct SurfaceReport {
  std::vector<StepRegion> steps;  ///< largest solid angle first
  /// Mean square of cell means over their variances, less the step regions and the cells beside
  /// them: 1 for a flat wall.
  double unevenness = 1;
  std::size_t cells = 0;  ///< that had enough points
};

/// Cells are this wide, rad (1 degree): smaller ones have too few points at 1 kHz.
inline constexpr double kSurfaceCell = 0.017453292519943295;

/// Looks for compact steps and unevenness in means over cells of the field of view. The calibration
/// parameters absorb a step of a few sigmas on a small region by bending the rest of the plane
/// smoothly; so the cells are compared with a smooth surface fitted robustly to all of them, and
/// not with zero. Cells are compared in sigmas of their medians: a step has at least three of them,
/// is higher than 5 mm, and stands out from waves of the surface. Pure noise shows one on less than
/// one of a thousand surfaces. Non-finite rows are skipped.
/// @throws InvalidArgument when the columns differ in length
SurfaceReport inspect_surface(const SurfaceResiduals& residuals);

}  // namespace risley::calibration
