// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/recordings/extrinsics.hpp"
#include "risley/recordings/reader.hpp"

#include "command.hpp"

namespace risley::app {

/// How every verb that reads recordings is told to read them, as typed.
struct ReadingWishes {
  std::optional<double> shot_rate_hz;
  std::string extrinsics_deg;  ///< YAW,PITCH,ROLL; empty: not told
};

/// Declares --shot-rate-hz and --extrinsics.
void add_reading_options(CLI::App& verb, ReadingWishes& wishes);

/// @throws InvalidArgument naming the option
recordings::ReadOptions read_options(const ReadingWishes& wishes);

/// What a reading verb does first. @throws FileError, InvalidArgument naming the option
std::unique_ptr<recordings::Reader> open_input(const std::string& path,
                                               const ReadingWishes& wishes);

/// A recording of single shots with times whose rows stand in its sensor's frame, as far as that is
/// known.
struct SensorFrameInput {
  std::unique_ptr<recordings::Reader> reader;
  std::vector<std::string> warnings;  ///< what was done about a pose that the recording states
  bool turned_back = false;           ///< by a pose, stated or given
};

/// As open_input, and decides what a pose in the recording's header means where --extrinsics does
/// not say it: the first second of the shots tells whether the points were moved by it (see
/// estimation/stored_pose.hpp), and where they do not tell, a recording made through a hub counts
/// as moved, because hubs move points, and any other one does not, because LVX keeps points as they
/// are. Moved points are turned back.
/// @param field_of_view  of a sensor that could have made a recording with this header, full cone,
///                       rad; asked only where there is a pose to decide on
/// @throws MissingTimes, and as open_input
SensorFrameInput open_in_sensor_frame(
    const std::string& path, const ReadingWishes& wishes,
    const std::function<double(const recordings::RecordingHeader&)>& field_of_view);

/// "yaw 90 pitch -2.25 roll 1.5 deg, translation 0.1 0.2 -0.3 m"
std::string pose_text(const recordings::Extrinsics& pose);

}  // namespace risley::app
