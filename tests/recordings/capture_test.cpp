// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "recordings/format_tests.hpp"

namespace risley::recordings::capture_test {

using namespace format_tests;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A block of pcapng.
std::string block(std::uint32_t type, std::string body) {
  body.resize((body.size() + 3) / 4 * 4);
  std::string bytes;
  put(bytes, type);
  put(bytes, static_cast<std::uint32_t>(body.size() + 12));
  bytes += body;
  put(bytes, static_cast<std::uint32_t>(body.size() + 12));
  return bytes;
}

TEST(Capture, InterfacesThatCannotBeReadTogetherAreNamed) {
  constexpr std::uint32_t kSection = 0x0A0D0D0A, kInterface = 1;
  std::string section;
  put(section, std::uint32_t{0x1A2B3C4D});
  put(section, std::uint32_t{1});
  put(section, std::int64_t{-1});
  std::string bytes = block(kSection, section);
  for (const std::uint16_t link : {std::uint16_t{1}, std::uint16_t{101}}) {  // Ethernet, raw IP
    std::string interface;
    put(interface, link);
    put(interface, std::uint16_t{0});
    put(interface, std::uint32_t{65535});
    bytes += block(kInterface, interface);
  }
  expect_damage(
      read_text(kPcapFormat, bytes),
      AllOf(HasSubstr("different from"), HasSubstr("tshark"), Not(HasSubstr("no packet"))));
}

}  // namespace risley::recordings::capture_test
