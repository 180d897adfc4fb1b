// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/reader.hpp"

#include "command.hpp"

namespace risley::app {

/// Commercial name of the sensor that made a recording; of several, each once.
std::string sensor_name(const recordings::RecordingHeader& header);

/// The same where the scan was asked too: "unknown" where nothing describes it.
std::string sensor_name(const jobs::SensorChoice& choice);

/// Which sensor it was and who says so: sensor, preset, sensor_chosen_by, sensor_choice.
Json choice_json(const jobs::SensorChoice& choice);

/// An angle and its sigma, rad, in degrees.
Json value_json(double value, double sigma);
/// How a recording's frame is turned; zeros without sigma where it is the sensor's.
Json frame_json(const std::optional<estimation::FrameEstimate>& turn = {});

/// Where the count of shots was wrong: [{row, shots}], shots null where they could not be counted.
Json slips_json(const std::vector<recordings::ShotSlip>& slips);

Json warnings_json(const std::vector<recordings::ReadWarning>& warnings);
/// The same on stderr, each with the name of the file.
void log_warnings(const std::string& file, const std::vector<recordings::ReadWarning>& warnings);

/// The keys that tell of damage in the body of a file.
Json damage_json(const FileError& damage);

/// 1234567 as "1 234 567".
std::string grouped(std::uint64_t number);

}  // namespace risley::app
