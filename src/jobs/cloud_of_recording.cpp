// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/cloud_of_recording.hpp"

#include <chrono>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "risley/bags/bag_writer.hpp"
#include "risley/cloud/map_projection.hpp"
#include "risley/cloud/rectified_bag.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/prepared_recording.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "jobs/checks.hpp"
#include "jobs/cloud_inputs.hpp"

namespace risley::jobs {
namespace {

/// Checks the map before reading anything. @return an invalid system, for which a place gives
/// advice
std::optional<cloud::GeographicSystem> require_map(const PlatformFiles& files) {
  if (files.crs.empty()) return std::nullopt;
  try {
    const cloud::MapProjection known(files.crs, files.datum.empty() ? "EPSG:4979" : files.datum);
  } catch (const cloud::GeographicSystem& system) {
    return system;
  }
  return std::nullopt;
}

[[noreturn]] void refuse_at(const cloud::GeographicSystem& system,
                            const trajectories::Trajectory& trajectory) {
  if (trajectory.frame != trajectories::Frame::geocentric) throw system;
  const trajectories::Geodetic place =
      trajectories::geodetic_from_geocentric(trajectory.position.front());
  throw system.at(place.latitude, place.longitude);
}

/// If the recording names its sensor, that must be of the calibration's kind: recognising it from
/// the shots takes long.
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

/// The kind of bag in which a topic is replaced. @throws InvalidArgument if nothing is replaced
/// this way
bags::BagKind kind_for_replacing(const CloudOfRecordingOptions& options) {
  const std::string& format = options.cloud.writer.format;
  const auto refuse = [](const std::string& why) {
    throw InvalidArgument(fmt::format("{}: {}", name_of(kSetting.replace), why));
  };
  if (moves(options.platform)) {
    refuse("points stay in the frame of the sensor, and a trajectory moves them out of it");
  }
  if (options.calibration.empty()) {
    refuse(
        fmt::format("points in calibrated directions need a calibration: {} names one or a preset",
                    name_of(kSetting.calibration)));
  }
  if (options.reading.extrinsics) {
    refuse(fmt::format("points stay in the frame of their bag, and {} turns them",
                       name_of(kSetting.extrinsics)));
  }
  std::optional<bags::BagKind> kind = bags::bag_kind_of_name(options.output);
  for (const auto one : {bags::BagKind::ros1, bags::BagKind::ros2, bags::BagKind::mcap}) {
    if (format == bags::name_of(one)) kind = one;
  }
  if (!kind || (!format.empty() && format != bags::name_of(*kind))) {
    refuse("writes bags, allowed .mcap, .bag and .db3");
  }
  return *kind;
}

/// What points are made of.
struct Ingredients {
  recordings::Source recording;                ///< held open
  std::optional<sensors::Sensor> calibration;  ///< none is given until the recording is prepared
  PlatformFiles platform;
  cloud::CloudOptions settings;
  std::vector<Warning> warnings = {};
};

/// A calibration in flight leaves a folder with its mount and trajectory, which are the defaults.
PlatformFiles with_results(PlatformFiles platform, const GivenSensor& calibration) {
  namespace fs = std::filesystem;
  const fs::path folder = calibration.path();
  std::error_code ignored;
  const auto take = [&](auto& given, const char* name) {
    const fs::path file = folder / name;
    if (given.empty() && fs::is_regular_file(file, ignored)) given = file.string();
  };
  if (!fs::is_directory(folder, ignored) || !fs::is_regular_file(folder / "mount.yaml", ignored)) {
    return platform;
  }
  take(platform.mount, "mount.yaml");
  take(platform.trajectory, "trajectory.csv");
  return platform;
}

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
  Ingredients of{{}, {}, options.platform, std::move(settings)};
  if (!options.cloud.standing) of.platform = with_results(of.platform, options.calibration);
  if (!options.calibration.empty()) of.calibration = load_result(options.calibration);
  of.recording = options.recording.held_open();
  if (of.calibration) require_same_type(of.recording, options, *of.calibration, progress);
  if (moves(of.platform)) {
    const std::optional<cloud::GeographicSystem> unusable = require_map(of.platform);
    of.settings.platform = load_platform(of.platform, progress);
    if (unusable) refuse_at(*unusable, of.settings.platform->trajectory);
  }
  return of;
}

PreparedRecording prepare(Ingredients& of, const recordings::ReadOptions& reading,
                          const Progress& progress) {
  PreparedRecording input =
      prepare_recording(std::exchange(of.recording, {}), reading,
                        {.sensor_frame = true, .sensor = of.calibration}, progress);
  if (!of.calibration) {
    const SensorChoice& choice = input.choose({}, progress);
    require_possible(choice, input.source.name());
    of.calibration = choice.sensor;
    of.settings.pointing.reported_directions = true;
    warn(of.warnings, kWarning.calibration_assumed,
         "no calibration was given: points are where the sensor reports them, with the sigmas of "
         "the preset {} ({}); {} names a calibration, and a preset for smoothed directions",
         choice.sensor.name, choice.words, name_of(kSetting.calibration));
  }
  input.close_questions();
  return input;
}

RecordingCloud result_of(const CloudOfRecordingOptions& options, const Ingredients& of,
                         const PreparedRecording& input, cloud::CloudSummary summary) {
  std::vector<Warning> warnings = input.all_warnings();
  append(warnings, of.warnings);
  append(warnings, summary.warnings);
  summary.warnings = std::move(warnings);
  return {options.recording.name(), options.output,
          options.calibration.empty() ? of.calibration->name : options.calibration.name(),
          of.calibration->reference, std::move(summary)};
}

}  // namespace

std::optional<std::chrono::sys_days> day_of(const recordings::Source& recording) {
  using namespace std::chrono;
  if (recording.recording()) return std::nullopt;
  std::error_code problem;
  const auto time = std::filesystem::last_write_time(recording.name(), problem);
  if (problem) return std::nullopt;
  return floor<days>(file_clock::to_sys(time));
}

Provenance provenance_of_cloud(InputHashes& hashes, const Provenance& provenance,
                               const GivenSensor& calibration) {
  Provenance all = hashes.with_inputs(provenance);
  if (calibration.empty()) return all;
  all.emplace_back("calibration", calibration.name());
  const std::string path = calibration.path();
  const std::string file = calibration_in(path).value_or(path);
  if (std::filesystem::is_regular_file(file)) {
    all.emplace_back("calibration_sha256", hashes::sha256_of_file(file));
  }
  return all;
}

struct PointsOfRecording::State {
  CloudOfRecordingOptions options;
  Ingredients of;
  PreparedRecording input;
  cloud::CloudMaker maker;

  State(const CloudOfRecordingOptions& wanted, cloud::CloudSink sink, const Progress& progress)
      : options(wanted),
        of(gather(options, progress)),
        input(prepare(of, options.reading, progress)),
        maker(*input.reader, *of.calibration, std::move(sink), of.settings, progress) {}
};

PointsOfRecording::PointsOfRecording(const CloudOfRecordingOptions& options, cloud::CloudSink sink,
                                     const Progress& progress)
    : state_(std::make_unique<State>(options, std::move(sink), progress)) {}
PointsOfRecording::~PointsOfRecording() = default;

bool PointsOfRecording::next() { return state_->maker.next(); }

RecordingCloud PointsOfRecording::result() const {
  const State& s = *state_;
  return result_of(s.options, s.of, s.input, s.maker.summary());
}

namespace {

/// A bag whose points must be read in their stored order: otherwise they would get each other's
/// coordinates.
class BagInOrder final : public cloud::CloudWriter {
 public:
  BagInOrder(std::unique_ptr<cloud::RectifiedBag> bag, const PreparedRecording& input)
      : bag_(std::move(bag)), input_(input) {}

  void write(const cloud::Points& points) override { bag_->write(points); }
  void close() override {
    for (const Warning& warning : input_.reader->warnings()) {
      if (warning.code == kWarning.rows_sorted) {
        throw InvalidArgument(fmt::format("{}: {}", name_of(kSetting.replace), warning.message));
      }
    }
    bag_->close();
  }

 private:
  std::unique_ptr<cloud::RectifiedBag> bag_;
  const PreparedRecording& input_;
};

/// Rewrites the recording's bag with rectified points.
cloud::CloudSummary rectify_bag(const CloudOfRecordingOptions& options, bags::BagKind kind,
                                Ingredients& of, const PreparedRecording& input,
                                const Progress& progress) {
  if (input.turned_back || input.cut_mended) {
    throw InvalidArgument(
        fmt::format("{}: the points of {} were moved from where the sensor reports them ({})",
                    name_of(kSetting.replace), options.recording.name(),
                    input.warnings.empty() ? "its pose" : input.warnings.back().message));
  }
  of.settings.rows = true;
  of.settings.pointing.covariance = of.settings.loadings = of.settings.own_covariance = false;
  const std::string topic = input.reader->header().devices.front().topic;
  if (topic.empty()) {
    throw InvalidArgument(
        fmt::format("{}: {} is no bag", name_of(kSetting.replace), options.recording.name()));
  }
  cloud::RectifiedBag* bag = nullptr;
  cloud::CloudMaker maker(
      *input.reader, *of.calibration,
      [&](const cloud::CloudHeader&) {
        auto made = std::make_unique<cloud::RectifiedBag>(options.recording.name(), topic,
                                                          options.output, kind, progress);
        bag = made.get();
        return std::make_unique<BagInOrder>(std::move(made), input);
      },
      of.settings, progress);
  while (maker.next()) {
  }
  cloud::CloudSummary summary = maker.summary();
  summary.format = bags::name_of(kind);
  if (bag != nullptr && bag->damage() && !summary.damage) summary.damage = bag->damage();
  return summary;
}

}  // namespace

RecordingCloud cloud_of_recording(const CloudOfRecordingOptions& options,
                                  const Progress& progress) {
  std::optional<bags::BagKind> replaced_in;
  if (options.replace) replaced_in = kind_for_replacing(options);
  cloud::find_cloud_format(options.output, options.cloud.writer.format);  // before anything is read
  Ingredients of = gather(options, progress);
  if (replaced_in) {  // which cannot hold its provenance
    const PreparedRecording input = prepare(of, options.reading, progress);
    return result_of(options, of, input, rectify_bag(options, *replaced_in, of, input, progress));
  }
  std::vector<recordings::Source> inputs{of.recording};
  for (const std::string& path : paths_of(of.platform)) inputs.push_back(path);
  InputHashes hashes(inputs, progress);
  inputs.clear();
  of.settings.provenance = [&] {
    return provenance_of_cloud(
        hashes, options.provenance,
        options.calibration.empty() ? GivenSensor(of.calibration->name) : options.calibration);
  };
  if (!of.settings.writer.date) of.settings.writer.date = day_of(options.recording);
  const PreparedRecording input = prepare(of, options.reading, progress);
  return result_of(
      options, of, input,
      cloud::make_cloud(*input.reader, *of.calibration, options.output, of.settings, progress));
}

}  // namespace risley::jobs
