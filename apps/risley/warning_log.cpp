// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "warning_log.hpp"

#include <spdlog/spdlog.h>

namespace risley::app {

void log_warnings(const std::vector<Warning>& warnings) {
  for (const Warning& warning : warnings) spdlog::warn(warning_text(warning));
}

void log_warnings(const std::string& file, const std::vector<Warning>& warnings) {
  for (const Warning& warning : warnings) spdlog::warn(warning_text(of_file(file, warning)));
}

}  // namespace risley::app
