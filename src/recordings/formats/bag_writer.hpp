// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>

#include "risley/bags/bag.hpp"
#include "risley/recordings/writer.hpp"

namespace risley::recordings {

/// Writes recordings as the drivers of Livox publish them: a topic of points for each sensor, and
/// one of inertial samples if there are any.
std::unique_ptr<Writer> create_bag_recording(const std::string& path, bags::BagKind kind,
                                             const RecordingHeader& header,
                                             const WriteOptions& options);

}  // namespace risley::recordings
