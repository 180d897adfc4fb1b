// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/open_input.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::jobs {

std::unique_ptr<recordings::Reader> open_input(const recordings::Source& source,
                                               const recordings::ReadOptions& options,
                                               const Progress& progress) {
  if (!options.extrinsics) return recordings::open_recording(source, options, progress);
  try {
    return recordings::open_recording(source, options, progress);
  } catch (const InvalidArgument& error) {  // several sensors
    throw InvalidArgument(fmt::format("option extrinsics, {}: {}", source.name(), error.what()));
  }
}

}  // namespace risley::jobs
