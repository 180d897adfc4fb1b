// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/core/simd.hpp"
#include "risley/core/vector3.hpp"

/// For kernels: numbers that stand with the poses, and what is done with them.
namespace risley::cloud::RISLEY_KERNEL_NAMESPACE {

/// Numbers of the shots from `at` on, lane by lane; of fewer than a batch's the last one again.
template <class Batch, std::size_t N>
void gather(const double* first, std::size_t stride, std::size_t at, std::size_t count,
            Batch (&numbers)[N]) {
  constexpr std::size_t kLanes = Batch::size;
  alignas(64) double lanes[N][kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) {
    const double* own = first + (at + (i < count ? i : count - 1)) * stride;
    for (std::size_t k = 0; k < N; ++k) lanes[k][i] = own[k];
  }
  for (std::size_t k = 0; k < N; ++k) numbers[k] = Batch::load_aligned(lanes[k]);
}

/// Matrices of three rows, column by column.
template <class Batch>
struct LaneMatrix {
  Batch m[9];

  LaneMatrix() = default;
  explicit LaneMatrix(const double* numbers) {
    for (std::size_t k = 0; k < 9; ++k) m[k] = Batch(numbers[k]);
  }
  Vector3<Batch> operator*(const Vector3<Batch>& v) const {
    return {m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z,
            m[2] * v.x + m[5] * v.y + m[8] * v.z};
  }
  /// The transpose times a vector.
  Vector3<Batch> back(const Vector3<Batch>& v) const {
    return {m[0] * v.x + m[1] * v.y + m[2] * v.z, m[3] * v.x + m[4] * v.y + m[5] * v.z,
            m[6] * v.x + m[7] * v.y + m[8] * v.z};
  }
};

}  // namespace risley::cloud::RISLEY_KERNEL_NAMESPACE
