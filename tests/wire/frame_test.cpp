// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/frame.hpp"

#include <string_view>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

#include "wire/hex.hpp"

namespace risley::wire {
namespace {

std::span<const std::uint8_t> text_bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

FrameFault fault_of(const std::vector<std::uint8_t>& bytes) {
  const auto decoded = decode_frame(bytes);
  EXPECT_TRUE(std::holds_alternative<FrameRefusal>(decoded));
  return std::get<FrameRefusal>(decoded).fault;
}

/// A frame whose header is right again after a change.
std::vector<std::uint8_t> with_header_checksum(std::vector<std::uint8_t> bytes) {
  io::store<std::uint16_t>(&bytes[7], frame_crc16(std::span(bytes).first(7)));
  return bytes;
}

TEST(Frame, ChecksumsOfTheUsualNineDigits) {
  EXPECT_EQ(frame_crc16(text_bytes("123456789")), 0xAB4E);
  EXPECT_EQ(frame_crc32(text_bytes("123456789")), 0xB08DB5B1U);
}

TEST(Frame, RoundTripOfEveryLength) {
  std::vector<std::uint8_t> data;
  for (std::size_t count = 0; count <= kMostFrameBytes - kFrameOverhead; count += 1 + count / 8) {
    data.resize(count, static_cast<std::uint8_t>(count));
    const auto bytes = encode_frame({FrameType::message, 65535, {2, 14}, data});
    ASSERT_EQ(bytes.size(), count + kFrameOverhead);
    const auto decoded = decode_frame(bytes);
    ASSERT_TRUE(std::holds_alternative<Frame>(decoded)) << count;
    const auto& frame = std::get<Frame>(decoded);
    EXPECT_EQ(frame.type, FrameType::message);
    EXPECT_EQ(frame.sequence, 65535);
    EXPECT_EQ(frame.command, (CommandId{2, 14}));
    EXPECT_TRUE(std::equal(data.begin(), data.end(), frame.data.begin(), frame.data.end()));
  }
  data.resize(kMostFrameBytes - kFrameOverhead + 1);
  EXPECT_THROW(encode_frame({FrameType::command, 0, {0, 0}, data}), InvalidArgument);
}

TEST(Frame, EveryFaultHasItsName) {
  const auto good = bytes_of("AA011000000000B809 0004 01 228D5307");
  ASSERT_TRUE(std::holds_alternative<Frame>(decode_frame(good)));
  auto bad = good;
  bad.resize(14);
  EXPECT_EQ(fault_of(bad), FrameFault::too_short);
  EXPECT_EQ(fault_of({}), FrameFault::too_short);
  bad = good;
  bad[0] = 0xAB;
  EXPECT_EQ(fault_of(bad), FrameFault::start);
  bad = good;
  bad[1] = 2;
  EXPECT_EQ(fault_of(with_header_checksum(bad)), FrameFault::version);
  bad = good;
  bad.push_back(0);
  EXPECT_EQ(fault_of(bad), FrameFault::length);
  bad = good;
  bad[2] = 17;
  EXPECT_EQ(fault_of(with_header_checksum(bad)), FrameFault::length);
  bad = good;
  bad[5] = 1;
  EXPECT_EQ(fault_of(bad), FrameFault::header_checksum);
  bad = good;
  bad[4] = 3;
  EXPECT_EQ(fault_of(with_header_checksum(bad)), FrameFault::type);
  bad = good;
  bad[11] = 0;
  EXPECT_EQ(fault_of(bad), FrameFault::checksum);
  EXPECT_EQ(to_string(FrameRefusal{FrameFault::checksum, 1, 0x228D5307}),
            "CRC-32 = 0x228D5307, expected 0x00000001");
  EXPECT_EQ(to_string(FrameRefusal{FrameFault::length, 16, 17}),
            "frame length = 17, expected 16 bytes");
}

TEST(Frame, EveryBitCounts) {
  const auto good = bytes_of("AA0119000001000441 0001 C0A80102C1DACDD8C1DA 02443550");
  for (std::size_t bit = 0; bit < 8 * good.size(); ++bit) {
    auto bad = good;
    bad[bit / 8] = static_cast<std::uint8_t>(bad[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_TRUE(std::holds_alternative<FrameRefusal>(decode_frame(bad))) << bit;
  }
  for (std::size_t count = 0; count < good.size(); ++count) {
    EXPECT_TRUE(std::holds_alternative<FrameRefusal>(decode_frame(std::span(good).first(count))))
        << count;
  }
}

}  // namespace
}  // namespace risley::wire
