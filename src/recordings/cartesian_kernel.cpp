// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp. Results must not
// depend on the processor: -ffp-contract=off, with which it is compiled, multiplies and adds in two
// steps, because not all processors can do it in one.
#include "recordings/cartesian_kernel.hpp"

#include <limits>

#include "risley/core/angle.hpp"
#include "risley/core/simd.hpp"

namespace risley::recordings::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;

/// atan2(y, x) of y >= 0: within an eighth of a turn by a polynomial in the quotient, which is
/// rotated by 45 degrees if it is above tan 22.5 degrees.
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

constexpr std::size_t kBlock = 128;  // at least the records of a packet
static_assert(kBlock % kLanes == 0);

/// Angles, range and distance from the Z axis of a batch of points.
void set_batch(const double* x_m, const double* y_m, const double* z_m, double* azimuths,
               double* zeniths, double* ranges, double* horizontals) {
  const Batch x = Batch::load_unaligned(x_m), y = Batch::load_unaligned(y_m),
              z = Batch::load_unaligned(z_m), zero(0.0);
  const Batch flat = x * x + y * y;
  const Batch horizontal = xsimd::sqrt(flat), range = xsimd::sqrt(flat + z * z);
  Batch azimuth = angle_of(xsimd::abs(y), x);
  azimuth = xsimd::select(y < zero, zero - azimuth, azimuth);
  azimuth = xsimd::select(horizontal > zero, azimuth, zero);
  const Batch zenith = angle_of(horizontal, z);
  const auto none = range == zero;
  const Batch nan(std::numeric_limits<double>::quiet_NaN());
  xsimd::select(none, nan, azimuth).store_unaligned(azimuths);
  xsimd::select(none, nan, zenith).store_unaligned(zeniths);
  range.store_unaligned(ranges);
  horizontal.store_unaligned(horizontals);
}

/// Quantities that follow from range and distance from the Z axis.
void set_resolutions(const double* __restrict ranges, const double* __restrict horizontals,
                     std::size_t count, float step, float* __restrict azimuth_resolution,
                     float* __restrict zenith_resolution, float* __restrict range_resolution,
                     std::uint8_t* __restrict valid) {
  // Close to the Z axis a step can turn the azimuth by any angle.
  constexpr auto kTurn = static_cast<float>(kTwoPi), kHalf = static_cast<float>(kPi);
  for (std::size_t i = 0; i < count; ++i) {
    const auto far = static_cast<float>(ranges[i]), wide = static_cast<float>(horizontals[i]);
    const float across = step / wide, along = step / far;
    const float turn = across < kTurn ? across : kTurn, half = along < kHalf ? along : kHalf;
    azimuth_resolution[i] = far > 0 ? turn : 0.0F;
    zenith_resolution[i] = far > 0 ? half : 0.0F;
  }
  for (std::size_t i = 0; i < count; ++i) range_resolution[i] = step;
  for (std::size_t i = 0; i < count; ++i) valid[i] = ranges[i] > 0 ? 1 : 0;
}

}  // namespace

void set_cartesian_points(const CartesianArguments& a) {
  alignas(64) double horizontals[kBlock];
  for (std::size_t begin = 0; begin < a.points; begin += kBlock) {
    const std::size_t count = a.points - begin < kBlock ? a.points - begin : kBlock;
    std::size_t i = 0;
    for (; i + kLanes <= count; i += kLanes) {
      const std::size_t at = begin + i;
      set_batch(a.x + at, a.y + at, a.z + at, a.azimuth + at, a.zenith + at, a.range + at,
                horizontals + i);
    }
    if (i < count) {
      double x[kLanes] = {}, y[kLanes] = {}, z[kLanes] = {}, azimuths[kLanes], zeniths[kLanes],
             ranges[kLanes];
      for (std::size_t k = i; k < count; ++k) {
        x[k - i] = a.x[begin + k];
        y[k - i] = a.y[begin + k];
        z[k - i] = a.z[begin + k];
      }
      set_batch(x, y, z, azimuths, zeniths, ranges, horizontals + i);
      for (std::size_t k = i; k < count; ++k) {
        a.azimuth[begin + k] = azimuths[k - i];
        a.zenith[begin + k] = zeniths[k - i];
        a.range[begin + k] = ranges[k - i];
      }
    }
    set_resolutions(a.range + begin, horizontals, count, static_cast<float>(a.step),
                    a.azimuth_resolution + begin, a.zenith_resolution + begin,
                    a.range_resolution + begin, a.valid + begin);
  }
}

}  // namespace risley::recordings::RISLEY_KERNEL_NAMESPACE
