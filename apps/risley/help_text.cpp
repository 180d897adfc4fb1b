// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "help_text.hpp"

#include <algorithm>

namespace risley::app {
namespace {

/// Where the text of a line's last column begins.
std::size_t hanging_indent(std::string_view line) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", begin);
  return gap == std::string_view::npos ? begin : line.find_first_not_of(' ', gap);
}

std::string wrapped_line(std::string_view line, std::size_t columns) {
  const std::size_t indent = hanging_indent(line);
  std::string result;
  std::size_t room = columns, before = indent;  // spaces up to there are no place to break
  while (line.size() > room) {
    std::size_t end = line.rfind(' ', room);
    if (end == std::string_view::npos || end <= before) {
      end = line.find(' ', std::max(room, before + 1));
    }
    if (end == std::string_view::npos) break;
    result += line.substr(0, end);
    result += '\n' + std::string(indent, ' ');
    line.remove_prefix(end + 1);
    room = columns - indent;
    before = 0;
  }
  return result + std::string(line);
}

}  // namespace

std::string wrapped(std::string_view text, std::size_t columns) {
  std::string result;
  for (;;) {
    const std::size_t end = text.find('\n');
    result += wrapped_line(text.substr(0, end), columns);
    if (end == std::string_view::npos) return result;
    result += '\n';
    text.remove_prefix(end + 1);
  }
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool positional) const {
  std::string text = Formatter::make_option(option, positional);
  // A list of choices may be longer than a line.
  const std::size_t end = text.find('\n');
  std::string first = text.substr(0, end);
  for (std::size_t from = 0; first.size() - from > kHelpColumns;) {
    const std::size_t comma = first.rfind(',', from + kHelpColumns);
    if (comma == std::string::npos || comma <= from) break;
    first.insert(comma + 1, "\n      ");
    from = comma + 2;
  }
  return first + text.substr(std::min(end, text.size()));
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  return wrapped(Formatter::make_option_desc(option), kHelpColumns - get_column_width());
}

std::string HelpFormatter::make_subcommand(const CLI::App* verb) const {
  std::string text = Formatter::make_subcommand(verb);
  const bool ends = text.ends_with('\n');
  if (ends) text.pop_back();
  return wrapped(text, kHelpColumns) + (ends ? "\n" : "");
}

}  // namespace risley::app
