// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

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

/// @param what  is read instead of recordings, in words
/// @throws InvalidArgument when any of these options was given
void require_no_reading_options(const ReadingWishes& wishes, std::string_view what);

/// @throws InvalidArgument naming the option
recordings::ReadOptions read_options(const ReadingWishes& wishes);

}  // namespace risley::app
