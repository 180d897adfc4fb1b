// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// One line of the spectrum of y + iz, the beam's position across the axis.
struct SpectralLine {
  double angular_velocity = 0;  ///< rad/s, signed: right-handed about X is positive
  double amplitude = 0;         ///< of the unit vector's transverse part
  double phase = 0;             ///< rad, at the first shot of the series
};

/// The two strongest lines, strongest first. To first order a prism adds a vector that turns with
/// it, so each rotor owns one line.
/// @throws EstimationError when the series spans less than 50 ms or has too few shots
std::vector<SpectralLine> rotor_lines(const AngleSeries& series);

/// Which rotor turns how, read off the spectrum: never by trying both combinations, because the
/// wrong one can end with small residuals and wrong parameters.
struct RotorIdentification {
  std::vector<SpectralLine> line;  ///< [prisms], in beam order
  std::optional<sensors::SpeedCombination> combination;
};

/// @throws EstimationError when no combination of the sensor's speeds is within 20 % of the lines
RotorIdentification identify_rotors(const std::vector<SpectralLine>& lines,
                                    const sensors::Sensor& sensor);

/// Row of the series at which the beam is nearest to the sensor's zero position, where both angled
/// faces lean the same way and every rotation angle is zero.           [B21 section 2.4]
std::size_t zero_position_row(const AngleSeries& series, const PrismTrain& train);

/// How far behind the first shot a start is fitted, s.
inline constexpr double kStartWindow = 0.05;

/// What a filter starts from.
struct Start {
  std::int64_t time_ns = 0;                     ///< of the angles: the first shot of the head
  std::vector<double> rotation_angle;           ///< [prisms], rad
  std::vector<double> angular_velocity;         ///< [prisms], rad/s
  PrismTrain train{parse_face_order("PA-AP")};  ///< free parameters fitted to the first shots
  std::optional<sensors::SpeedCombination> combination;
  std::string method;       ///< "zero position" or "spectral phases"
  double residual_rms = 0;  ///< of the fit, rad
};

/// The paper's start, made safe: the speeds and the combination come from the spectrum, the angles
/// from the zero position, and least-squares fits at constant speed over up to 100 ms around it and
/// then over the first 50 ms of the recording bring both to where a filter can take over. When that
/// fit ends badly (the nearest shot may be many degrees from the zero position) the phases of the
/// spectral lines replace the zero position.
/// @param head  every shot of about the first second
/// @throws EstimationError naming what is missing: duration, shots, matching speeds
Start find_start(const AngleSeries& head, const sensors::Sensor& sensor,
                 const std::vector<FreeParameter>& free, double angle_noise);

/// Whether a recording holds the mirror image of what the sensor can produce (its elevation has the
/// other sign), as public copies of some vendor files do. The speeds cannot tell: a mirrored first
/// combination turns like the second. The optics can: prisms bend differently when met from the
/// other side, and the start's fit leaves a residual of a tenth of a degree for the wrong image.
/// @param head  shots as recorded
/// @return true only when the mirror image fits well and the recording itself does not
bool is_mirrored(const AngleSeries& head, const sensors::Sensor& sensor,
                 const std::vector<FreeParameter>& free, double angle_noise);

/// The same shots with the sign of the elevation turned.
AngleSeries mirror_image(AngleSeries series);

}  // namespace risley::estimation
