// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>

#include "risley/core/progress.hpp"
#include "risley/jobs/write_pattern.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Wavelength of every Livox Risley sensor, which presets do not hold: manufacturer's user manuals.
inline constexpr double kWavelengthNm = 905;

/// A scan pattern being written to a stream.
class PatternStream {
 public:
  /// @param result  counts rows and blocked shots, and receives the format's remarks
  PatternStream(const sensors::Sensor& sensor, const WritePatternOptions& options,
                std::ostream& stream, const Progress& progress, WrittenPattern& result)
      : sensor_(sensor), options_(options), stream_(stream), progress_(progress), result_(result) {}

  const sensors::Sensor& sensor() const { return sensor_; }
  const WritePatternOptions& options() const { return options_; }
  const Progress& progress() const { return progress_; }
  WrittenPattern& result() { return result_; }

  /// Appends to the output. @throws FileError
  void put(const std::string& text);

  /// Writes the result of `text` for every piece of the pattern, in order.
  /// @param pass  number of the pass over the whole pattern, from 0
  void put_rows(const std::function<std::string(const sensors::ScanPattern&)>& text, int pass = 0,
                int passes = 1);

 private:
  const sensors::Sensor& sensor_;
  const WritePatternOptions& options_;
  std::ostream& stream_;
  const Progress& progress_;
  WrittenPattern& result_;
};

void put_livox_csv(PatternStream& out);
void put_npy(PatternStream& out);
void put_helios_xml(PatternStream& out);
void put_isaac_json(PatternStream& out);
void put_isaac_usda(PatternStream& out);

}  // namespace risley::jobs
