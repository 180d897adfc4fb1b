// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

namespace risley::app {

/// Columns of a terminal that help fits into.
inline constexpr std::size_t kHelpColumns = 100;

/// Breaks lines that are longer at spaces. What follows stands under the line's own beginning, or
/// under the second column of a table, before which two or more spaces stand.
std::string wrapped(std::string_view text, std::size_t columns);

/// Help whose lines fit into kHelpColumns.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool positional) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
  std::string make_subcommand(const CLI::App* verb) const override;
};

}  // namespace risley::app
