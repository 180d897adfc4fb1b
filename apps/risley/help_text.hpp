// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include <CLI/CLI.hpp>

namespace risley::app {

/// Width of a terminal for the help, in columns.
inline constexpr std::size_t kHelpColumns = 100;

/// Heading, in the short help, of every verb's options.
inline constexpr const char* kCommonGroup = "Common options";

/// Sorts a verb's options into what --help shows and the headings under which --help-all shows the
/// rest. Options with a heading of their own keep it.
/// @param usual  names of the options that --help shows, separated by spaces
void arrange_options(CLI::App& verb, std::string_view usual);

/// Breaks lines longer than @p columns at spaces and indents the continuation like the line itself.
std::string wrapped(std::string_view text, std::size_t columns);

/// Examples first, then the usual options; with --help-all every option under its heading.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override;
};

}  // namespace risley::app
