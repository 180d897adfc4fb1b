// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include <fmt/format.h>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/recordings/writer.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "command.hpp"
#include "many_files.hpp"
#include "message_options.hpp"
#include "reading_options.hpp"

namespace risley::app {
namespace {

struct ConvertOptions {
  jobs::ManyInputsOptions many;
  std::string format, sensor_type, accuracy, topic;
  ReadingWishes reading;
  MessageWishes messages;
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

/// Points are written by another verb.
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

json::ConvertEachOptions settings_of(const ConvertOptions& options) {
  json::ConvertEachOptions settings;
  settings.reading = read_options(options.reading);
  settings.accuracy = options.accuracy;
  settings.topic = options.topic;
  settings.format = options.format;
  settings.writing.messages = message_options(options.messages);
  if (!options.sensor_type.empty()) settings.sensor_type = sensor_types().at(options.sensor_type);
  return settings;
}

}  // namespace

Run declare_convert(CLI::App& verb) {
  const auto options = std::make_shared<ConvertOptions>();
  add_many_options(verb, options->many,
                   "Recordings or trajectories of any known format, or ROS 2 bag folders (with "
                   "metadata.yaml)");
  verb.add_option("-o,--output", options->many.output,
                  "File to write, or a folder for several; the ending chooses the format:" +
                      recording_endings())
      ->required();
  verb.add_option(
          "--format", options->format,
          "Format to write, whatever the ending; required for a folder (default: by the ending)")
      ->check(CLI::IsMember(writable_format_names()));
  std::set<std::string> type_names;
  for (const auto& [name, type] : sensor_types()) type_names.insert(name);
  verb.add_option("--sensor-type", options->sensor_type,
                  "Type of the sensor to state in an LVX file (default: from the recording)")
      ->check(CLI::IsMember(type_names));
  verb.add_option("--accuracy", options->accuracy,
                  "Accuracies (SMRMSG file) to store with the records of a trajectory")
      ->type_name("FILE");
  verb.add_option("--trajectory-topic", options->topic,
                  "Read a ROS bag as a trajectory: the poses of this topic")
      ->type_name("NAME");
  add_reading_options(verb, options->reading);
  add_every_device(verb, options->reading);
  add_message_options(verb, options->messages, "custom");
  return [options, &verb](const CommonOptions& common) {
    jobs::ManyInputsOptions& many = options->many;
    many.into_folder = output_is_folder(many);
    if (options->format.empty()) refuse_point_clouds(many.output);
    const jobs::InputWork work = json::convert_each(settings_of(*options), log_words);
    jobs::InputPlan plan = jobs::plan_inputs(many, work, cancellable());
    split_by_device(options->reading, plan);
    return run_inputs(plan, work, many, verb, common);
  };
}

}  // namespace risley::app
