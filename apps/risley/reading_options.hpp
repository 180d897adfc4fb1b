// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

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

}  // namespace risley::app
