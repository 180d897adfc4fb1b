// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "risley/recordings/extrinsics.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {

/// Gives every row the time that counting its shot gives, see ReadOptions::shot_rate.
/// @param path       for errors
/// @param shot_rate  Hz
/// @throws InvalidArgument when shot_rate is not a finite number above 0
std::unique_ptr<Reader> with_counted_times(std::unique_ptr<Reader> reader, const std::string& path,
                                           double shot_rate);

/// Turns every row back into the frame of its sensor, see ReadOptions::extrinsics.
/// @throws InvalidArgument when a number of the pose is not finite, or for several sensors
std::unique_ptr<Reader> in_sensor_frame(std::unique_ptr<Reader> reader, const Extrinsics& pose);

}  // namespace risley::recordings
