// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/spectral_lines.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// Which rotor turns how, read off the spectrum: never by trying both combinations, because the
/// wrong one can end with small residuals and wrong parameters.
struct RotorIdentification {
  std::vector<SpectralLine> line;  ///< [prisms], in beam order
  std::optional<sensors::SpeedCombination> combination;
};

/// @throws EstimationError when no combination of the sensor's speeds is within 20 % of the lines;
///         says when the recording's clock rather than the rotors must be off
RotorIdentification identify_rotors(const std::vector<SpectralLine>& lines,
                                    const sensors::Sensor& sensor);

/// What an estimation starts from. All of the recording as it is to be used: turned if mirrored.
struct Start {
  std::int64_t time_ns = 0;                     ///< of the angles
  double reach = 0;                             ///< it was fitted to shots so far around, s
  std::vector<double> rotation_angle;           ///< [prisms], rad
  std::vector<double> angular_velocity;         ///< [prisms], rad/s
  std::vector<double> line_offset;              ///< [prisms], rotation angle less the line's phase
  PrismTrain train{parse_face_order("PA-AP")};  ///< free parameters fitted to the first shots
  std::optional<sensors::SpeedCombination> combination;
  bool mirrored = false;    ///< the recording is a mirror image and has to be turned
  double residual_rms = 0;  ///< of the fit, rad; robust, so that outliers do not count
};

/// Speeds, combination and rotation angles from the spectrum, then a robust least-squares fit of
/// parameters and motion to the same shots. It needs no zero position and so loses no shot.
///
/// Whether a recording holds the mirror image of what the sensor can produce (its elevation has the
/// other sign), as public copies of some vendor files do, cannot be told from the speeds: a
/// mirrored first combination turns like the second. The optics can: prisms bend differently when
/// met from the other side, and the fit leaves a tenth of a degree for the wrong image.
/// @param head      every shot of about the first second, as recorded
/// @param mirrored  whether the recording is a mirror image; empty finds out
/// @throws EstimationError naming what is missing: duration, shots, matching speeds
Start find_start(const AngleSeries& head, const sensors::Sensor& sensor,
                 const std::vector<FreeParameter>& free, double angle_noise,
                 std::optional<bool> mirrored = false);

}  // namespace risley::estimation
