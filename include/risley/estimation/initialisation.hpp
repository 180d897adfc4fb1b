// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/spectral_lines.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// The beam turns like the sensor's rotors, but all of them faster by one factor.
class WrongClock : public EstimationError {
 public:
  using EstimationError::EstimationError;
};

/// How a start is looked for.
struct StartOptions {
  std::vector<FreeParameter> free;  ///< parameters that are fitted to the first shots
  double angle_noise = 0;           ///< 1 sigma of azimuth and zenith, roughly, rad
  /// Whether the recording is a mirror image; empty: to be determined.
  std::optional<bool> mirrored = false;
  /// Whether the recording's frame is turned against the sensor's; empty finds out: it is when
  /// shots lie outside the sensor's field of view.
  std::optional<bool> turned;

  friend bool operator==(const StartOptions&, const StartOptions&) = default;
};

/// Assumed motion of rotors before the recording shows it.
struct FirstMotion {
  double window = 0.025;  ///< s, within which a speed is practically constant
  RotorProcess process = kSettlingProcess;
};

/// What an estimation starts from. Preparation of a recording: flipped if mirrored, and turned into
/// the sensor's frame.
struct Start {
  std::int64_t time_ns = 0;              ///< of the angles
  double reach = 0;                      ///< it was fitted to shots so far around, s
  std::vector<double> rotation_angle;    ///< [prisms], rad
  std::vector<double> angular_velocity;  ///< [prisms], rad/s
  PrismTrain train;                      ///< free parameters fitted to the first shots
  std::optional<int> combination;
  bool mirrored = false;           ///< the recording is a mirror image and must be flipped
  std::optional<FrameTurn> frame;  ///< of the recording, if it is not the sensor's
  double residual_rms = 0;         ///< of the fit, rad; robust against outliers
  FirstMotion motion;              ///< faster where the sensor's speeds swing
};

/// Findings about some shots on the way to a start, so that the next caller need not repeat the
/// search. It is valid only for these shots.
struct StartFindings {
  /// A question and its answer.
  struct Known {
    sensors::Sensor sensor;
    StartOptions options;
    Start start;
  };
  std::shared_ptr<const LineSearch> lines;  ///< in the shots' own frame
  /// Those near some speeds, within kUsualShare.
  std::map<std::vector<double>, std::vector<RotorLines>> near;
  std::vector<Known> starts;
};

/// Speeds, combination and rotation angles from fits of lines, then a robust least-squares fit of
/// parameters and motion to the same shots, for every combination of the sensor's speeds and both
/// possible mirror images; the one with the smallest residuals wins. It needs no zero position, so
/// it loses no shot, and half of the field may be missing.
///
/// Whether a recording holds the mirror image of what the sensor can produce (its elevation has the
/// other sign), as public copies of some vendor files do, cannot be seen from the speeds: a
/// mirrored first combination turns like the second. The optics can: prisms bend differently when
/// met from the other side, and the fit leaves a tenth of a degree for the wrong image.
/// @param head   every shot of about the first second, as recorded
/// @param found  earlier findings about the head; this adds to them
/// @throws EstimationError naming the missing condition: duration, shots, matching speeds; also
/// when two solutions fit equally well, and when the recording's clock rather than the rotors must
/// be wrong (WrongClock)
Start find_start(const AngleSeries& head, const sensors::Sensor& sensor,
                 const StartOptions& options, StartFindings* found = nullptr);

/// The shots prepared as a start requires: flipped if mirrored, and in the sensor's frame.
void prepare_shots(AngleSeries& series, const Start& start);

}  // namespace risley::estimation
