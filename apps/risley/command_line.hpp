// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "command.hpp"

namespace risley::app {

/// All verbs with their options: parses the command line and runs nothing.
class CommandLine {
 public:
  CommandLine();

  /// The result of parsing: one of the three.
  struct Parsed {
    const CLI::App* verb = nullptr;
    std::optional<std::string> help;     ///< text that was asked for
    std::optional<std::string> problem;  ///< why the words are wrong
  };
  /// @param words  without the command's own name
  Parsed parse(const std::vector<std::string>& words);

  /// Options that every verb has, as parsed.
  const CommonOptions& common() const { return common_; }
  const Run& run_of(const CLI::App& verb) const { return runs_.at(&verb); }

 private:
  CLI::App app_;
  CommonOptions common_;
  std::map<const CLI::App*, Run> runs_;
};

}  // namespace risley::app
