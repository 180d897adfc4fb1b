// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "risley/recordings/reader.hpp"

namespace risley::jobs {

/// As recordings::open_recording; refused extrinsics are told with option and file.
std::unique_ptr<recordings::Reader> open_input(const recordings::Source& source,
                                               const recordings::ReadOptions& options,
                                               const Progress& progress);

}  // namespace risley::jobs
