// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/moving_platform.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/trajectories/trajectory_file.hpp"

namespace risley::jobs {

bool moves(const PlatformFiles& files) {
  return !files.trajectory.empty() || !files.mount.empty() || !files.accuracy.empty() ||
         !files.errors.empty() || !files.topic.empty() || !files.crs.empty() ||
         !files.datum.empty();
}

std::vector<std::string> paths_of(const PlatformFiles& files) {
  std::vector<std::string> paths;
  for (const std::string& path :
       {files.trajectory.path(), files.mount.path(), files.accuracy, files.errors}) {
    if (!path.empty()) paths.push_back(path);
  }
  return paths;
}

trajectories::Mount mount_of(const GivenMount& given) {
  return given.value() ? *given.value() : trajectories::load_mount(given.name());
}

trajectories::Trajectory trajectory_of(const GivenTrajectory& given, const std::string& topic,
                                       const Progress& progress) {
  return given.value() ? *given.value()
                       : trajectories::load_trajectory(given.name(), progress, topic);
}

cloud::MovingPlatform load_platform(const PlatformFiles& files, const Progress& progress) {
  if (files.trajectory.empty()) {
    throw InvalidArgument(
        fmt::format("{} is missing: mount, accuracies, errors and crs are for a moving sensor",
                    name_of(kSetting.trajectory)));
  }
  if (files.mount.empty()) {
    throw InvalidArgument(
        fmt::format("{} is missing: a file that describes how the sensor is mounted on the "
                    "platform of the trajectory (axes, lever arm, boresight, clock)",
                    name_of(kSetting.mount)));
  }
  cloud::MovingPlatform platform;
  platform.mount = mount_of(files.mount);
  platform.trajectory = trajectory_of(files.trajectory, files.topic, progress);
  if (!files.accuracy.empty()) {
    trajectories::add_accuracies(platform.trajectory,
                                 trajectories::load_accuracies(files.accuracy, progress),
                                 files.accuracy);
  }
  if (!files.errors.empty()) {
    platform.errors = trajectories::load_error_model(files.errors);
  } else if (!platform.trajectory.accuracy.empty()) {
    platform.errors = trajectories::assumed_error_model();
  }
  platform.crs = files.crs;
  if (!files.datum.empty()) platform.datum = files.datum;
  return platform;
}

}  // namespace risley::jobs
