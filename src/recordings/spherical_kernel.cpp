// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "recordings/spherical_kernel.hpp"

#include "risley/core/simd.hpp"

#include "recordings/formats/cartesian.hpp"
#include "recordings/livox/spherical_record.hpp"

namespace risley::recordings::livox::RISLEY_KERNEL_NAMESPACE {
namespace {

constexpr std::size_t kBlock = 128;  // all records of a packet

constexpr double radians_from_steps(int steps) { return steps / 100.0 * kRadiansPerDegree; }
static_assert(radians_from_steps(kHalfTurn) == kPi);  // none lies beyond the cut

std::uint32_t load(const std::uint8_t* bytes) {
  std::uint32_t value;
  __builtin_memcpy(&value, bytes, sizeof value);
  return value;
}

/// The numbers of records are gathered one by one, because they are unaligned, and turned into
/// columns by loops that compilers vectorise: reading LVX takes 40 % less time than record by
/// record (AVX-512, Zen 4).
template <int kReturns, bool kTagged>
std::size_t decode(const SphericalArguments& a) {
  constexpr std::size_t kBytes = kReturns == 1 ? (kTagged ? 10 : 9) : 4 + 6 * kReturns;
  std::uint32_t angles[kBlock], depths[kBlock * kReturns];
  for (std::size_t first = 0; first < a.records; first += kBlock) {
    const std::size_t records = a.records - first < kBlock ? a.records - first : kBlock;
    const std::size_t begin = first * kReturns, rows = records * kReturns;
    std::uint8_t* __restrict intensity = a.intensity + begin;
    std::uint8_t* __restrict tag = a.tag + begin;
    const std::uint8_t* from = a.bytes + first * kBytes;
    for (std::size_t i = 0; i < records; ++i, from += kBytes) {
      angles[i] = load(from + zenith_at(kReturns));
      for (int number = 0; number < kReturns; ++number) {
        const std::size_t row = i * kReturns + static_cast<std::size_t>(number);
        depths[row] = load(from + depth_at(kReturns, number));
        intensity[row] = from[intensity_at(kReturns, number)];
        if (kTagged) tag[row] = from[intensity_at(kReturns, number) + 1];
      }
    }
    const auto impossible = [&](std::size_t i) {
      std::uint32_t depth = depths[i * kReturns];
      for (std::size_t number = 1; number < kReturns; ++number) {
        depth |= depths[i * kReturns + number];
      }
      return (static_cast<unsigned>((angles[i] & 0xffff) > kHalfTurn) |
              static_cast<unsigned>(angles[i] >> 16 > kFullTurn)) &
             static_cast<unsigned>(depth > 0);
    };
    unsigned any_impossible = 0;
    for (std::size_t i = 0; i < records; ++i) any_impossible |= impossible(i);
    if (any_impossible != 0) {
      std::size_t i = 0;
      while (impossible(i) == 0) ++i;
      return first + i;
    }
    double* __restrict azimuth = a.azimuth + begin;
    double* __restrict zenith = a.zenith + begin;
    for (std::size_t i = 0; i < records; ++i) {
      const int zenith_steps = static_cast<int>(angles[i] & 0xffff);
      const int azimuth_steps = static_cast<int>(angles[i] >> 16);
      // Angles beyond a full turn are invalid anyway; they are kept unchanged.
      const int over_half = static_cast<int>(azimuth_steps > kHalfTurn) &
                            static_cast<int>(azimuth_steps <= kFullTurn);
      const double azimuth_rad = radians_from_steps(azimuth_steps - over_half * kFullTurn);
      const double zenith_rad = radians_from_steps(zenith_steps);
      for (std::size_t number = 0; number < kReturns; ++number) {
        azimuth[i * kReturns + number] = azimuth_rad;
        zenith[i * kReturns + number] = zenith_rad;
      }
    }
    double* __restrict range = a.range + begin;
    std::uint8_t* __restrict valid = a.valid + begin;
    for (std::size_t i = 0; i < rows; ++i) range[i] = depths[i] * kMillimetre;
    for (std::size_t i = 0; i < rows; ++i) valid[i] = depths[i] > 0 ? 1 : 0;
    if (!kTagged) __builtin_memset(tag, 0, rows);
    const auto fill = [=](float* column, double step) {
      for (std::size_t i = 0; i < rows; ++i) column[begin + i] = static_cast<float>(step);
    };
    fill(a.azimuth_resolution, kCentidegree);
    fill(a.zenith_resolution, kCentidegree);
    fill(a.range_resolution, kMillimetre);
  }
  return a.records;
}

}  // namespace

std::size_t decode_spherical(const SphericalArguments& a) {
  if (a.returns == 2) return decode<2, true>(a);
  if (a.returns == 3) return decode<3, true>(a);
  return a.tagged ? decode<1, true>(a) : decode<1, false>(a);
}

}  // namespace risley::recordings::livox::RISLEY_KERNEL_NAMESPACE
