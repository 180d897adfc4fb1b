// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/calibrate_recordings.hpp"

#include <filesystem>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"

#include "jobs/checks.hpp"
#include "jobs/result_folder.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

using calibration::RangedRecording;

/// Each recording stands for observations of its own.
void check_recordings(const std::vector<std::string>& recordings) {
  if (recordings.empty()) throw InvalidArgument("option recordings is empty, expected one or more");
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      std::error_code ignored;
      if (std::filesystem::equivalent(recordings[i], recordings[j], ignored)) {
        throw InvalidArgument(fmt::format("{} is given twice", recordings[i]));
      }
    }
  }
}

/// Wrong wishes are told before an hour of reading.
calibration::CalibrationOptions checked_settings(const CalibrateRecordingsOptions& options) {
  if (options.rate) check_positive(*options.rate, "rate", "Hz");
  if (options.angle_noise) check_positive(*options.angle_noise, "angle_noise", "rad");
  if (options.range_noise) check_positive(*options.range_noise, "range_noise", "m");
  if (options.prior_sigma) check_positive(*options.prior_sigma, "prior_sigma", "rad");
  check_not_negative(options.range_offset_sigma, "range_offset_sigma", "m");
  if (options.method == calibration::CalibrationMethod::paper &&
      (options.planes || !options.stations.empty() || options.prior_sigma)) {
    throw InvalidArgument(
        "option method paper knows no option planes, option stations and option prior_sigma: its "
        "walls are all it has");
  }
  if (!options.truths.empty()) check_truths(options.truths, options.recordings.size());
  check_recordings(options.recordings);
  calibration::CalibrationOptions result;
  result.method = options.method;
  result.additional = options.additional;
  result.fixed = options.fixed;
  result.range_noise = options.range_noise;
  result.prior_sigma = options.prior_sigma;
  result.range_offset_sigma = options.range_offset_sigma;
  result.beam_origin = options.beam_origin;
  result.planes = options.planes;
  result.stations = options.stations;
  result.seed = options.seed;
  return result;
}

/// "states.nc", or "states_2.nc" for the second of several recordings.
std::string states_name(const CalibrateRecordingsOptions& options, std::size_t recording) {
  return options.recordings.size() == 1 ? "states.nc" : fmt::format("states_{}.nc", recording + 1);
}

/// Reads one recording and finds its rotation angles.
RangedRecording read_and_estimate(const CalibrateRecordingsOptions& options, std::size_t number,
                                  ResultFolder& folder, CalibratedRecordings& result,
                                  const Progress& progress) {
  const std::string& path = options.recordings[number];
  EstimationInput input =
      read_for_estimation({path,
                           options.reading,
                           options.sensor,
                           {.rate = options.rate, .ranges = true, .rows = false}},
                          progress.stage("reading"));
  result.reading_time += input.reading_time;
  result.observations += input.recording.audit.observations;
  if (!input.recording.header.has_range) {
    throw EstimationError(
        fmt::format("{} holds no ranges: there is nothing to calibrate on", path));
  }
  estimation::EstimateOptions settings;
  settings.sensor = input.choice.sensor;
  settings.angle_noise = options.angle_noise;
  settings.cartesian = input.whole_steps;
  settings.mirrored = options.mirrored;
  if (number == 0) {
    result.nominal = settings.sensor;
    result.choice = input.choice;
  }
  for (const std::string& text : input.warnings) {
    result.warnings.push_back(fmt::format("{}: {}", path, text));
  }
  const Stopwatch watch;
  const Progress angles =
      progress.stage(fmt::format("rotation angles {}/{}", number + 1, options.recordings.size()));
  const estimation::Estimate estimate = [&] {
    try {
      return estimation::estimate(estimation::Method::map, std::move(input.series), input.head,
                                  settings, angles);
    } catch (const EstimationError& error) {
      throw EstimationError(fmt::format("{}: {}", path, error.what()));
    }
  }();
  for (const std::string& text : estimate.warnings) {
    result.warnings.push_back(fmt::format("{}: {}", path, text));
  }
  RangedRecording recording =
      calibration::ranged_recording(estimate, path, input.recording.serial());
  if (folder && options.files.states != StatesRows::none) {
    folder.add_states(states_name(options, number), estimate, options.files.states,
                      with_inputs(options.files.provenance, {path}, angles), angles);
  }
  result.recordings.push_back(std::move(input.recording));
  result.angles_time += watch.seconds();
  return recording;
}

/// calibration.yaml; what did not converge is no calibration, nor what is not better.
void write_files(const CalibrateRecordingsOptions& options, CalibratedRecordings& result,
                 ResultFolder& folder, const Progress& progress) {
  result.provenance = with_inputs(options.files.provenance, options.recordings, progress);
  result.provenance.emplace_back("datum", calibration::to_string(result.calibration.datum_kind));
  const bool better = result.calibration.verdict.code != calibration::CalibrationCode::not_better;
  if (result.calibration.converged && (better || options.force)) {
    sensors::Sensor calibrated = result.calibration.sensor;
    calibrated.provenance = result.provenance;
    folder.add_calibration(calibrated);
  }
  if (options.texts) {
    for (const NamedText& text : options.texts(result)) folder.add_text(text);
  }
  progress.check();
  for (std::string& text : folder.commit()) result.warnings.push_back(std::move(text));
}

}  // namespace

CalibratedRecordings calibrate_recordings(const CalibrateRecordingsOptions& options,
                                          const Progress& progress) {
  calibration::CalibrationOptions settings = checked_settings(options);
  ResultFolder folder(options.files.folder);
  CalibratedRecordings result;
  std::vector<RangedRecording> recordings;
  for (std::size_t r = 0; r < options.recordings.size(); ++r) {
    recordings.push_back(read_and_estimate(options, r, folder, result, progress));
  }
  settings.sensor = result.nominal;
  for (const auto& [name, value] : settings.fixed) {
    if (value) check_bounds(find_parameter(name, settings.sensor.shape()), *value);
  }
  const Stopwatch watch;
  const Progress calibrating = progress.stage("calibrating");
  result.calibration = calibration::calibrate(recordings, settings, calibrating);
  result.solving_time = watch.seconds();
  if (!options.truths.empty()) {
    result.truth =
        compare_beams(recordings, result.calibration, options.truths, calibrating.silent());
  }
  if (options.details) {
    result.details = calibration_details(result.calibration, options.recordings.size(),
                                         wall_sample(recordings, result.calibration), result.truth);
  }
  if (folder) write_files(options, result, folder, progress.silent());
  return result;
}

}  // namespace risley::jobs
