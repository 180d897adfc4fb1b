// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/warning.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Recordings to calibrate with, and settings for their rotation angles. SI units.
struct RangedInputOptions {
  std::vector<recordings::Source> recordings;  ///< of one sensor, each with ranges
  recordings::ReadOptions reading;             ///< see open_in_sensor_frame()
  GivenSensor sensor;                          ///< as given_sensor()
  std::optional<double> rate;                  ///< shots per second to use; empty: all
  std::optional<double> angle_noise;           ///< as estimation::EstimateOptions
  std::optional<bool> mirrored;                ///< the elevation's sign is turned; empty: find out
};

/// Result of reading them, in addition to their shots.
struct RangedInput {
  std::vector<ReadRecording> recordings;
  std::uint64_t observations = 0;            ///< rows of all recordings
  std::vector<Warning> warnings;             ///< of the recordings
  SensorChoice choice;                       ///< how the first one's sensor was chosen
  sensors::Sensor nominal;                   ///< preset that all started from
  double reading_time = 0, angles_time = 0;  ///< s
};

}  // namespace risley::jobs
