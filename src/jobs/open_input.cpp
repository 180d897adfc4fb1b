// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/open_input.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::jobs {

std::unique_ptr<recordings::Reader> open_input(const std::string& path,
                                               const recordings::ReadOptions& options,
                                               const Progress& progress) {
  if (!options.extrinsics) return recordings::open_recording(path, options, progress);
  try {
    return recordings::open_recording(path, options, progress);
  } catch (const InvalidArgument& error) {  // several sensors
    throw InvalidArgument(fmt::format("option extrinsics, {}: {}", path, error.what()));
  }
}

}  // namespace risley::jobs
