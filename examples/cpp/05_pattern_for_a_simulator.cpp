// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The directions of an Avia's shots, for a simulator with its own walls, and the share of the
// field of view that they cover after a tenth of a second, half a second and a second.
//
//   05_pattern_for_a_simulator [SENSOR] [--folder FOLDER]
#include <algorithm>

#include <risley/core/angle.hpp>
#include <risley/jobs/write_pattern.hpp>
#include <risley/sensors/pattern_coverage.hpp>
#include <risley/sensors/preset.hpp>
#include <risley/sensors/scan_pattern.hpp>

#include "example.hpp"

using namespace risley;

int pattern_for_a_simulator(const Arguments& arguments) {
  jobs::WritePatternOptions options;
  options.sensor = arguments.value.empty() ? "avia" : arguments.value;
  options.format = "npy";  // livox-csv, helios-xml, json, usda
  options.output = arguments.folder / "pattern.npy";
  options.duration = 1.0;
  const jobs::WrittenPattern made = jobs::write_pattern(options);

  // The same shots as columns in memory.
  const sensors::Sensor sensor = sensors::load_sensor(options.sensor.name());
  const sensors::ScanPattern shots = sensors::scan_pattern(sensor, 0, made.rows);
  const auto [left, right] = std::minmax_element(shots.azimuth.begin(), shots.azimuth.end());
  const auto [high, low] = std::minmax_element(shots.zenith.begin(), shots.zenith.end());
  fmt::print("{} shots, azimuth {:.2f} to {:.2f} degree, elevation {:.2f} to {:.2f} degree\n",
             made.rows, degrees_from_radians(*left), degrees_from_radians(*right),
             90 - degrees_from_radians(*low), 90 - degrees_from_radians(*high));

  // Cells of half a degree with a shot count as covered; a gap is the largest circle without one.
  sensors::CoverageOptions coverage;
  coverage.after = {0.1, 0.5, 1.0};
  for (const auto& one : sensors::pattern_coverage(sensor, {}, coverage).after) {
    fmt::print("after {:.1f} s: {} shots, {:.1f} % covered, largest gap {:.2f} degree\n", one.time,
               one.shots, 100 * one.covered, degrees_from_radians(one.gap));
  }
  return 0;
}

int main(int argc, char** argv) { return run_example(argc, argv, pattern_for_a_simulator); }
