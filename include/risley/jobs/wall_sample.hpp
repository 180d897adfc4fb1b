// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/calibration/calibrate.hpp"
#include "risley/core/vector3.hpp"

namespace risley::jobs {

/// One shot of a calibration in space.
struct SamplePoint {
  std::size_t recording = 0;
  int plane = -1;                  ///< row of Calibration::planes, -1: none
  Vector3<double> point;           ///< sensor frame, m, after the calibration
  double before = 0, after = 0;    ///< distance from the plane, m; NaN without a plane
  double azimuth = 0, zenith = 0;  ///< of the beam after the calibration, rad
  Vector3<double> off;             ///< reported minus calibrated direction, sensor frame
};

/// At most 20,000 shots of all recordings together, evenly spread.
/// @param recordings  the inputs of the calibration
/// @throws InvalidArgument for other recordings
std::vector<SamplePoint> wall_sample(const std::vector<calibration::RangedRecording>& recordings,
                                     const calibration::Calibration& calibration);

}  // namespace risley::jobs
