// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "risley/sensors/sensor.hpp"

namespace risley::sensors {

/// Selection of shots of a scan sequence, and their times.
struct ScanPatternOptions {
  std::optional<double> shot_rate;     ///< shots per second; empty: the sensor's
  std::optional<Firing> firing;        ///< empty: as in the sensor's sequence
  std::vector<double> rotation_angle;  ///< [prisms] at time 0, rad; empty: the sequence's, or 0
  std::uint64_t every = 1;             ///< keeps the last of this many shots
  /// Whether `every` counts groups of shots, one of each emitter, and keeps these complete.
  bool whole_groups = false;
};

/// Shot directions of a sensor, free of noise.
struct ScanPattern {
  std::vector<double> time;           ///< of the shots, s
  std::vector<double> azimuth;        ///< rad
  std::vector<double> zenith;         ///< rad; NaN, like the azimuth, if no beam gets through
  std::vector<std::uint8_t> emitter;  ///< counted from 0

  std::size_t size() const { return time.size(); }
};

/// The rotors' places at time 0, rad, [prisms].
/// @throws InvalidArgument for angles that are not one per prism
std::vector<double> start_angles(const Sensor& sensor, const ScanPatternOptions& options);

/// Of the swing of a sensor's speeds, rad/s: see ScanSequence. 0 where none swings.
/// @throws InvalidArgument for swings that are not one per prism, and for a single prism that
/// swings
double swing_angular_frequency(const Sensor& sensor);

/// Rows [first_row, first_row + rows) of the scan sequence with rotors at constant speed: row r is
/// shot every (r + 1) - 1; with whole groups of E emitters, (every (r / E + 1) - 1) E + r mod E.
/// @throws InvalidArgument for angles or speeds that are not one per prism, a rate that is not
/// positive, every = 0, and for a time beyond 1e7 s
ScanPattern scan_pattern(const Sensor& sensor, std::uint64_t first_row, std::size_t rows,
                         const ScanPatternOptions& options = {});

/// Only the times and emitters of these rows. @throws as scan_pattern()
ScanPattern scan_times(const Sensor& sensor, std::uint64_t first_row, std::size_t rows,
                       const ScanPatternOptions& options = {});

/// Directions of these rows as unit vectors in the sensor's frame; NaN if no beam gets through.
/// @param out  [rows][3]
/// @throws as scan_pattern(), and InvalidArgument for a length that is not a multiple of 3
void scan_directions(const Sensor& sensor, std::uint64_t first_row, std::span<double> out,
                     const ScanPatternOptions& options = {});
/// The same in single precision, accurate to 2e-6: with rotors at constant speed, and one emitter
/// or several in turn, a core with AVX2 computes more than 10^8 a second.
void scan_directions(const Sensor& sensor, std::uint64_t first_row, std::span<float> out,
                     const ScanPatternOptions& options = {});

}  // namespace risley::sensors
