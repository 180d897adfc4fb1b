// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/report_facts.hpp"

#include <filesystem>

namespace risley::report {

ReportedRecording reported(const jobs::ReadRecording& recording) {
  return {std::filesystem::path(recording.path).filename().string(), recording.header.format,
          to_string(recording.header.time_reference), recording.audit};
}

}  // namespace risley::report
