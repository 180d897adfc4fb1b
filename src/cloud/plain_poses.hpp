// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace risley::cloud {

/// Poses as plain numbers: where those of the first shot stand, and how many numbers further those
/// of the next one do. Rotations are frame from sensor, column by column.
struct PlainPoses {
  const double *turn = nullptr, *reference = nullptr, *lever = nullptr, *velocity = nullptr,
               *rate = nullptr;
  std::size_t stride = 0;
};

}  // namespace risley::cloud
