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

/// How the beams of a recording's shots are known.
enum class BeamSource {
  recorded,  ///< the file names them
  counted,   ///< in turn from the first shot, which may be of any emitter
};

/// How a sensor's emitters follow each other where beams were counted.
struct FiringOrder {
  int first_emitter = 0;   ///< that fired the shots of counted beam 0
  bool backwards = false;  ///< from the last emitter to the first
};

/// Emitter of shots 0, 1, ... up to as many as there are.
std::vector<std::uint8_t> emitters_in_order(const FiringOrder& order, int emitters);

/// How well one sensor describes the shots of a recording.
struct SensorMatch {
  std::size_t candidate = 0;  ///< place among those that were asked for
  /// Root mean square of what the sensor's lines leave of the directions, rad: lines of its speeds
  /// and amplitudes, and constants that stand apart as its emitters do. Infinite without lines.
  double misfit = std::numeric_limits<double>::infinity();
  /// Residuals of the start with the sensor's optics, rad, where lines alone did not decide and
  /// there is one.
  std::optional<double> residual;
  bool mirrored = false;
  FrameTurn frame;    ///< where the optical axis stands, to a degree or so
  FiringOrder order;  ///< of a sensor with several emitters
  /// Of the recording about the optical axis, rad in (-pi, pi]: as the emitters show it; 0
  /// where they do not.
  double roll = 0;
};

/// What the shots say of the sensor that fired them.
struct SensorRecognition {
  std::vector<SensorMatch> matches;  ///< of every candidate, best first
  bool fits = false;                 ///< the best one describes the shots, as far as lines can
  bool decided = false;  ///< and every other one leaves at least kClearlyWorse times as much
};

/// By how much every other candidate must be worse for a recognition to be decided.
inline constexpr double kClearlyWorse = 1.5;

/// Tells which sensor made a recording by the lines of y + iz that its rotors leave: their speeds,
/// their amplitudes, which say how far the prisms bend, and how far the emitters stand apart. Every
/// sensor is tried in all its speed combinations, as recorded and mirrored, whatever way the
/// recording's frame is turned. Where lines do not decide, because shots in a corner of the field
/// say little about their amplitudes, the sensors' optics do. docs/theory/start.md
/// @param head   every shot of about the first second, as recorded
/// @param found  about the head before; this adds to it
/// @throws EstimationError as LineSearch
SensorRecognition recognise_sensor(const AngleSeries& head,
                                   std::span<const sensors::Sensor> candidates, BeamSource beams,
                                   StartFindings* found = nullptr);

/// Residuals of a start with a sensor's optics, rad; empty where there is no start.
/// @param found  as recognise_sensor()
std::optional<double> start_residual(const AngleSeries& head, const sensors::Sensor& sensor,
                                     const FiringOrder& order, BeamSource beams,
                                     StartFindings* found = nullptr);

/// The beams of a sensor instead of those that were counted; one emitter fires all.
void number_beams(AngleSeries& series, const sensors::Sensor& sensor, const FiringOrder& order);

/// The candidate with the smallest field of view that holds the shots and has their beams: all that
/// shots without times, or too few, allow.
/// @return its place; empty when no field holds them
std::optional<std::size_t> smallest_field(const AngleSeries& head,
                                          std::span<const sensors::Sensor> candidates,
                                          BeamSource beams);

}  // namespace risley::estimation
