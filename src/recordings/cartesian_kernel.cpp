// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp. What is read must not
// depend on the processor: -ffp-contract=off, with which it is compiled, multiplies and adds in two
// steps, because not all can do it in one.
#include "recordings/cartesian_kernel.hpp"

#include <limits>

#include "risley/core/angle.hpp"
#include "risley/core/simd.hpp"

namespace risley::recordings::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;

/// atan2(y, x) of y >= 0: within an eighth of a turn by a polynomial in the quotient, which is
/// turned by 45 degrees where it is above tan 22.5 degrees.
Batch angle_of(const Batch& y, const Batch& x) {
  constexpr double kTangentOfSixteenth = 0.41421356237309503;
  const Batch wide = xsimd::abs(x);
  const auto steep = y > wide;
  const Batch more = xsimd::select(steep, y, wide), less = xsimd::select(steep, wide, y);
  const auto turned = less > more * Batch(kTangentOfSixteenth);
  const Batch quotient =
      xsimd::select(turned, less - more, less) / xsimd::select(turned, less + more, more);
  const Batch square = quotient * quotient;
  constexpr std::size_t kCount = sizeof kArcTangentSeries / sizeof kArcTangentSeries[0];
  Batch sum(kArcTangentSeries[kCount - 1]);
#pragma GCC unroll 16
  for (std::size_t i = kCount - 1; i > 0; --i) {
    sum = sum * square + Batch(kArcTangentSeries[i - 1]);
  }
  Batch angle = quotient + quotient * (square * sum);
  angle = xsimd::select(turned, angle + Batch(0.25 * kPi), angle);
  angle = xsimd::select(steep, Batch(0.5 * kPi) - angle, angle);
  return xsimd::select(x < Batch(0.0), Batch(kPi) - angle, angle);
}

struct Lanes {
  alignas(64) double of[kLanes] = {};
};

[[gnu::always_inline]] inline void set_points(const Batch& x, const Batch& y, const Batch& z,
                                              std::size_t at, std::size_t count,
                                              const CartesianArguments& a) {
  const Batch zero(0.0);
  const Batch flat = x * x + y * y;
  const Batch horizontal = xsimd::sqrt(flat), range = xsimd::sqrt(flat + z * z);
  Batch azimuth = angle_of(xsimd::abs(y), x);
  azimuth = xsimd::select(y < zero, zero - azimuth, azimuth);
  azimuth = xsimd::select(horizontal > zero, azimuth, zero);
  Batch zenith = angle_of(horizontal, z);
  const auto none = range == zero;
  const Batch nan(std::numeric_limits<double>::quiet_NaN());
  Lanes azimuths, zeniths, ranges, horizontals;
  xsimd::select(none, nan, azimuth).store_aligned(azimuths.of);
  xsimd::select(none, nan, zenith).store_aligned(zeniths.of);
  range.store_aligned(ranges.of);
  horizontal.store_aligned(horizontals.of);
  const auto step = static_cast<float>(a.step);
  for (std::size_t i = 0; i < count; ++i) a.azimuth[at + i] = azimuths.of[i];
  for (std::size_t i = 0; i < count; ++i) a.zenith[at + i] = zeniths.of[i];
  for (std::size_t i = 0; i < count; ++i) a.range[at + i] = ranges.of[i];
  for (std::size_t i = 0; i < count; ++i) a.range_resolution[at + i] = step;
  for (std::size_t i = 0; i < count; ++i) a.valid[at + i] = ranges.of[i] > 0 ? 1 : 0;
  // Close to the Z axis a step can turn the azimuth by any angle.
  constexpr auto kTurn = static_cast<float>(kTwoPi), kHalf = static_cast<float>(kPi);
  for (std::size_t i = 0; i < count; ++i) {
    const auto far = static_cast<float>(ranges.of[i]), wide = static_cast<float>(horizontals.of[i]);
    const float across = step / wide, along = step / far;
    a.azimuth_resolution[at + i] = far > 0 ? (across < kTurn ? across : kTurn) : 0.0F;
    a.zenith_resolution[at + i] = far > 0 ? (along < kHalf ? along : kHalf) : 0.0F;
  }
}

}  // namespace

void set_cartesian_points(const CartesianArguments& a) {
  std::size_t at = 0;
  for (; at + kLanes <= a.points; at += kLanes) {
    set_points(Batch::load_unaligned(a.x + at), Batch::load_unaligned(a.y + at),
               Batch::load_unaligned(a.z + at), at, kLanes, a);
  }
  if (at == a.points) return;
  Lanes x, y, z;
  for (std::size_t i = 0; i < kLanes; ++i) {
    const std::size_t from = at + i < a.points ? at + i : at;
    x.of[i] = a.x[from];
    y.of[i] = a.y[from];
    z.of[i] = a.z[from];
  }
  set_points(Batch::load_aligned(x.of), Batch::load_aligned(y.of), Batch::load_aligned(z.of), at,
             a.points - at, a);
}

}  // namespace risley::recordings::RISLEY_KERNEL_NAMESPACE
