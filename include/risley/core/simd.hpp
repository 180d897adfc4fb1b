// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include <xsimd/xsimd.hpp>

#include "risley/core/batch_functions.hpp"
#include "risley/core/scalar.hpp"

// What kernels share. A kernel is compiled once per instruction set, with RISLEY_KERNEL = baseline,
// avx2, avx512, and puts its functions into RISLEY_KERNEL_NAMESPACE. Every template instantiated
// there has the batch type of that instruction set in its name, so the linker cannot use a wide
// copy for the rest of the program (tests/architecture checks it).
#define RISLEY_JOIN2(a, b) a##b
#define RISLEY_JOIN(a, b) RISLEY_JOIN2(a, b)
#define RISLEY_KERNEL_NAMESPACE RISLEY_JOIN(kernel_, RISLEY_KERNEL)

namespace risley {

/// Sine and cosine of all lanes of a batch at once.
template <class Arch>
struct SineCosine<xsimd::batch<double, Arch>> {
  using Batch = xsimd::batch<double, Arch>;  ///< of any instruction set
  /// Sine and cosine of an angle in rad, in this order.
  static std::pair<Batch, Batch> of(const Batch& angle) { return sine_cosine(angle); }
};

/// Azimuth and zenith of all lanes of a batch at once.
template <class Arch>
struct UnitVectorAngles<xsimd::batch<double, Arch>> {
  using Batch = xsimd::batch<double, Arch>;  ///< of any instruction set
  /// As angles_from_direction().
  static SphericalAngles<Batch> of(const Vector3<Batch>& direction) {
    return cone_angles(direction);
  }
};

/// Sum of the lanes of a batch.
template <class Arch>
double sum_of_lanes(const xsimd::batch<double, Arch>& value) {
  constexpr std::size_t kLanes = xsimd::batch<double, Arch>::size;
  alignas(64) double lanes[kLanes];
  value.store_aligned(lanes);
  double sum = 0;
  for (std::size_t i = 0; i < kLanes; ++i) sum += lanes[i];
  return sum;
}

}  // namespace risley
