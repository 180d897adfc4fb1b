// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/core/vector3.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/jobs/beam_comparison.hpp"
#include "risley/jobs/wall_sample.hpp"

namespace risley::jobs {

/// Square cells of the field of view.
struct FieldCells {
  double side = 0;                      ///< rad
  std::vector<double> azimuth, zenith;  ///< middle of the cells, rad
};

/// Mean distances from the planes over cells of the field of view, of all recordings together.
/// Cells with few points are omitted.
struct WallField {
  FieldCells cells;
  std::vector<double> mean_before, mean_after;  ///< [cells], m
  std::size_t fewest_points = 0;                ///< that a cell must hold
  std::size_t points = 0;                       ///< of all cells, including omitted ones
  double rms_before = 0, rms_after = 0;         ///< of the means, m
  double noise = 0;                             ///< its expected value for pure noise, m
};

/// Mean errors of reported directions over cells of the field of view, of all recordings together.
struct PointingField {
  FieldCells cells;
  std::vector<double> total;  ///< [cells], rad
  std::vector<double> shape;  ///< without the rotation common to all beams, rad
};

/// Mean of the points of one wall in one cell of the field of view: single points would show
/// nothing but the noise of ranges.
struct WallPatch {
  std::size_t plane = 0;         ///< row of Calibration::planes
  Vector3<double> foot;          ///< on the plane, sensor frame, m
  double before = 0, after = 0;  ///< mean distance from the plane, m
};

/// The walls of one recording, in space.
struct WallsInSpace {
  std::size_t recording = 0;
  std::vector<WallPatch> patches;
  std::size_t fewest_points = 0;  ///< that a patch must hold
  std::size_t points = 0;         ///< of all patches, including omitted ones
  double rms_before = 0;          ///< of the patches, m
  double largest = 0;             ///< distance from a plane, before or after, m
  double farthest = 0;            ///< patch from the sensor, m
};

/// Errors of beams with known truth, rad.
struct BeamErrorMoments {
  estimation::Moments azimuth_before, zenith_before, azimuth_after, zenith_after;
};

/// Details of a calibration in addition to its numbers; all from a sample.
struct CalibrationDetails {
  std::vector<SamplePoint> sample;
  std::size_t points_on_planes = 0;                       ///< of the sample
  estimation::Moments distances_before, distances_after;  ///< from the planes, m
  std::optional<PointingField> pointing;                  ///< where a beam is known
  std::optional<WallField> field;                         ///< where a cell holds points enough
  std::vector<WallsInSpace> walls;                        ///< of the first recordings
  std::optional<BeamErrorMoments> beam_errors;
};

/// @param recordings  how many there were
/// @param sample      wall_sample() of them
/// @param truth       where it is known
CalibrationDetails calibration_details(const calibration::Calibration& calibration,
                                       std::size_t recordings, std::vector<SamplePoint> sample,
                                       const std::optional<BeamComparison>& truth = {});

}  // namespace risley::jobs
