// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/warning.hpp"

#include <fmt/format.h>

namespace risley {

std::string warning_text(const Warning& warning) {
  std::string text = warning.message;
  if (warning.place.byte_offset) text += fmt::format(" (at byte {})", *warning.place.byte_offset);
  if (warning.place.line) text += fmt::format(" (line {})", *warning.place.line);
  return text;
}

Warning of_file(const std::string& file, Warning warning) {
  warning.message = fmt::format("{}: {}", file, warning.message);
  return warning;
}

void append(std::vector<Warning>& warnings, const std::vector<Warning>& more) {
  warnings.insert(warnings.end(), more.begin(), more.end());
}

}  // namespace risley
