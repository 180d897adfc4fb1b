// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/core/instruction_set.hpp"
#include "risley/optics/prism.hpp"

namespace risley::sensors {

/// Plain arguments of one kernel call, see BatchArguments: rows whose rotation angles grow by the
/// same step from each to the next.
struct ScanArguments {
  const double* parameters = nullptr;     ///< whole flat vector
  const FaceOrder* face_order = nullptr;  ///< [prisms]
  TrainLayout prisms;
  std::size_t emitters = 1, first_emitter = 0;  ///< of the first row
  std::size_t emitter_step = 1;                 ///< from each row to the next
  const double* angle = nullptr;                ///< [prisms], of the first row, rad
  const double* step = nullptr;                 ///< [prisms], rad
  std::size_t rows = 0;
  float* direction = nullptr;  ///< [rows][3], unit vectors, sensor frame
};

RISLEY_DECLARE_KERNEL(void scan(const ScanArguments& arguments))

}  // namespace risley::sensors
