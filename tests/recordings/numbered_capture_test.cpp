// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Captures of sensors of the second generation, written byte by byte.
#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/recordings/time_audit.hpp"
#include "risley/wire/control_frame.hpp"

#include "recordings/format_tests.hpp"
#include "recordings/numbered_packets.hpp"

namespace risley::recordings::numbered_capture_test {

using namespace format_tests;
using namespace numbered_packets;
using ::testing::Contains;

using Bytes = std::vector<std::uint8_t>;

void put16(std::string& bytes, unsigned value) {  // as networks send them
  bytes += static_cast<char>(value >> 8);
  bytes += static_cast<char>(value & 0xFF);
}

template <class T>
void put(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// A capture of raw IP.
class Capture {
 public:
  Capture() {
    for (const std::uint32_t word : {0xA1B23C4DU, 0x00040002U, 0U, 0U, 65535U, 101U}) {
      put(bytes_, word);
    }
  }
  void add(std::uint8_t last, unsigned port, const Bytes& data) {
    std::string packet("\x45\0", 2);
    put16(packet, static_cast<unsigned>(28 + data.size()));
    packet += std::string("\0\1\0\0\x40\x11\0\0", 8);
    for (const int byte : {192, 168, 1, int{last}, 192, 168, 1, 5}) {
      packet += static_cast<char>(byte);
    }
    put16(packet, port);
    put16(packet, port + 1);
    put16(packet, static_cast<unsigned>(8 + data.size()));
    put16(packet, 0);
    packet.append(data.begin(), data.end());
    put(bytes_, std::uint32_t{1'700'000'000});
    put(bytes_, 480'000U * count_++);
    put(bytes_, static_cast<std::uint32_t>(packet.size()));
    put(bytes_, static_cast<std::uint32_t>(packet.size()));
    bytes_ += packet;
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  std::uint32_t count_ = 0;
};

TEST(NumberedCapture, EverythingIsCountedAndNamed) {
  Capture capture;
  const Bytes found =
      wire::encode_search_reply({0, kMid360, "47MDGEN2000001", {{192, 168, 1, 112}}, 56100});
  capture.add(112, 56000,
              wire::encode_control_frame({wire::ControlCommand::search, true, true, 1, found}));
  const auto view = wire::encode_view({10, 350, -5, 50});
  const std::array<std::uint8_t, 4> firmware{13, 18, 2, 44};
  const std::array<std::uint8_t, 1> first{1};
  const std::array<wire::KeyValue, 3> state{wire::KeyValue{wire::kFirmwareKey, firmware},
                                            {wire::kViewKey, view},
                                            {wire::kViewSwitchKey, first}};
  capture.add(112, 56200,
              wire::encode_control_frame(
                  {wire::ControlCommand::push, false, true, 2, wire::encode_list(state)}));
  std::vector<std::size_t> sent;
  for (std::size_t i = 0; i < 500; ++i) {
    if (i % 50 != 49) sent.push_back(i);
  }
  std::swap(sent[20], sent[21]);
  sent.insert(sent.begin() + 100, sent[99]);
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const auto number = static_cast<std::uint16_t>(65'300 + sent[i]);
    capture.add(112, 56300, packet({.number = number, .time_ns = time_of(sent[i])}));
    if (i % 10 == 0) {
      const auto sample = static_cast<std::uint16_t>(i / 10);
      capture.add(112, 56400, packet({.number = sample, .time_ns = time_of(i), .data_type = 0}));
    }
    // A HAP at another clock, which the capture does not name.
    capture.add(100, 57000,
                packet({.number = static_cast<std::uint16_t>(i),
                        .time_ns = 5'000'000'000 + static_cast<std::int64_t>(i) * 212'389,
                        .interval = 2102,
                        .time_type = 0}));
  }
  const Outcome outcome = read_text(kPcapFormat, capture.bytes(), 1000);
  ASSERT_FALSE(outcome.error) << outcome.error->what();
  const RecordingHeader& header = outcome.recording.header;
  ASSERT_EQ(header.devices.size(), 2U);
  EXPECT_EQ(header.devices[0].serial, "47MDGEN2000001");
  EXPECT_EQ(header.devices[0].address, "192.168.1.112");
  EXPECT_EQ(header.device_detail(header.devices[0], "firmware"), "13.18.2.44");
  EXPECT_EQ(header.device_detail(header.devices[0], "field_of_view"),
            "azimuth 10 to 350 deg, elevation -5 to 50 deg");
  EXPECT_EQ(header.devices[1].type, kHap);
  EXPECT_TRUE(header.devices[1].type_inferred);
  EXPECT_THAT(warnings_of(outcome),
              Contains(Warns(kWarning.shots_lost, {"47MDGEN2000001", "9 packets"})));
  EXPECT_THAT(warnings_of(outcome),
              Contains(Warns(kWarning.content_left_out, {"47MDGEN2000001", "1 packets"})));
  TimeAudit audit(header);
  audit.add(outcome.recording.data);
  const TimeAuditResult result = audit.result();
  EXPECT_EQ(result.rows_by_device, (std::vector<std::uint64_t>{490 * 96, 491 * 96}));
  EXPECT_EQ(result.imu, 50U);
  EXPECT_EQ(result.time_resets, 0U);
  EXPECT_EQ(result.numbered_by_device[0]->lost_packets, 9);
  EXPECT_EQ(result.numbered_by_device[1]->lost_packets, 0);
  EXPECT_EQ(result.numbered_by_device[0]->outside_view, 490U);
  EXPECT_EQ(result.no_return, (490U + 491U) * 23);
  EXPECT_EQ(result.numbered_by_device[0]->observations_by_tag[0x10], 490U * 10);

  // The same as LVX 2.
  const TestFolder folder;
  write_all(kLvx2Format, folder.file("a.lvx2"), header, outcome.recording.data);
  const Outcome again = read_all(kLvx2Format, folder.file("a.lvx2"));
  ASSERT_EQ(again.rows().size(), outcome.rows().size());
  EXPECT_EQ(again.rows().azimuth.size(), outcome.rows().azimuth.size());
  EXPECT_EQ(again.rows().intensity, outcome.rows().intensity);
  EXPECT_EQ(again.rows().tag, outcome.rows().tag);
  EXPECT_THAT(warnings_of(again),
              Contains(Warns(kWarning.shots_lost, {"47MDGEN2000001", "9 packets"})));
}

}  // namespace risley::recordings::numbered_capture_test
