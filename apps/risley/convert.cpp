// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/convert_recording.hpp"
#include "risley/jobs/convert_trajectory.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "command.hpp"
#include "many_files.hpp"
#include "reading_options.hpp"
#include "recording_text.hpp"
#include "trajectory_text.hpp"

namespace risley::app {
namespace {

struct ConvertOptions {
  ManyWishes many;
  std::string output, format, sensor_type, accuracy, topic;
  ReadingWishes reading;
};

std::string recording_endings() {
  std::string text;
  for (const recordings::WritableFormat& format : recordings::writable_formats()) {
    text += fmt::format("\n  {:<18} {} ({})", format.ending, format.description, format.name);
  }
  text += "\nor, of a trajectory:";
  for (const trajectories::WritableTrajectory& format : trajectories::writable_trajectories()) {
    text += fmt::format("\n  {:<18} {} ({})", format.ending, format.description, format.name);
  }
  return text;
}

std::set<std::string> writable_format_names() {
  std::set<std::string> names;
  for (const auto& format : trajectories::writable_trajectories()) names.insert(format.name);
  for (const auto& format : recordings::writable_formats()) names.insert(format.name);
  return names;
}

/// Types of sensors by their names on the command line.
std::map<std::string, std::uint8_t> sensor_types() {
  std::map<std::string, std::uint8_t> types;
  for (const auto& type : recordings::kLivoxTypes)
    types[lower_case(std::string(type.name))] = type.number;
  return types;
}

/// Ending of a format's files in a folder.
std::string ending_of(const std::string& format) {
  for (const auto& known : recordings::writable_formats()) {
    if (known.name == format) return known.ending;
  }
  for (const auto& known : trajectories::writable_trajectories()) {
    if (known.name == format) return known.ending;
  }
  throw InvalidArgument("several files need --format, because -o is a folder");
}

FileOutcome convert_poses(const FileJob& job, const ConvertOptions& options,
                          const Progress& progress) {
  if (!options.sensor_type.empty()) {
    throw InvalidArgument(
        fmt::format("--sensor-type is for recordings, and {} is a trajectory", job.input));
  }
  require_no_reading_options(options.reading, "trajectories");
  const jobs::ConvertedTrajectory done = jobs::convert_trajectory(
      {job.input, job.output, options.format, options.accuracy, options.topic}, progress);
  log_warnings(job.input, done.warnings);
  for (const std::string& words : done.left_out) spdlog::warn("{}: {}", job.output, words);
  Json json = json::of(done);
  json.update({{"input", job.input}, {"output", job.output}});
  return {kDone, std::move(json), fmt::format("{}: {} records", job.output, grouped(done.records))};
}

/// Somebody who wants points has to take another verb.
void refuse_point_clouds(const std::string& output) {
  const std::string name = lower_case(output);
  const auto has_ending = [&name](const auto& format) { return name.ends_with(format.ending); };
  const auto& recordings = recordings::writable_formats();
  const auto& clouds = cloud::cloud_formats();
  if (std::any_of(recordings.begin(), recordings.end(), has_ending) ||
      std::none_of(clouds.begin(), clouds.end(), has_ending)) {
    return;
  }
  throw InvalidArgument(fmt::format(
      "{}: is a point cloud by its ending, and convert writes recordings; for points take: risley "
      "cloud RECORDING --calibration CALIBRATION -o {}",
      output, output));
}

FileOutcome convert(const FileJob& job, const ConvertOptions& options, const Progress& progress) {
  if (!options.topic.empty() || trajectories::trajectory_file_kind(job.input, progress.silent()) !=
                                    trajectories::TrajectoryFileKind::none) {
    return convert_poses(job, options, progress);
  }
  if (!options.accuracy.empty()) {
    throw InvalidArgument(
        fmt::format("--accuracy goes with a trajectory, and {} is none", job.input));
  }
  if (options.format.empty()) refuse_point_clouds(job.output);
  jobs::ConvertRecordingOptions wanted{job.input, read_options(options.reading, job), job.output,
                                       options.format, std::nullopt};
  if (!options.sensor_type.empty()) wanted.sensor_type = sensor_types().at(options.sensor_type);
  jobs::ConvertedRecording done = jobs::convert_recording(wanted, progress);
  log_warnings(job.input, done.warnings);
  const std::uint64_t written = done.observations - done.left_out;
  if (done.left_out > 0) {
    spdlog::warn("{}: {} of {} observations have no place in this format and were left out",
                 job.output, done.left_out, done.observations);
  }
  Json json = with_status(json::of(done), done.damage);
  json.update({{"input", job.input}, {"output", job.output}});
  if (done.damage) {
    spdlog::error("{}; the {} observations before it are saved in {}", done.damage->what(), written,
                  job.output);
  }
  return {done.damage ? kBadFile : kDone, std::move(json),
          fmt::format("{}: {} observations", job.output, grouped(written))};
}

}  // namespace

Run declare_convert(CLI::App& verb) {
  const auto options = std::make_shared<ConvertOptions>();
  add_many_options(verb, options->many,
                   "Recordings or trajectories of any known format, or ROS 2 bag folders (with "
                   "metadata.yaml)");
  verb.add_option(
          "-o,--output", options->output,
          "File to write, or a folder for several, which is made where it is missing and in "
          "which they are placed as the inputs are; the ending chooses the format:" +
              recording_endings())
      ->required();
  verb.add_option(
          "--format", options->format,
          "Format to write, whatever the ending; required for a folder (default: by the ending)")
      ->check(CLI::IsMember(writable_format_names()));
  std::set<std::string> type_names;
  for (const auto& [name, type] : sensor_types()) type_names.insert(name);
  verb.add_option("--sensor-type", options->sensor_type,
                  "Type of the sensor, which LVX files state (default: from the recording)")
      ->check(CLI::IsMember(type_names));
  verb.add_option("--accuracy", options->accuracy,
                  "Accuracies (SMRMSG file) to store with the records of a trajectory")
      ->type_name("FILE");
  verb.add_option("--trajectory-topic", options->topic,
                  "Convert a ROS bag as a trajectory: the poses of this topic")
      ->type_name("NAME");
  add_reading_options(verb, options->reading);
  add_every_device(verb, options->reading);
  return [options, &verb](const CommonOptions& common) {
    const bool folder = output_is_folder(options->many, options->output);
    FileJobs files =
        file_jobs(options->many, options->output, folder, folder ? ending_of(options->format) : "");
    read_options(options->reading);  // wrong options are told before anything is read
    split_by_device(options->reading, files);
    FileWork work;
    work.label = "converting";
    work.counted = "observations";
    work.run = [&](const FileJob& job, const Progress& progress) {
      return convert(job, *options, progress);
    };
    return run_file_jobs(files, work, options->many, verb, common);
  };
}

}  // namespace risley::app
