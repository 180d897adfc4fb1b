// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>

#include "risley/recordings/reader.hpp"

namespace risley::python {

using YawPitchRoll = std::optional<std::array<double, 3>>;

/// Settings for reading a recording. @param yaw_pitch_roll  rad @param device  empty: all of them
inline recordings::ReadOptions read_options(std::optional<double> shot_rate,
                                            const YawPitchRoll& yaw_pitch_roll,
                                            std::string device) {
  recordings::ReadOptions options;
  options.device = std::move(device);
  options.shot_rate = shot_rate;
  if (yaw_pitch_roll) {
    const auto& [yaw, pitch, roll] = *yaw_pitch_roll;
    options.extrinsics = recordings::Extrinsics{yaw, pitch, roll, {}};
  }
  return options;
}

}  // namespace risley::python
