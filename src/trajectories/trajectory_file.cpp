// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/trajectory_file.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/io/file_head.hpp"

#include "trajectories/formats/format.hpp"
#include "trajectories/formats/ros_bag.hpp"

namespace risley::trajectories {
namespace {

/// In the order in which they are tried.
const std::vector<const Format*>& formats() {
  static const std::vector<const Format*> all{
      &kInertialExplorerFormat,
      &kPospacFormat,
      &kRtklibFormat,
      &kNamedCsvFormat,
      &kOpenmmsFormat,
      &kTumFormat,
      &kKittiFormat,
      &kRosBagFormat,
      &kSbetFormat,
  };
  return all;
}

std::string known_formats() {
  std::string names;
  for (const Format* format : formats()) {
    if (format == &kRtklibFormat || format == &kKittiFormat) continue;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", format->name);
  }
  return names;
}

/// @throws FileError for a path that is not a file
FileHead read_file_head(const std::string& path) {
  namespace fs = std::filesystem;
  std::error_code code;
  if (fs::is_directory(path, code)) {
    FileHead head = read_file_head(bags::files_of_bag_folder(path).front());
    if (kRosBagFormat.recognises(head)) return head;
    throw FileError(path, {}, "is a folder whose first file is not a ROS 2 bag");
  }
  FileHead head;
  const io::InputFile file(path, "a trajectory");
  head.bytes = io::read_file_head(file, kHeadBytes);
  head.name = lower_case(fs::path(path).filename().string());
  head.size = file.size();
  return head;
}

const Format* format_of(const FileHead& head) {
  if (head.has_ending(".smrmsg")) return nullptr;
  for (const Format* format : formats()) {
    if (format->recognises(head)) return format;
  }
  return nullptr;
}

}  // namespace

TrajectoryFileKind trajectory_file_kind(const std::string& path, const Progress& progress) {
  try {
    const FileHead head = read_file_head(path);
    if (head.bytes.empty()) return TrajectoryFileKind::none;
    const Format* const format = format_of(head);
    if (format == &kRosBagFormat && !holds_poses_alone(path, progress))
      return TrajectoryFileKind::none;
    if (format != nullptr) return TrajectoryFileKind::trajectory;
    return is_smrmsg(head) ? TrajectoryFileKind::accuracies : TrajectoryFileKind::none;
  } catch (const FileError&) {
    return TrajectoryFileKind::none;
  }
}

Trajectory load_trajectory(const std::string& path, const Progress& progress,
                           const std::string& topic) {
  const FileHead head = read_file_head(path);
  if (head.bytes.empty()) {
    throw FileError(path, {0, {}},
                    fmt::format("is empty, expected a trajectory ({})", known_formats()));
  }
  const Format* format = format_of(head);
  if (format == &kRosBagFormat) return read_ros_bag(path, topic, progress);
  if (!topic.empty()) {
    throw InvalidArgument(fmt::format("{} = {}: {} is not a ROS bag, and only bags have topics",
                                      name_of(kSetting.trajectory_topic), topic, path));
  }
  if (format != nullptr) return format->read(path, progress);
  if (is_smrmsg(head)) {
    throw FileError(path, {},
                    "holds accuracies (SMRMSG) and no poses; expected the SBET that belongs to it");
  }
  if (head.has_ending(".out")) return kSbetFormat.read(path, progress);  // says what is wrong
  const auto other = io::stands_for_another(path, head.bytes);
  throw FileError(
      path, {0, {}},
      other ? *other
            : fmt::format("is not a trajectory of a known kind: expected {}", known_formats()));
}

const std::vector<WritableTrajectory>& writable_trajectories() {
  static const std::vector<WritableTrajectory> all = [] {
    std::vector<WritableTrajectory> list;
    for (const Format* format : formats()) {
      if (format->write == nullptr) continue;
      list.push_back({std::string(format->name), std::string(format->ending),
                      std::string(format->description)});
    }
    return list;
  }();
  return all;
}

std::vector<std::string> write_trajectory(const std::string& path, const Trajectory& trajectory,
                                          const std::string& format) {
  require_trajectory(trajectory);
  const std::string name = lower_case(path);
  std::string known;
  for (const Format* one : formats()) {
    if (one->write == nullptr) continue;
    const bool meant = format.empty() ? name.ends_with(one->ending) : format == one->name;
    if (meant) return one->write(path, trajectory);
    known +=
        fmt::format("{}{}", known.empty() ? "" : ", ", format.empty() ? one->ending : one->name);
  }
  throw InvalidArgument(format.empty() ? fmt::format("{}: unknown ending, allowed {}", path, known)
                                       : fmt::format("format = {}, allowed {}", format, known));
}

}  // namespace risley::trajectories
