// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// A unit is bent by 0.4 degree and does not know it. Five flat walls show it, and nothing about
// them has to be measured.
//
//   03_calibrate_a_hall [SCENE] [--folder FOLDER]     data/hall.yaml of the sources without one
#include <string>

#include <risley/core/angle.hpp>
#include <risley/jobs/calibrate_recordings.hpp>
#include <risley/jobs/simulation_settings.hpp>
#include <risley/simulation/truth_file.hpp>

#include "example.hpp"

using namespace risley;

/// Simulates a recording and calibrates the sensor on the walls in it.
jobs::CalibratedRecordings record_and_calibrate(const jobs::SimulationOptions& simulation,
                                                const std::string& recording,
                                                const std::string& folder) {
  simulation::simulate_to_file(jobs::simulation_settings(simulation), recording, {});
  jobs::CalibrateRecordingsOptions options;
  options.recordings = {recording};
  options.truths = {simulation::truth_preset_path(recording)};
  options.files.folder = folder;  // calibration.yaml and states.nc; empty: no files
  return jobs::calibrate_recordings(options);
}

void print_error(const char* when, const calibration::DirectionErrors& error) {
  fmt::print("{:16}{:9.5f}{:9.5f}{:9.5f}\n", when, degrees_from_radians(error.total),
             degrees_from_radians(error.gauge), degrees_from_radians(error.shape));
}

int calibrate_a_hall(const Arguments& arguments) {
  jobs::SimulationOptions unit;
  unit.sensor = "mid-40-table3";
  unit.scene = arguments.value.empty() ? RISLEY_HALL : arguments.value;
  unit.duration = 2.0;
  unit.reported_nominal = true;  // it believes that it is perfect
  unit.seed = 1;
  const jobs::CalibratedRecordings found =
      record_and_calibrate(unit, arguments.folder / "bent.lvx", arguments.folder / "calibration");
  const calibration::CalibrationVerdict& verdict = found.calibration.verdict;
  fmt::print("before: {}\n{}\nwhat to do: {}\n", to_string(verdict.code), verdict.words,
             verdict.to_do);

  // The same unit with the calibration stored in it.
  unit.reported_nominal = false;
  for (const estimation::FreeParameter& one : found.calibration.free) {
    unit.reported.emplace_back(one.name, found.calibration.sensor.get(one.name));
  }
  unit.seed = 2;
  const auto again = record_and_calibrate(unit, arguments.folder / "corrected.lvx", "");
  fmt::print("after: {}\n{}\n", to_string(again.calibration.verdict.code),
             again.calibration.verdict.words);

  // A rotation that all beams share moves a cloud; the rest, the shape, bends it.
  fmt::print("{:16}{:>9}{:>9}{:>9}\n", "error, degree", "total", "shared", "shape");
  print_error("before", found.truth->before);
  print_error("after", found.truth->after);
  const bool right = verdict.code == calibration::CalibrationCode::bent &&
                     again.calibration.verdict.code == calibration::CalibrationCode::as_believed;
  return right ? 0 : 1;
}

int main(int argc, char** argv) { return run_example(argc, argv, calibrate_a_hall); }
