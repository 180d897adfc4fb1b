// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/cloud_of_recording.hpp"

#include <chrono>
#include <filesystem>
#include <optional>
#include <system_error>

#include "risley/core/error.hpp"
#include "risley/io/sha256.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/jobs/recording_input.hpp"
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

}  // namespace

RecordingCloud cloud_of_recording(const CloudOfRecordingOptions& options,
                                  const Progress& progress) {
  cloud::CloudOptions settings = options.cloud;
  if (settings.rate) check_positive(*settings.rate, "rate", "Hz");
  if (settings.angle_noise) check_positive(*settings.angle_noise, "angle_noise", "rad");
  check_positive(settings.writer.las_scale, "las_scale", "m");
  if (settings.loadings && !settings.pointing.covariance) {
    throw InvalidArgument("option common_factors yes and option covariance no cannot be combined");
  }
  const sensors::Sensor calibration = sensors::load_sensor(options.calibration);
  cloud::find_cloud_format(options.output, settings.writer.format);  // before anything is read
  std::vector<recordings::Source> inputs{options.recording};
  if (moves(options.platform)) {
    settings.platform = load_platform(options.platform, progress);
    for (const std::string& path : paths_of(options.platform)) inputs.push_back(path);
  }
  InputHashes hashes(inputs, progress);
  settings.provenance = [&] {
    Provenance provenance = hashes.with_inputs(options.provenance);
    provenance.emplace_back("calibration", options.calibration);
    if (std::filesystem::is_regular_file(options.calibration)) {
      provenance.emplace_back("calibration_sha256", io::sha256_of_file(options.calibration));
    }
    return provenance;
  };
  if (!settings.writer.date) settings.writer.date = day_of(options.recording);
  const SensorFrameRecording input =
      open_in_sensor_frame(options.recording, options.reading, calibration, progress);
  RecordingCloud result{
      options.recording.name(), options.output, options.calibration, calibration.reference,
      cloud::make_cloud(*input.reader, calibration, options.output, settings, progress)};
  std::vector<std::string>& warnings = result.summary.warnings;
  warnings.insert(warnings.begin(), input.warnings.begin(), input.warnings.end());
  return result;
}

}  // namespace risley::jobs
