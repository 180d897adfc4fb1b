// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "risley/recordings/reader.hpp"

#include "command.hpp"

namespace risley::app {

/// How every verb that reads recordings is told to read them, as typed.
struct ReadingWishes {
  std::optional<double> shot_rate_hz;
};

/// Declares --shot-rate-hz.
void add_reading_options(CLI::App& verb, ReadingWishes& wishes);

/// @throws InvalidArgument naming the option
recordings::ReadOptions read_options(const ReadingWishes& wishes);

/// What a reading verb does first. @throws FileError, InvalidArgument naming the option
std::unique_ptr<recordings::Reader> open_input(const std::string& path,
                                               const ReadingWishes& wishes);

}  // namespace risley::app
