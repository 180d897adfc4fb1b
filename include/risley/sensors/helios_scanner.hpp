// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/vector3.hpp"
#include "risley/sensors/scan_pattern.hpp"

namespace risley::sensors {

/// Most prisms of a HELIOS++ scanner.
inline constexpr int kHeliosPrisms = 3;

/// A sensor as a Risley scanner of HELIOS++, and the resulting losses. HELIOS++ has the axes x
/// right, y forward, z up. Its prisms all have the thin edge up at time 0 and turn at constant
/// speed, with the thin edge from up to the right if the speed is positive; a positive wedge angle
/// is that of the face which the beam meets first, a negative one that of the second. Time advances
/// by one pulse before it is used, so that pulse p, counted from 0, is at (p + 1) /
/// pulse_frequency. Every emitter fires at every pulse. Then the whole scanner is rotated.
struct HeliosScanner {
  std::vector<double> rotor_frequency;   ///< [prisms], signed, Hz
  std::vector<double> angle;             ///< [prisms], signed, rad
  std::vector<double> refractive_index;  ///< [prisms]
  double refractive_index_air = 1;
  std::vector<Vector3<double>> incident_beam;  ///< [emitters], unit vectors, axes of HELIOS++
  std::array<double, 3> turn{};  ///< about y, then x, then z of fixed axes, right-handed, rad
  long pulse_frequency = 0;      ///< of each emitter, Hz
  /// A shot of the pattern at time t is at t + time_lag in HELIOS++, s.
  double time_lag = 0;

  std::vector<std::string> not_carried;  ///< one sentence each; empty: the pattern itself
  std::uint64_t compared = 0;            ///< shots
  double rms = 0, worst = 0;             ///< angle to the sensor's own pattern, rad
};

/// The HELIOS++ scanner of a sensor: the rotors' start becomes a rotation about the beam and a time
/// lag as far as possible, and if prisms or bearings are tilted the scanner is rotated for the best
/// fit to the pattern.
/// @param rows  of the pattern to compare, at most a million
/// @throws InvalidArgument as scan_pattern(), for more than kHeliosPrisms prisms and for every
/// other than 1; Cancelled
HeliosScanner helios_scanner(const Sensor& sensor, std::uint64_t rows,
                             const ScanPatternOptions& options = {}, const Progress& progress = {});

}  // namespace risley::sensors
