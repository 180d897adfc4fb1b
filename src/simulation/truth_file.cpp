// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/truth_file.hpp"

#include <filesystem>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/io/text_file.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/sensors/range_values.hpp"
#include "risley/simulation/trajectory_noise.hpp"
#include "risley/trajectories/trajectory_file.hpp"

namespace risley::simulation {
namespace {

/// Files that are removed unless everything succeeds.
class FilesInProgress {
 public:
  FilesInProgress() = default;
  FilesInProgress(const FilesInProgress&) = delete;
  FilesInProgress& operator=(const FilesInProgress&) = delete;
  ~FilesInProgress() {
    std::error_code ignored;
    for (const std::string& path : paths_) std::filesystem::remove(path, ignored);
  }
  void add(std::string path) { paths_.push_back(std::move(path)); }
  void keep() { paths_.clear(); }

 private:
  std::vector<std::string> paths_;
};

/// @return data that the format of the user's trajectory cannot hold
std::vector<std::string> write_platform(const SimulationSettings& settings, const std::string& path,
                                        FilesInProgress& files) {
  const Platform& platform = *settings.platform;
  const auto write = [&](const std::string& to, const trajectories::Trajectory& trajectory) {
    auto left_out = trajectories::write_trajectory(to, trajectory);
    files.add(to);
    return left_out;
  };
  write(truth_trajectory_path(path), *platform.trajectory);
  auto left_out =
      write(trajectory_path(path, platform.trajectory_ending),
            platform.errors ? with_errors(*platform.trajectory, *platform.errors, settings.seed)
                            : *platform.trajectory);
  io::write_text_file(truth_mount_path(path), trajectories::mount_text(platform.mount));
  files.add(truth_mount_path(path));
  if (!platform.strips.empty()) {
    io::write_text_file(strips_path(path), trajectories::strip_times_text(
                                               platform.strips, platform.trajectory->time_scale));
    files.add(strips_path(path));
  }
  return left_out;
}

}  // namespace

std::string truth_preset_path(const std::string& recording) { return recording + ".truth.yaml"; }
std::string truth_columns_path(const std::string& recording) { return recording + ".truth.nc"; }

std::string truth_trajectory_path(const std::string& recording) {
  return recording + ".trajectory.truth.csv";
}
std::string truth_mount_path(const std::string& recording) {
  return recording + ".mount.truth.yaml";
}
std::string strips_path(const std::string& recording) { return recording + ".strips.yaml"; }
std::string trajectory_path(const std::string& recording, const std::string& ending) {
  return recording + ".trajectory" + ending;
}

std::vector<std::string> simulation_files(const SimulationSettings& settings,
                                          const std::string& recording) {
  std::vector<std::string> files{recording, truth_preset_path(recording),
                                 truth_columns_path(recording)};
  if (!settings.platform) return files;
  files.push_back(truth_trajectory_path(recording));
  files.push_back(trajectory_path(recording, settings.platform->trajectory_ending));
  files.push_back(truth_mount_path(recording));
  if (!settings.platform->strips.empty()) files.push_back(strips_path(recording));
  return files;
}

sensors::Sensor truth_preset(const Scanner& scanner,
                             const std::vector<std::pair<std::string, std::string>>& provenance) {
  const SimulationSettings& settings = scanner.settings();
  sensors::Sensor truth = settings.truth;
  truth.provenance = provenance;
  const auto add = [&](std::string name, auto value) {
    truth.provenance.emplace_back(std::move(name), fmt::format("{}", value));
  };
  add("seed", settings.seed);
  add("observations", scanner.shots());
  add("duration_s", settings.duration);
  add("rate_hz", *settings.rate);
  add("noise_angle_deg", degrees_from_radians(*settings.angle_noise));
  add("noise_range_m", *settings.range_noise);
  add("quantize", settings.quantize ? "yes" : "no");
  add("rotor", to_string(settings.rotor));
  if (!settings.station.empty()) add("station", settings.station);
  if (settings.platform) {
    add("clock_at_first_shot_ns", first_clock_reading_ns(*settings.platform));
    add("clock_offset_s", settings.platform->mount.clock_offset.value);
    add("clock_drift_ppm", 1e6 * settings.platform->clock_drift);
  }
  for (std::size_t i = 0; i < scanner.start_angles().size(); ++i) {
    add(fmt::format("start_rotation_angle_{}_deg", prism_letter(static_cast<int>(i))),
        degrees_from_radians(scanner.start_angles()[i]));
  }
  if (settings.reported) {
    for (const ParameterInfo& info : parameter_list(truth.shape())) {
      if (info.kind != ParameterKind::train || info.places.size() > 1) continue;
      const double reported = settings.reported->train.get(info.name);
      if (reported != truth.train.get(info.name)) {
        add("reported " + info.name, reported / info.si_per_unit);
      }
    }
  }
  return truth;
}

SimulationResult simulate_to_file(
    const SimulationSettings& settings, const std::string& path,
    const std::vector<std::pair<std::string, std::string>>& provenance, const Progress& progress) {
  Scanner scanner(settings);
  const auto recording = recordings::create_recording(path, scanner.header(), {}, settings.writing);
  recordings::TruthWriter truth_columns(truth_columns_path(path), settings.truth.prisms());
  FilesInProgress beside;
  std::vector<std::string> left_out;
  if (settings.platform) left_out = write_platform(settings, path, beside);
  // While one chunk is written, the next is simulated.
  recordings::Chunk chunk, next_chunk;
  recordings::TruthColumns truth, next_truth;
  parallel::TaskGroup writing;
  while (scanner.read(next_chunk, next_truth)) {
    writing.wait();
    std::swap(chunk, next_chunk);
    std::swap(truth, next_truth);
    writing.run([&] { recording->write(chunk); });
    writing.run([&] { truth_columns.write(truth); });
    progress.report(static_cast<double>(scanner.shots_done()) /
                    static_cast<double>(scanner.shots()));
  }
  writing.wait();
  recording->close();
  truth_columns.close();
  SimulationResult result;
  result.observations = scanner.shots();
  result.no_return = scanner.no_return();
  result.truth = truth_preset(scanner, provenance);
  result.start_angles = scanner.start_angles();
  result.files = simulation_files(settings, path);
  result.truth_files = {truth_preset_path(path), truth_columns_path(path)};
  if (settings.platform) {
    result.truth_files.insert(result.truth_files.end(),
                              {truth_trajectory_path(path), truth_mount_path(path)});
    result.trajectory = trajectory_path(path, settings.platform->trajectory_ending);
    result.strips = settings.platform->strips;
  }
  result.left_out = std::move(left_out);
  io::write_text_file(truth_preset_path(path), sensors::preset_text(result.truth));
  beside.keep();
  return result;
}

std::vector<sensors::NamedValue> true_values(const SimulationResult& result) {
  std::vector<sensors::NamedValue> values = sensors::named_values(result.truth);
  for (const sensors::RangeValue& of_ranges :
       sensors::range_values(result.truth.train.emitters())) {
    const double value = sensors::get_range_value(result.truth, of_ranges.name);
    if (value != 0.0) values.push_back({of_ranges.name, value, of_ranges.unit});
  }
  for (std::size_t i = 0; i < result.start_angles.size(); ++i) {
    values.push_back({fmt::format("rotation_angle_{}_deg", prism_letter(static_cast<int>(i))),
                      degrees_from_radians(result.start_angles[i]), "deg"});
  }
  return values;
}

}  // namespace risley::simulation
