// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace risley::fuzz {

/// One kind of input from outside. Errors that the library reports are right for damaged input;
/// everything else ends the program.
struct Target {
  std::string_view name;
  void (*run)(std::span<const std::uint8_t> bytes);
};

/// All of them; the corpus has a folder for each.
const std::vector<Target>& all_targets();

/// @throws std::invalid_argument for an unknown name
const Target& target_of(std::string_view name);

// The groups, each in a file of its own.
std::vector<Target> recording_targets();
std::vector<Target> decoder_targets();
std::vector<Target> netcdf_targets();
std::vector<Target> text_targets();
std::vector<Target> trajectory_targets();
std::vector<Target> command_targets();
std::vector<Target> wire_targets();

}  // namespace risley::fuzz
