// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/calibrate_recordings.hpp"

#include <optional>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/jobs/result_folder.hpp"

#include "jobs/checks.hpp"
#include "jobs/ranged_input.hpp"
#include "jobs/stopwatch.hpp"

namespace risley::jobs {
namespace {

using calibration::RangedRecording;

calibration::CalibrationOptions settings_of(const CalibrateRecordingsOptions& options) {
  calibration::CalibrationOptions result;
  result.method = options.method;
  result.additional = options.additional;
  result.fixed = options.fixed;
  result.range_noise = options.range_noise;
  result.prior_sigma = options.prior_sigma;
  result.range_offset_sigma = options.range_offset_sigma;
  result.tolerance = options.tolerance;
  result.same_walls = options.same_walls;
  if (options.flat_walls) result.shape = {};
  result.patch_thickness = options.patch_thickness;
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

/// calibration.yaml, unless the sensor's own parameters are as good or better.
void write_files(const CalibrateRecordingsOptions& options, CalibratedRecordings& result,
                 ResultFolder& folder, InputHashes& hashes, const Progress& progress) {
  result.provenance = hashes.with_inputs(options.files.provenance);
  result.provenance.emplace_back("datum", calibration::to_string(result.calibration.datum_kind));
  const bool better = calibration::improves(result.calibration.verdict.code);
  if (result.calibration.converged && (better || options.force)) {
    result.calibration_written = true;
    sensors::Sensor calibrated = result.calibration.sensor;
    calibrated.provenance = result.provenance;
    folder.add_calibration(calibrated);
  }
  if (options.texts) {
    for (const NamedText& text : options.texts(result)) folder.add_text(text);
  }
  progress.check();
  append(result.warnings, folder.commit());
}

}  // namespace

void check(const CalibrateRecordingsOptions& options) {
  check_ranged_input(options);
  if (options.range_noise) require_positive(kSetting.noise_range, *options.range_noise);
  if (options.prior_sigma) require_positive(kSetting.prior_sigma, *options.prior_sigma);
  require_not_negative(kSetting.range_offset_sigma, options.range_offset_sigma);
  require_not_negative(kSetting.patch_thickness, options.patch_thickness);
  if (options.tolerance) require_not_negative(kSetting.tolerance, *options.tolerance);
  if (options.method == calibration::CalibrationMethod::paper &&
      (options.planes || !options.stations.empty() || options.prior_sigma)) {
    throw InvalidArgument(fmt::format(
        "{} paper cannot be combined with {}, {} or {}: it uses only the walls of the recordings",
        name_of(kSetting.method), name_of(kSetting.planes), name_of(kSetting.stations),
        name_of(kSetting.prior_sigma)));
  }
  if (options.same_walls == calibration::SameWalls::yes && options.recordings.size() < 2) {
    throw InvalidArgument(
        fmt::format("{} needs two recordings or more, found 1", name_of(kSetting.same_walls)));
  }
  if (!options.truths.empty()) check_truths(options.truths, options.recordings.size());
}

std::vector<scenes::Station> stations_of(const std::string& path,
                                         const std::vector<std::string>& names,
                                         std::size_t recordings) {
  if (path.empty()) {
    if (!names.empty())
      throw InvalidArgument(
          fmt::format("{} needs {}", name_of(kSetting.station), name_of(kSetting.stations)));
    return {};
  }
  const scenes::Scene scene = scenes::load_scene(path);
  std::vector<scenes::Station> stations;
  stations.reserve(names.size());
  for (const std::string& name : names) stations.push_back(scene.station(name));
  if (names.empty()) stations = scene.stations;
  if (stations.size() != recordings) {
    throw InvalidArgument(
        fmt::format("{} stations for {} recordings: {} must list one per recording, in their "
                    "order, or name them with {}",
                    stations.size(), recordings, path, name_of(kSetting.station)));
  }
  return stations;
}

CalibratedRecordings calibrate_recordings(const CalibrateRecordingsOptions& options,
                                          const Progress& progress) {
  const Stopwatch whole;
  check(options);
  calibration::CalibrationOptions settings = settings_of(options);
  ResultFolder folder(options.files.folder);
  std::optional<InputHashes> hashes;
  std::vector<recordings::Source> sources = held_open(options.recordings);
  if (folder) hashes.emplace(sources, progress);
  CalibratedRecordings result;
  std::vector<RangedRecording> recordings;
  for (std::size_t r = 0; r < options.recordings.size(); ++r) {
    const auto states = [&](const estimation::Estimate& estimate, const Progress& own) {
      folder.add_states(states_name(options, r), estimate, options.files.states,
                        hashes->with_input(options.files.provenance, r), own);
    };
    recordings.push_back(read_ranged(std::move(sources[r]), options, r, result, progress,
                                     folder && options.files.states != StatesRows::none
                                         ? EstimateTaker(states)
                                         : EstimateTaker()));
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
  if (folder) write_files(options, result, folder, *hashes, progress.silent());
  result.total_time = whole.seconds();
  return result;
}

}  // namespace risley::jobs
