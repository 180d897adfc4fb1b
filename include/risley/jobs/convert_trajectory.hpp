// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::jobs {

/// Input and output of a conversion.
struct ConvertTrajectoryOptions {
  std::string trajectory;  ///< path
  std::string output;      ///< path; its ending chooses the format
  std::string format;      ///< name of an output format, regardless of the ending; empty uses the
                           ///< ending
  std::string accuracy;    ///< path of accuracies (SMRMSG) for the records; empty: none
  std::string topic;       ///< of a bag of ROS; empty: its only one with poses
};

/// What came of it.
struct ConvertedTrajectory {
  std::uint64_t records = 0;
  std::string input_format;
  std::vector<std::string> left_out;  ///< description of the data that the format cannot hold
  std::vector<Warning> warnings;      ///< of reading
};

/// Reads a trajectory in any known format and writes it in another. Stages: reading, writing.
/// @throws FileError; InvalidArgument for an unknown ending or format and for data that it cannot
/// hold; Cancelled
ConvertedTrajectory convert_trajectory(const ConvertTrajectoryOptions& options,
                                       const Progress& progress = {});

}  // namespace risley::jobs
