// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recording_text.hpp"

#include <spdlog/spdlog.h>

#include "risley/jobs/recording_input.hpp"

#include "option_names.hpp"

namespace risley::app {

void log_warnings(const std::string& file, std::vector<recordings::ReadWarning>& warnings) {
  for (recordings::ReadWarning& warning : warnings) {
    warning.message = with_flags(warning.message);
    spdlog::warn("{}: {}", file, jobs::warning_text(warning));
  }
}

std::string grouped(std::uint64_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ' ';
    text += digits[i];
  }
  return text;
}

}  // namespace risley::app
