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
                    options.calibration.name(), calibration.name));
  }
}

/// What points are made of.
struct Ingredients {
  recordings::Source recording;  ///< held open
  sensors::Sensor calibration;
  cloud::CloudOptions settings;
};

Ingredients gather(const CloudOfRecordingOptions& options, const Progress& progress) {
  cloud::CloudOptions settings = options.cloud;
  if (settings.rate) require_positive(kSetting.rate, *settings.rate);
  if (settings.angle_noise) require_positive(kSetting.noise_angle, *settings.angle_noise);
  require_positive(kSetting.las_scale, settings.writer.las_scale);
  if (settings.loadings && !settings.pointing.covariance) {
    throw InvalidArgument(fmt::format("{} yes and {} no cannot be combined",
                                      name_of(kSetting.common_factors),
                                      name_of(kSetting.covariance)));
  }
  sensors::Sensor calibration = load_result(options.calibration);
  recordings::Source recording = options.recording.held_open();
  require_same_type(recording, options, calibration, progress);
  if (moves(options.platform)) {
    if (!options.platform.crs.empty()) {  // before anything is read
      const std::string& datum = options.platform.datum;
      const cloud::MapProjection known(options.platform.crs, datum.empty() ? "EPSG:4979" : datum);
    }
    settings.platform = load_platform(options.platform, progress);
  }
  return {std::move(recording), std::move(calibration), std::move(settings)};
}

PreparedRecording prepare(Ingredients& of, const recordings::ReadOptions& reading,
                          const Progress& progress) {
  PreparedRecording input =
      prepare_recording(std::exchange(of.recording, {}), reading,
                        {.sensor_frame = true, .sensor = of.calibration}, progress);
  input.close_questions();
  return input;
}

RecordingCloud result_of(const CloudOfRecordingOptions& options, const sensors::Sensor& calibration,
                         const PreparedRecording& input, cloud::CloudSummary summary) {
  std::vector<Warning> warnings = input.all_warnings();
  append(warnings, summary.warnings);
  summary.warnings = std::move(warnings);
  return {options.recording.name(), options.output, options.calibration.name(),
          calibration.reference, std::move(summary)};
}

}  // namespace

struct PointsOfRecording::State {
  CloudOfRecordingOptions options;
  Ingredients of;
  PreparedRecording input;
  cloud::CloudMaker maker;

  State(const CloudOfRecordingOptions& wanted, cloud::CloudSink sink, const Progress& progress)
      : options(wanted),
        of(gather(options, progress)),
        input(prepare(of, options.reading, progress)),
        maker(*input.reader, of.calibration, std::move(sink), of.settings, progress) {}
};

PointsOfRecording::PointsOfRecording(const CloudOfRecordingOptions& options, cloud::CloudSink sink,
                                     const Progress& progress)
    : state_(std::make_unique<State>(options, std::move(sink), progress)) {}
PointsOfRecording::~PointsOfRecording() = default;

bool PointsOfRecording::next() { return state_->maker.next(); }

RecordingCloud PointsOfRecording::result() const {
  const State& s = *state_;
  return result_of(s.options, s.of.calibration, s.input, s.maker.summary());
}

RecordingCloud cloud_of_recording(const CloudOfRecordingOptions& options,
                                  const Progress& progress) {
  cloud::find_cloud_format(options.output, options.cloud.writer.format);  // before anything is read
  Ingredients of = gather(options, progress);
  std::vector<recordings::Source> inputs{of.recording};
  for (const std::string& path : paths_of(options.platform)) inputs.push_back(path);
  InputHashes hashes(inputs, progress);
  inputs.clear();
  of.settings.provenance = [&] {
    Provenance provenance = hashes.with_inputs(options.provenance);
    provenance.emplace_back("calibration", options.calibration.name());
    const std::string path = options.calibration.path();
    const std::string file = calibration_in(path).value_or(path);
    if (std::filesystem::is_regular_file(file)) {
      provenance.emplace_back("calibration_sha256", hashes::sha256_of_file(file));
    }
    return provenance;
  };
  if (!of.settings.writer.date) of.settings.writer.date = day_of(options.recording);
  const PreparedRecording input = prepare(of, options.reading, progress);
  return result_of(
      options, of.calibration, input,
      cloud::make_cloud(*input.reader, of.calibration, options.output, of.settings, progress));
}

}  // namespace risley::jobs
