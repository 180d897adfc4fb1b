// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The words of the command, taken apart by its real options; nothing is run.
#include <cmath>
#include <string>
#include <vector>

#include "risley/core/error.hpp"

#include "command_line.hpp"
#include "fuzz/invariants.hpp"
#include "fuzz/targets.hpp"
#include "parameter_choice.hpp"
#include "reading_options.hpp"

namespace risley::fuzz {
namespace {

/// One word per line.
std::vector<std::string> words_of(std::span<const std::uint8_t> bytes) {
  std::vector<std::string> words;
  std::string word;
  for (const std::uint8_t byte : bytes) {
    if (byte == 0) continue;  // no word of a command has one
    if (byte == '\n') {
      words.push_back(word);
      word.clear();
    } else {
      word += static_cast<char>(byte);
    }
  }
  if (!word.empty()) words.push_back(word);
  return words;
}

/// What stands behind options is read as each of the things it may be.
void read_value(const std::string& word) {
  try {
    const auto [name, value] = app::assignment(word);
    require(!name.empty() && std::isfinite(value), "a parameter has a name and a number");
  } catch (const InvalidArgument&) {  // refused
  }
  try {
    const double value = app::rate_from(word).value_or(1);
    require(std::isfinite(value) && value > 0, "a rate is positive");
  } catch (const InvalidArgument&) {  // refused
  }
  try {
    app::ReadingWishes wishes;
    wishes.extrinsics_deg = word;
    const auto pose = app::read_options(wishes).extrinsics;
    require(!pose || (std::isfinite(pose->yaw) && std::isfinite(pose->pitch) &&
                      std::isfinite(pose->roll)),
            "a pose is of numbers");
  } catch (const InvalidArgument&) {  // refused
  }
}

void run_command_line(std::span<const std::uint8_t> bytes) {
  const std::vector<std::string> words = words_of(bytes);
  static app::CommandLine line;  // as often as it is asked
  const app::CommandLine::Parsed parsed = line.parse(words);
  require((parsed.verb != nullptr) + parsed.help.has_value() + parsed.problem.has_value() == 1,
          "words are understood, ask for help, or are wrong");
  if (parsed.verb != nullptr) {
    require(line.run_of(*parsed.verb) != nullptr, "every verb can be run");
    require(line.common().threads >= 0 && line.common().threads <= 4096, "a number of threads");
  }
  for (const std::string& word : words) read_value(word);
}

}  // namespace

std::vector<Target> command_targets() { return {{"command-line", run_command_line}}; }

}  // namespace risley::fuzz
