// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/spherical_kernel.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/io/little_endian.hpp"

// What packets become is tested through the decoder; here, that every instruction set makes the
// same of all numbers that a record can hold.
namespace risley::recordings::livox::spherical_kernel_test {

struct Columns {
  std::vector<double> azimuth, zenith, range;
  std::vector<float> azimuth_resolution, zenith_resolution, range_resolution;
  std::vector<std::uint8_t> intensity, tag, valid;

  explicit Columns(std::size_t rows)
      : azimuth(rows),
        zenith(rows),
        range(rows),
        azimuth_resolution(rows),
        zenith_resolution(rows),
        range_resolution(rows),
        intensity(rows),
        tag(rows, 77),
        valid(rows) {}
};

struct Layout {
  int returns;
  bool tagged;

  std::size_t bytes() const {
    if (returns > 1) return 4 + 6 * static_cast<std::size_t>(returns);
    return tagged ? 10 : 9;
  }
};
constexpr Layout kLayouts[] = {{1, false}, {1, true}, {2, true}, {3, true}};

std::uint32_t depth_of(std::size_t record, std::size_t number) {
  return record % 5 == 0 ? 0U : static_cast<std::uint32_t>(record * 196'613 + number);
}

/// A record with these steps of angles; its returns have depths that follow from its number.
void put(const Layout& layout, std::size_t record, unsigned zenith, unsigned azimuth, bool returns,
         std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> one(layout.bytes());
  std::uint8_t* angles = one.data() + (layout.returns == 1 ? 4 : 0);
  io::store<std::uint16_t>(angles, static_cast<std::uint16_t>(zenith));
  io::store<std::uint16_t>(angles + 2, static_cast<std::uint16_t>(azimuth));
  for (int number = 0; number < layout.returns; ++number) {
    std::uint8_t* depth =
        one.data() + (layout.returns == 1 ? 0 : 4 + 6 * static_cast<std::size_t>(number));
    const auto n = static_cast<std::size_t>(number);
    io::store<std::uint32_t>(depth, returns ? depth_of(record, n) : 0U);
    std::uint8_t* intensity = layout.returns == 1 ? one.data() + 8 : depth + 4;
    intensity[0] = static_cast<std::uint8_t>(record + 3 * n);
    if (layout.tagged) intensity[1] = static_cast<std::uint8_t>(record * 7 + n);
  }
  bytes.insert(bytes.end(), one.begin(), one.end());
}

std::size_t run(InstructionSet set, const Layout& layout, const std::vector<std::uint8_t>& bytes,
                Columns& columns) {
  SphericalArguments a;
  a.records = bytes.size() / layout.bytes();
  a.returns = layout.returns;
  a.tagged = layout.tagged;
  a.bytes = bytes.data();
  a.azimuth = columns.azimuth.data();
  a.zenith = columns.zenith.data();
  a.range = columns.range.data();
  a.azimuth_resolution = columns.azimuth_resolution.data();
  a.zenith_resolution = columns.zenith_resolution.data();
  a.range_resolution = columns.range_resolution.data();
  a.intensity = columns.intensity.data();
  a.tag = columns.tag.data();
  a.valid = columns.valid.data();
  return RISLEY_KERNEL_COPIES(decode_spherical).at(set)(a);
}

TEST(SphericalKernel, GivesEveryAngleInEveryInstructionSet) {
  constexpr std::size_t kRecords = 65'536;
  for (const Layout& layout : kLayouts) {
    std::vector<std::uint8_t> bytes;
    const auto steps = [](std::size_t record) {
      return std::pair{static_cast<unsigned>(record),
                       static_cast<unsigned>(record * 40'503 % 65'536)};
    };
    const auto possible = [&](std::size_t record) {
      return steps(record).first <= 18'000 && steps(record).second <= 36'000;
    };
    for (std::size_t record = 0; record < kRecords; ++record) {
      put(layout, record, steps(record).first, steps(record).second, possible(record), bytes);
    }
    const auto returns = static_cast<std::size_t>(layout.returns);
    for (const InstructionSet set : available_instruction_sets()) {
      SCOPED_TRACE(to_string(set));
      Columns found(kRecords * returns);
      ASSERT_EQ(run(set, layout, bytes, found), kRecords);
      for (std::size_t row = 0; row < kRecords * returns; ++row) {
        const std::size_t record = row / returns, number = row % returns;
        const auto [zenith, azimuth] = steps(record);
        const int turned =
            static_cast<int>(azimuth) - (azimuth > 18'000 && azimuth <= 36'000 ? 36'000 : 0);
        const std::uint32_t depth = possible(record) ? depth_of(record, number) : 0;
        ASSERT_EQ(found.azimuth[row], radians_from_degrees(turned / 100.0)) << azimuth;
        ASSERT_EQ(found.zenith[row], radians_from_degrees(zenith / 100.0)) << zenith;
        ASSERT_EQ(found.range[row], depth * 1e-3) << depth;
        ASSERT_EQ(found.valid[row], depth > 0 ? 1 : 0);
        ASSERT_EQ(found.intensity[row], static_cast<std::uint8_t>(record + 3 * number));
        ASSERT_EQ(found.tag[row],
                  layout.tagged ? static_cast<std::uint8_t>(record * 7 + number) : 0);
        ASSERT_EQ(found.azimuth_resolution[row], static_cast<float>(radians_from_degrees(0.01)));
        ASSERT_EQ(found.zenith_resolution[row], found.azimuth_resolution[row]);
        ASSERT_EQ(found.range_resolution[row], 1e-3F);
      }
    }
  }
}

TEST(SphericalKernel, NamesTheFirstImpossibleRecord) {
  constexpr std::size_t kRecords = 300;
  for (const Layout& layout : kLayouts) {
    for (const auto& [zenith, azimuth] : {std::pair{18'001U, 0U}, {0U, 36'001U}, {65'535U, 5U}}) {
      for (const std::size_t wrong : {1U, 96U, 127U, 128U, 299U}) {
        std::vector<std::uint8_t> bytes;
        for (std::size_t record = 0; record < kRecords; ++record) {
          // Without a return they stand in front of it, with one behind it.
          const bool bad = record == 0 || record == wrong || record + 1 == kRecords;
          put(layout, record, bad ? zenith : 18'000U, bad ? azimuth : 36'000U, record != 0, bytes);
        }
        for (const InstructionSet set : available_instruction_sets()) {
          Columns found(kRecords * static_cast<std::size_t>(layout.returns));
          EXPECT_EQ(run(set, layout, bytes, found), wrong);
        }
      }
    }
  }
}

}  // namespace risley::recordings::livox::spherical_kernel_test
