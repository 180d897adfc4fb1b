// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "batch_functions_kernel.hpp"

#include "risley/core/simd.hpp"

namespace risley::batch_functions_test::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;

}  // namespace

void sines(const double* angle, std::size_t count, double* sine, double* cosine) {
  for (std::size_t i = 0; i < count; i += Batch::size) {
    const auto [s, c] = sin_cos(Batch::load_unaligned(angle + i));
    s.store_unaligned(sine + i);
    c.store_unaligned(cosine + i);
  }
}

void angles(const double* x, const double* y, const double* z, std::size_t count, double* azimuth,
            double* zenith) {
  for (std::size_t i = 0; i < count; i += Batch::size) {
    const auto found = angles_from_unit_vector(Vector3<Batch>{
        Batch::load_unaligned(x + i), Batch::load_unaligned(y + i), Batch::load_unaligned(z + i)});
    found.azimuth.store_unaligned(azimuth + i);
    found.zenith.store_unaligned(zenith + i);
  }
}

}  // namespace risley::batch_functions_test::RISLEY_KERNEL_NAMESPACE
