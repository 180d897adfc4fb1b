// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/cloud_of_recording.hpp"

#include <chrono>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "risley/cloud/map_projection.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/prepared_recording.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/checks.hpp"

namespace risley::jobs {
namespace {

/// The day on which a file was last changed, UTC: of a recording, mostly when it was made.
std::optional<std::chrono::sys_days> day_of(const recordings::Source& recording) {
  using namespace std::chrono;
  if (recording.recording()) return std::nullopt;
  std::error_code problem;
  const auto time = std::filesystem::last_write_time(recording.name(), problem);
  if (problem) return std::nullopt;
  return floor<days>(file_clock::to_sys(time));
}

/// Where the recording names its sensor, that has to be of the calibration's kind: to find it out
/// from the shots takes long.
void require_same_type(const recordings::Source& recording, const CloudOfRecordingOptions& options,
                       const sensors::Sensor& calibration, const Progress& progress) {
  const auto reader = recordings::open_recording(recording, options.reading, progress);
  for (const recordings::Device& device : reader->header().devices) {
    if (device.type == recordings::kUnknownDeviceType || device.type_inferred) continue;
    if (device.type == calibration.device_type) continue;
    throw EstimationError(
        fmt::format("{} is a recording of a {}, and {} describes another kind of sensor ({})",
                    options.recording.name(), recordings::device_type_name(device.type),
                    options.calibration, calibration.name));
  }
}

}  // namespace

RecordingCloud cloud_of_recording(const CloudOfRecordingOptions& options,
                                  const Progress& progress) {
  cloud::CloudOptions settings = options.cloud;
  if (settings.rate) require_positive(kSetting.rate, *settings.rate);
  if (settings.angle_noise) require_positive(kSetting.noise_angle, *settings.angle_noise);
  require_positive(kSetting.las_scale, settings.writer.las_scale);
  if (settings.loadings && !settings.pointing.covariance) {
    throw InvalidArgument(fmt::format("{} yes and {} no cannot be combined",
                                      name_of(kSetting.common_factors),
                                      name_of(kSetting.covariance)));
  }
  const sensors::Sensor calibration = load_result(options.calibration);
  cloud::find_cloud_format(options.output, settings.writer.format);  // before anything is read
  recordings::Source recording = options.recording.held_open();
  require_same_type(recording, options, calibration, progress);
  std::vector<recordings::Source> inputs{recording};
  if (moves(options.platform)) {
    if (!options.platform.crs.empty()) {  // before anything is read
      const std::string& datum = options.platform.datum;
      const cloud::MapProjection known(options.platform.crs, datum.empty() ? "EPSG:4979" : datum);
    }
    settings.platform = load_platform(options.platform, progress);
    for (const std::string& path : paths_of(options.platform)) inputs.push_back(path);
  }
  InputHashes hashes(inputs, progress);
  inputs.clear();
  settings.provenance = [&] {
    Provenance provenance = hashes.with_inputs(options.provenance);
    provenance.emplace_back("calibration", options.calibration);
    const std::string file = calibration_in(options.calibration).value_or(options.calibration);
    if (std::filesystem::is_regular_file(file)) {
      provenance.emplace_back("calibration_sha256", hashes::sha256_of_file(file));
    }
    return provenance;
  };
  if (!settings.writer.date) settings.writer.date = day_of(options.recording);
  PreparedRecording input =
      prepare_recording(std::exchange(recording, {}), options.reading,
                        {.sensor_frame = true, .sensor = calibration}, progress);
  input.close_questions();
  RecordingCloud result{
      options.recording.name(), options.output, options.calibration, calibration.reference,
      cloud::make_cloud(*input.reader, calibration, options.output, settings, progress)};
  std::vector<Warning> warnings = input.all_warnings();
  append(warnings, result.summary.warnings);
  result.summary.warnings = std::move(warnings);
  return result;
}

}  // namespace risley::jobs
