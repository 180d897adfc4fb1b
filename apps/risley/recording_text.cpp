// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recording_text.hpp"

#include <spdlog/spdlog.h>

#include "risley/jobs/recording_input.hpp"

namespace risley::app {

void log_warnings(const std::string& file, const std::vector<recordings::ReadWarning>& warnings) {
  for (const recordings::ReadWarning& warning : warnings) {
    spdlog::warn("{}: {}", file, jobs::warning_text(warning));
  }
}

}  // namespace risley::app
