// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/inspect_trajectory.hpp"

#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/trajectories/trajectory_file.hpp"

namespace risley::jobs {

bool is_trajectory(const InspectTrajectoryOptions& options, const recordings::ReadOptions& reading,
                   const Progress& progress) {
  if (options.topic.empty() &&
      trajectories::trajectory_file_kind(options.trajectory, progress.silent()) ==
          trajectories::TrajectoryFileKind::none) {
    if (options.accuracy.empty()) return false;
    throw InvalidArgument(fmt::format("{} goes with a trajectory, and {} is not one",
                                      name_of(kSetting.accuracy), options.trajectory));
  }
  const std::pair<bool, Setting> of_recordings[] = {
      {reading.shot_rate.has_value(), kSetting.shot_rate},
      {reading.extrinsics.has_value(), kSetting.extrinsics},
      {!reading.device.empty(), kSetting.device}};
  for (const auto& [given, setting] : of_recordings) {
    if (!given) continue;
    throw InvalidArgument(fmt::format("{} is for recordings, not trajectories", name_of(setting)));
  }
  return true;
}

InspectedTrajectory inspect_trajectory(const InspectTrajectoryOptions& options,
                                       const Progress& progress) {
  using trajectories::TrajectoryFileKind;
  InspectedTrajectory result;
  const auto take_accuracies = [&](const std::string& path) {
    trajectories::AccuracyRecords records =
        trajectories::load_accuracies(path, progress.stage("reading"));
    result.accuracies = trajectories::audit_accuracies(records);
    append(result.warnings, records.warnings);
    return records;
  };
  if (trajectories::trajectory_file_kind(options.trajectory) == TrajectoryFileKind::accuracies) {
    if (!options.accuracy.empty()) {
      throw InvalidArgument(fmt::format("{}: {} itself holds accuracies, expected a trajectory",
                                        name_of(kSetting.accuracy), options.trajectory));
    }
    take_accuracies(options.trajectory);
    return result;
  }
  result.trajectory =
      trajectories::load_trajectory(options.trajectory, progress.stage("reading"), options.topic);
  if (!options.accuracy.empty()) {
    trajectories::add_accuracies(*result.trajectory, take_accuracies(options.accuracy),
                                 options.accuracy);
  }
  result.audit = trajectories::audit_trajectory(*result.trajectory, {}, progress.stage("checking"));
  result.warnings.insert(result.warnings.begin(), result.audit->warnings.begin(),
                         result.audit->warnings.end());
  return result;
}

}  // namespace risley::jobs
