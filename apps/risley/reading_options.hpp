// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "risley/recordings/reader.hpp"

#include "command.hpp"

namespace risley::app {

/// Options of every verb that reads recordings, as typed.
struct ReadingWishes {
  std::string device;  ///< SERIAL, TOPIC or INDEX; empty: not given
  std::optional<double> shot_rate_hz;
  std::string extrinsics_deg;  ///< YAW,PITCH,ROLL; empty: not given
  bool every_device = false;   ///< of a verb that makes one file per input
};

/// Declares --device, --shot-rate-hz and --extrinsics.
void add_reading_options(CLI::App& verb, ReadingWishes& wishes);

/// Declares --every-device, too.
void add_every_device(CLI::App& verb, ReadingWishes& wishes);

/// Splits recordings of several sensors into one job per sensor, if requested; the serial number,
/// or the number of the sensor, is added to the names of outputs.
/// @throws FileError
void split_by_device(const ReadingWishes& wishes, jobs::InputPlan& plan);

/// @throws InvalidArgument naming the option
recordings::ReadOptions read_options(const ReadingWishes& wishes);

}  // namespace risley::app
