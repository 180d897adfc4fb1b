// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/control_frame.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

#include "wire/hex.hpp"

namespace risley::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::vector<std::uint8_t> number(std::uint32_t value, std::size_t bytes) {
  std::vector<std::uint8_t> result(4);
  io::store<std::uint32_t>(result.data(), value);
  result.resize(bytes);
  return result;
}

Bytes list(const std::vector<std::pair<std::uint16_t, Bytes>>& entries) {
  std::vector<KeyValue> pairs;
  for (const auto& [key, value] : entries) pairs.push_back({key, value});
  return encode_list(pairs);
}

Bytes reply(const std::vector<std::pair<std::uint16_t, Bytes>>& entries) {
  std::vector<KeyValue> pairs;
  for (const auto& [key, value] : entries) pairs.push_back({key, value});
  return encode_list_reply(0, pairs);
}

Bytes keys(const std::vector<std::uint16_t>& those) { return encode_keys(those); }

Bytes target(std::uint16_t host_port, std::uint16_t sensor_port) {
  const auto value = encode_target({{{192, 168, 1, 5}}, host_port, sensor_port});
  return {value.begin(), value.end()};
}

Bytes search_reply(std::uint8_t type, const char* serial, std::uint8_t last, std::uint16_t port) {
  return encode_search_reply({0, type, serial, {{192, 168, 1, last}}, port});
}

struct Known {
  const char* name;
  ControlCommand command;
  bool reply, from_sensor;
  std::uint32_t sequence;
  Bytes data;
  const char* bytes;
};

// Frames that a known implementation of the protocol sends and accepts.
const std::vector<Known>& known_frames() {
  using enum ControlCommand;
  static const std::vector<Known> frames{
      {"search", search, false, false, 2, {}, "AA00180002000000000000000000000000000A9200000000"},
      {"search reply of a Mid-360", search, true, true, 2,
       search_reply(9, "47MDGEN2000001", 112, 56100),
       "AA003000020000000000 0101 000000000000 293A 269018D3 "
       "000934374D4447454E323030303030310000C0A8017024DB"},
      {"search reply of a HAP", search, true, true, 2,
       search_reply(10, "6FTEGEN2000002", 100, 56000),
       "AA003000020000000000 0101 000000000000 293A 5E6E959C "
       "000A3646544547454E323030303030320000C0A80164C0DA"},
      {"get firmware type", get, false, false, 4, keys({kFirmwareTypeKey}),
       "AA001E00 04000000 0101 0000 000000000000 B0DD 77E3E4DD 010000001080"},
      {"its reply", get, true, true, 4, reply({{kFirmwareTypeKey, {1}}}),
       "AA002000 04000000 0101 0101 000000000000 2296 C5AF2938 0001001080010001"},
      {"hosts of a Mid-360", set, false, false, 6,
       list({{kPushTargetKey, target(56201, 56200)},
             {kPointTargetKey, target(56301, 56300)},
             {kImuTargetKey, target(56401, 56400)}}),
       "AA004000 06000000 0001 0000 000000000000 2B3A CAB502B5 "
       "0300000005000800C0A8010589DB88DB06000800C0A8010"
       "5EDDBECDB07000800C0A8010551DC50DC"},
      {"hosts of a HAP", set, false, false, 6,
       list({{kPointTargetKey, target(57000, 57000)}, {kImuTargetKey, target(58000, 58000)}}),
       "AA003400 06000000 0001 0000 000000000000 CF53 41A12203 "
       "0200000006000800C0A80105A8DEA8DE07000800C0A8010590E290E2"},
      {"set reply",
       set,
       true,
       true,
       6,
       {0, 0, 0},
       "AA001B00 06000000 0001 0101 000000000000 7393 12D941FF 000000"},
      {"set reply, out of range",
       set,
       true,
       true,
       9,
       {3, 0, 0},
       "AA001B00 09000000 0001 0101 000000000000 1E08 4B6707FD 030000"},
      {"start", set, false, false, 8, list({{kTargetStateKey, {1}}}),
       "AA002100 08000000 0001 0000 000000000000 3FB8 6FD5E7AD 010000001A00010001"},
      {"standby", set, false, false, 8, list({{kTargetStateKey, {2}}}),
       "AA002100 08000000 0001 0000 000000000000 3FB8 D584EE34 010000001A00010002"},
      {"data type", set, false, false, 9, list({{kDataTypeKey, {2}}}),
       "AA002100 09000000 0001 0000 000000000000 5EC3 F60BBE1E 010000000000010002"},
      {"inertial samples on", set, false, false, 10, list({{kImuSwitchKey, {1}}}),
       "AA002100 0A000000 0001 0000 000000000000 FD4E CF20A722 010000001C00010001"},
      {"attitude", set, false, false, 11,
       list({{kAttitudeKey, bytes_of("0000803F0000004000004040 0A00000014000000E2FFFFFF")}}),
       "AA003800 0B000000 0001 0000 000000000000 37AF 438F371F "
       "01000000120018000000803F00000040000040400A00000014000000E2FFFFFF"},
      {"field of view", set, false, false, 12,
       list({{kViewKey,
              [] {
                const auto value = encode_view({10, 350, -5, 50});
                return Bytes(value.begin(), value.end());
              }()}}),
       "AA003400 0C000000 0001 0000 000000000000 664E 06C42AA5 "
       "01000000150014000A0000005E010000FBFFFFFF3200000000000000"},
      {"GPS time", gps_time, false, false, 13, bytes_of("0200002A36FE9C9717"),
       "AA002100 0D000000 0202 0000 000000000000 35CD 44EECA6F 0200002A36FE9C9717"},
      {"reboot", reboot, false, false, 14, number(100, 2),
       "AA001A00 0E000000 0002 0000 000000000000 CA02 5CBC4840 6400"},
      {"log on",
       log_switch,
       false,
       false,
       15,
       {0, 1},
       "AA001A00 0F000000 0103 0000 000000000000 CDFD 6922DE36 0001"},
      {"get three keys", get, false, false, 16, keys({kStateKey, kTemperatureKey, kSyncKey}),
       "AA002200 10000000 0101 0000 000000000000 AB12 EF6FED52 03000000068007800C80"},
      {"their reply", get, true, true, 16,
       reply({{kStateKey, {1}}, {kTemperatureKey, number(5213, 4)}, {kSyncKey, {1}}}),
       "AA002D00 10000000 0101 0101 000000000000 0394 9A0DD7E1 "
       "0003000680010001078004005D1400000C80010001"},
      {"push", push, false, true, 3,
       list({{kStateKey, {1}}, {kTemperatureKey, number(5213, 4)}, {kSyncKey, {1}}}),
       "AA002E00 03000000 0201 0001 000000000000 06C1 7B992B9E "
       "030000000680010001078004005D1400000C80010001"},
  };
  return frames;
}

TEST(ControlFrame, KnownFramesBothWays) {
  for (const Known& known : known_frames()) {
    SCOPED_TRACE(known.name);
    const Bytes bytes = bytes_of(known.bytes);
    EXPECT_EQ(encode_control_frame(
                  {known.command, known.reply, known.from_sensor, known.sequence, known.data}),
              bytes);
    const auto decoded = decode_control_frame(bytes);
    const auto* frame = std::get_if<ControlFrame>(&decoded);
    ASSERT_NE(frame, nullptr) << to_string(std::get<FrameRefusal>(decoded));
    EXPECT_EQ(frame->command, known.command);
    EXPECT_EQ(frame->reply, known.reply);
    EXPECT_EQ(frame->from_sensor, known.from_sensor);
    EXPECT_EQ(frame->sequence, known.sequence);
    EXPECT_TRUE(std::ranges::equal(frame->data, known.data));
  }
}

TEST(ControlFrame, ListsAreFoundWhereFramesHaveThem) {
  for (const Known& known : known_frames()) {
    SCOPED_TRACE(known.name);
    const auto found = list_of({known.command, known.reply, known.from_sensor, 0, known.data});
    const bool has_list = known.command == ControlCommand::push ||
                          (known.command == ControlCommand::set && !known.reply) ||
                          (known.command == ControlCommand::get && known.reply);
    EXPECT_EQ(!found.empty(), has_list);
    if (!has_list) continue;
    EXPECT_EQ(known.reply ? encode_list_reply(0, found) : encode_list(found), known.data);
    // Cut anywhere, whole entries are left.
    for (std::size_t length = 0; length < known.data.size(); ++length) {
      const std::span<const std::uint8_t> cut(known.data.data(), length);
      EXPECT_LT(list_of({known.command, known.reply, true, 0, cut}).size(), found.size());
    }
  }
}

TEST(ControlFrame, ValuesOfKeys) {
  const auto view = encode_view({10, 350, -5, 50});
  EXPECT_EQ(view_of(view), (FieldOfView{10, 350, -5, 50}));
  EXPECT_FALSE(view_of(std::span(view).first(19)));
  EXPECT_EQ(version_text(bytes_of("0D12022C")), "13.18.2.44");
  EXPECT_EQ(version_text(bytes_of("0D1202")), "");
  EXPECT_EQ(work_state_words(9), "ready");
  EXPECT_EQ(work_state_words(200), "state 200");
  const Known& found = known_frames()[1];
  const auto searched = search_reply_of({found.command, found.reply, true, 0, found.data});
  ASSERT_TRUE(searched);
  EXPECT_EQ(*searched, (SearchReply{0, 9, "47MDGEN2000001", {{192, 168, 1, 112}}, 56100}));
}

TEST(ControlFrame, EveryChangedByteIsSeen) {
  for (const Known& known : known_frames()) {
    const Bytes bytes = bytes_of(known.bytes);
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      Bytes changed = bytes;
      changed[i] ^= 0x10;
      EXPECT_TRUE(std::holds_alternative<FrameRefusal>(decode_control_frame(changed)))
          << known.name << ", byte " << i;
      EXPECT_TRUE(
          std::holds_alternative<FrameRefusal>(decode_control_frame(std::span(bytes).first(i))));
    }
    Bytes longer = bytes;
    longer.push_back(1);  // what stands behind a frame is not looked at
    EXPECT_TRUE(std::holds_alternative<ControlFrame>(decode_control_frame(longer)));
  }
  EXPECT_THROW(encode_control_frame({.data = Bytes(1377)}), InvalidArgument);
}

}  // namespace
}  // namespace risley::wire
