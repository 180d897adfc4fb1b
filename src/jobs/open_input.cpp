// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/open_input.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/trajectories/trajectory_file.hpp"

namespace risley::jobs {
namespace {

/// @throws FileError when the file is a trajectory: its own problem, or that it is none of a lidar
void refuse_trajectory(const recordings::Source& source, const Progress& progress) {
  if (source.recording()) return;
  const std::string& path = source.name();
  if (trajectories::trajectory_file_kind(path, progress) !=
      trajectories::TrajectoryFileKind::trajectory) {
    return;
  }
  const trajectories::Trajectory found = trajectories::load_trajectory(path, progress);
  throw FileError(path, {},
                  fmt::format("is a trajectory ({}, {} records), expected a recording of a lidar: "
                              "name it as the trajectory of one",
                              found.format, found.size()));
}

std::unique_ptr<recordings::Reader> open_lidar(const recordings::Source& source,
                                               const recordings::ReadOptions& options,
                                               const Progress& progress) {
  std::unique_ptr<recordings::Reader> reader;
  try {
    reader = recordings::open_recording(source, options, progress);
  } catch (const FileError&) {
    refuse_trajectory(source, progress);
    throw;
  }
  // Columns that are called yaw and pitch may be either.
  if (reader->header().format == "named-csv") refuse_trajectory(source, progress);
  return reader;
}

}  // namespace

std::unique_ptr<recordings::Reader> open_input(const recordings::Source& source,
                                               const recordings::ReadOptions& options,
                                               const Progress& progress) {
  if (!options.extrinsics) return open_lidar(source, options, progress);
  try {
    return open_lidar(source, options, progress);
  } catch (const InvalidArgument& error) {  // several sensors
    throw InvalidArgument(
        fmt::format("{}, {}: {}", name_of(kSetting.extrinsics), source.name(), error.what()));
  }
}

}  // namespace risley::jobs
