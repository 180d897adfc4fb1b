// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/convert_trajectory.hpp"

#include "risley/trajectories/trajectory_file.hpp"

namespace risley::jobs {

ConvertedTrajectory convert_trajectory(const ConvertTrajectoryOptions& options,
                                       const Progress& progress) {
  trajectories::Trajectory trajectory =
      trajectories::load_trajectory(options.trajectory, progress.stage("reading"), options.topic);
  ConvertedTrajectory result;
  result.input_format = trajectory.format;
  result.warnings = trajectory.warnings;
  if (!options.accuracy.empty()) {
    const trajectories::AccuracyRecords records =
        trajectories::load_accuracies(options.accuracy, progress.stage("reading"));
    trajectories::add_accuracies(trajectory, records, options.accuracy);
    append(result.warnings, records.warnings);
  }
  progress.stage("writing").report(0);
  result.left_out = trajectories::write_trajectory(options.output, trajectory, options.format);
  result.records = trajectory.size();
  return result;
}

}  // namespace risley::jobs
