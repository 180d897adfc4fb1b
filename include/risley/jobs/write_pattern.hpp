// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/jobs/given.hpp"
#include "risley/sensors/helios_scanner.hpp"
#include "risley/sensors/scan_pattern.hpp"

namespace risley::jobs {

/// A way to write a scan pattern.
struct PatternFormat {
  std::string name;         ///< "livox-csv"
  std::string description;  ///< columns, units, programs that read it
};

/// Those that write_pattern() knows.
const std::vector<PatternFormat>& pattern_formats();

/// What to write where.
struct WritePatternOptions {
  GivenSensor sensor;     ///< as load_result()
  std::string format;     ///< a name of pattern_formats()
  std::string output;     ///< path
  double duration = 1.0;  ///< s, of the scan
  sensors::ScanPatternOptions scan;
};

/// What came of it.
struct WrittenPattern {
  std::string sensor;  ///< name
  std::string format;
  std::string output;  ///< path; empty: a stream
  std::uint64_t rows = 0;
  std::uint64_t blocked = 0;  ///< of them, shots that do not get through the prisms
  std::string firing;         ///< "in_turn" or "together"
  /// Properties of the pattern that the format cannot hold, one sentence each.
  std::vector<std::string> not_carried;
  std::optional<sensors::HeliosScanner> helios;  ///< where the format is that of HELIOS++
};

/// First and last shot of a scan for a given time.
struct PatternRows {
  std::uint64_t first = 0;
  std::size_t count = 0;
};
/// @param start, duration  s
/// @throws InvalidArgument for numbers out of range
PatternRows pattern_rows(const sensors::Sensor& sensor, double start, double duration,
                         const sensors::ScanPatternOptions& scan);

/// sensors::scan_directions() of many rows, on several threads. @throws as that; Cancelled
template <class Number>
void pattern_directions(const sensors::Sensor& sensor, std::uint64_t first_row,
                        std::span<Number> out, const sensors::ScanPatternOptions& scan,
                        const Progress& progress = {});

/// Writes the scan pattern of a sensor for a simulator; the output appears when it is complete.
/// @throws InvalidArgument for an unknown sensor or format and for numbers out of range; FileError;
///         Cancelled
WrittenPattern write_pattern(const WritePatternOptions& options, const Progress& progress = {});

/// The same into an open stream; output of the options is not used.
WrittenPattern write_pattern(const WritePatternOptions& options, std::ostream& stream,
                             const Progress& progress = {});

}  // namespace risley::jobs
