// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// Origin of the beam numbers of a recording's shots.
enum class BeamSource {
  recorded,  ///< the file names them
  counted,   ///< in turn from the first shot, which may be of any emitter
};

/// Firing order of a sensor's emitters if beams were counted.
struct FiringOrder {
  int first_emitter = 0;   ///< that fired the shots of counted beam 0
  bool backwards = false;  ///< from the last emitter to the first
};

/// Emitter of shots 0, 1, ... for the number of emitters.
std::vector<std::uint8_t> emitters_in_order(const FiringOrder& order, int emitters);

/// Fit of one sensor to the shots of a recording.
struct SensorMatch {
  std::size_t candidate = 0;  ///< place among the candidates
  /// Root mean square of the directions without the sensor's lines, rad: lines with its speeds and
  /// amplitudes, and constants spaced as its emitters. Infinite without lines.
  double misfit = std::numeric_limits<double>::infinity();
  /// Residuals of the start with the sensor's optics, rad, if lines alone did not decide and there
  /// is one.
  std::optional<double> residual;
  bool mirrored = false;
  FrameTurn frame;    ///< direction of the optical axis, to a degree or so
  FiringOrder order;  ///< of a sensor with several emitters
  /// Of the recording about the optical axis, rad in (-pi, pi]: from the emitters; 0 if they do not
  /// show it.
  double roll = 0;
};

/// Evidence of the shots on the sensor that fired them.
struct SensorRecognition {
  std::vector<SensorMatch> matches;  ///< of every candidate, best first
  bool fits = false;                 ///< the best one fits the shots, as far as lines can
  bool decided = false;  ///< and every other one leaves at least kClearlyWorse times as much
};

/// Factor by which every other candidate must be worse for a decided recognition.
inline constexpr double kClearlyWorse = 1.5;

/// Recognises the sensor of a recording from the lines of y + iz due to its rotors: their speeds,
/// their amplitudes, which depend on the prisms' deflection, and the spacing of the emitters. Every
/// sensor is tried in all its speed combinations, as recorded and mirrored, for any orientation of
/// the recording's frame. If lines do not decide, because shots in a corner of the field hardly
/// determine their amplitudes, the sensors' optics do. docs/theory/start.md
/// @param head   every shot of about the first second, as recorded
/// @param found  earlier findings about the head; this adds to them
/// @throws EstimationError as LineSearch
SensorRecognition recognise_sensor(const AngleSeries& head,
                                   std::span<const sensors::Sensor> candidates, BeamSource beams,
                                   StartFindings* found = nullptr);

/// Residuals of a start with a sensor's optics, rad; empty if there is no start.
/// @param found  as recognise_sensor()
std::optional<double> start_residual(const AngleSeries& head, const sensors::Sensor& sensor,
                                     const FiringOrder& order, BeamSource beams,
                                     StartFindings* found = nullptr);

/// The beams of a sensor instead of the counted ones; a single emitter fires all.
void number_beams(AngleSeries& series, const sensors::Sensor& sensor, const FiringOrder& order);

/// The candidate with the smallest field of view that contains the shots and has their beams: the
/// only criterion for shots without times, or too few.
/// @return its place; empty when no field contains them
std::optional<std::size_t> smallest_field(const AngleSeries& head,
                                          std::span<const sensors::Sensor> candidates,
                                          BeamSource beams);

}  // namespace risley::estimation
