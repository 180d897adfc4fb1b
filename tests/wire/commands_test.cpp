// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/commands.hpp"

#include <gtest/gtest.h>

#include "risley/core/error.hpp"

#include "wire/hex.hpp"

namespace risley::wire {
namespace {

// Variants of so many kinds cost the compiler minutes where each test compares and prints them.
bool same(const Command& a, const Command& b) { return a == b; }
bool same(const Reply& a, const Reply& b) { return a == b; }
bool same(const Message& a, const Message& b) { return a == b; }

Frame frame_of(const std::vector<std::uint8_t>& bytes) {
  const auto decoded = decode_frame(bytes);
  if (const auto* refusal = std::get_if<FrameRefusal>(&decoded)) {
    ADD_FAILURE() << to_string(*refusal);
    return {};
  }
  return std::get<Frame>(decoded);
}

/// A frame that some sensor or client has sent means the value, and the value makes the frame.
template <class Value, class Decode>
void expect_frame(const char* digits, const Value& value, FrameType type, std::uint16_t sequence,
                  const Decode& decode) {
  SCOPED_TRACE(digits);
  const auto bytes = bytes_of(digits);
  const Frame frame = frame_of(bytes);
  const auto decoded = decode(frame);
  ASSERT_TRUE(std::holds_alternative<Value>(decoded)) << to_string(std::get<DataFault>(decoded));
  EXPECT_TRUE(same(std::get<Value>(decoded), value));
  EXPECT_EQ(frame.type, type);
  EXPECT_EQ(frame.sequence, sequence);
  EXPECT_EQ(encode(value, sequence), bytes);
}

void expect_command(const char* digits, const Command& command, std::uint16_t sequence = 0) {
  expect_frame(digits, command, FrameType::command, sequence, decode_command);
}
void expect_reply(const char* digits, const Reply& reply, std::uint16_t sequence = 0) {
  expect_frame(digits, reply, FrameType::reply, sequence, decode_reply);
}
void expect_message(const char* digits, const Message& message) {
  expect_frame(digits, message, FrameType::message, 0, decode_message);
}

// Recorded with real sensors, or computed independently of this code.
TEST(Commands, KnownFrames) {
  expect_command("AA0117000000006439 0001 C0A82101BD07E8FD 1E25F912",
                 Handshake{{{192, 168, 33, 1}}, 1981, 65000, {}});
  expect_command("AA0119000001000441 0001 C0A80102C1DACDD8C1DA 02443550",
                 Handshake{{{192, 168, 1, 2}}, 56001, 55501, 56001}, 1);
  expect_command("AA010F0000000004D7 0002 AE8A8A7B", QueryDeviceInfo{});
  expect_command("AA010F0000000004D7 0003 38BA8D0C", Heartbeat{});
  expect_command("AA011000000000B809 0004 01 228D5307", SetSampling{1});
  expect_command("AA011000000000B809 0004 00 B4BD5470", SetSampling{0});
  expect_command("AA011000000000B809 0005 00 F58C4F69", SetCoordinates{0});
  expect_command("AA011000000000B809 0005 01 63BC481E", SetCoordinates{1});
  expect_command("AA010F0000000004D7 0006 B74EE77C", Disconnect{});
  expect_command("AA0117000000006439 010A 14090A11 00E9A435 D0337994",
                 SetUtc{20, 9, 10, 17, 900'000'000});
  expect_reply("AA0110000100006453 0001 00 F1343C29", ResultReply{Handshake::kId, 0});
  expect_reply("AA0116000102004C5B 0003 00010000000000 3E69F023", HeartbeatReply{0, 1, 0, 0}, 2);
  expect_message("AA012200020000597E 0000 3054464447334230303648325A313100 01 0000 34AB3F89",
                 Broadcast{"0TFDG3B006H2Z11", 1, 0});
  expect_message("AA012200020000597E 0000 334A45444B3145303031463633363100 07 E8FD F12FCC6B",
                 Broadcast{"3JEDK1E001F6361", 7, 65000});
}

const Address kSomebody{{10, 0, 0, 7}}, kMask{{255, 255, 255, 0}}, kGateway{{10, 0, 0, 1}};

const std::vector<Command>& all_commands() {
  static const std::vector<Command> commands = [] {
    std::vector<Command> list;
    list.emplace_back(Handshake{kSomebody, 1, 2, {}});
    list.emplace_back(Handshake{kSomebody, 1, 2, 3});
    list.emplace_back(QueryDeviceInfo{});
    list.emplace_back(Heartbeat{});
    list.emplace_back(SetSampling{1});
    list.emplace_back(SetCoordinates{1});
    list.emplace_back(Disconnect{});
    list.emplace_back(SetAddress{true, kSomebody, {}, {}});
    list.emplace_back(SetAddress{false, kSomebody, kMask, kGateway});
    list.emplace_back(QueryAddress{});
    list.emplace_back(Reboot{1234});
    list.emplace_back(WriteParameters{{{1, {1}}, {77, {1, 2, 3, 4}}, {3, {}}}});
    list.emplace_back(ReadParameters{{1, 2, 3}});
    list.emplace_back(ReadParameters{{}});
    list.emplace_back(ResetParameters{false, {}});
    list.emplace_back(ResetParameters{true, {2, 3}});
    list.emplace_back(SetMode{3});
    list.emplace_back(WriteExtrinsics{{{1.5F, -2.0F, 180.0F}, {-1, 0, 2'000'000}}});
    list.emplace_back(ReadExtrinsics{});
    list.emplace_back(SetRainFilter{1});
    list.emplace_back(SetFan{0});
    list.emplace_back(QueryFan{});
    list.emplace_back(SetReturnMode{3});
    list.emplace_back(QueryReturnMode{});
    list.emplace_back(SetImuRate{1});
    list.emplace_back(QueryImuRate{});
    list.emplace_back(SetUtc{26, 12, 31, 23, 3'599'999'999U});
    return list;
  }();
  return commands;
}

const std::vector<Reply>& all_replies() {
  static const std::vector<Reply> replies = [] {
    std::vector<Reply> list;
    list.emplace_back(ResultReply{SetMode::kId, 2});
    list.emplace_back(ResultReply{SetUtc::kId, 1});
    list.emplace_back(DeviceInfo{0, {3, 8, 0, 0}});
    list.emplace_back(HeartbeatReply{0, 0, 1, 77});
    list.emplace_back(AddressReply{0, true, kSomebody, {}, {}});
    list.emplace_back(AddressReply{0, false, kSomebody, kMask, kGateway});
    list.emplace_back(ParametersReply{WriteParameters::kId, 1, 9, 2});
    list.emplace_back(ParametersReply{ResetParameters::kId, 0, 0, 0});
    list.emplace_back(ParameterValues{0, 0, 0, {{1, {1}}, {2, {0}}}});
    list.emplace_back(ExtrinsicsReply{0, {{1, 2, 3}, {4, 5, 6}}});
    list.emplace_back(ValueReply{QueryFan::kId, 0, 1});
    list.emplace_back(ValueReply{QueryReturnMode::kId, 0, 2});
    list.emplace_back(ValueReply{QueryImuRate::kId, 1, 0});
    return list;
  }();
  return replies;
}

TEST(Commands, EveryCommandGoesThereAndBack) {
  for (const Command& command : all_commands()) {
    SCOPED_TRACE(to_string(command_id(command)));
    const auto bytes = encode(command, 4711);
    const auto decoded = decode_command(frame_of(bytes));
    ASSERT_TRUE(std::holds_alternative<Command>(decoded));
    EXPECT_TRUE(same(std::get<Command>(decoded), command));
  }
  std::vector<bool> met(std::variant_size_v<Command>);
  for (const Command& command : all_commands()) met[command.index()] = true;
  EXPECT_EQ(std::ranges::count(met, false), 0);
}

TEST(Commands, EveryReplyGoesThereAndBack) {
  for (const Reply& reply : all_replies()) {
    SCOPED_TRACE(to_string(command_id(reply)));
    const auto bytes = encode(reply, 4711);
    const auto decoded = decode_reply(frame_of(bytes));
    ASSERT_TRUE(std::holds_alternative<Reply>(decoded));
    EXPECT_TRUE(same(std::get<Reply>(decoded), reply));
  }
}

// One byte more or less is refused, unless it makes another whole value.
TEST(Commands, LengthsCount) {
  for (const Command& command : all_commands()) {
    const auto bytes = encode(command, 0);
    const Frame frame = frame_of(bytes);
    std::vector<std::uint8_t> longer(frame.data.begin(), frame.data.end());
    longer.push_back(0);
    EXPECT_TRUE(
        std::holds_alternative<DataFault>(decode_command({frame.type, 0, frame.command, longer})))
        << to_string(frame.command);
    if (frame.data.empty() || std::holds_alternative<WriteParameters>(command)) continue;
    const auto shorter = frame.data.first(frame.data.size() - 1);
    EXPECT_EQ(std::get<DataFault>(decode_command({frame.type, 0, frame.command, shorter})),
              DataFault::length)
        << to_string(frame.command);
  }
}

TEST(Commands, ValuesThatNoCommandHas) {
  const auto fault = [](CommandId command, std::vector<std::uint8_t> data) {
    return std::get<DataFault>(decode_command({FrameType::command, 0, command, data}));
  };
  EXPECT_EQ(fault(SetSampling::kId, {2}), DataFault::value);
  EXPECT_EQ(fault(SetMode::kId, {0}), DataFault::value);
  EXPECT_EQ(fault(SetMode::kId, {4}), DataFault::value);
  EXPECT_EQ(fault(SetReturnMode::kId, {4}), DataFault::value);
  EXPECT_EQ(fault({1, 77}, {}), DataFault::unknown_command);
  EXPECT_EQ(fault(Broadcast::kId, {}), DataFault::unknown_command);
  EXPECT_EQ(to_string(CommandId{1, 77}), "set 1 command 77");
  EXPECT_THROW(encode(Command(SetSampling{2}), 0), InvalidArgument);
  EXPECT_THROW(encode(Command(SetAddress{true, kSomebody, kMask, {}}), 0), InvalidArgument);
  EXPECT_THROW(encode(Command(ReadParameters{std::vector<std::uint16_t>(256)}), 0),
               InvalidArgument);
  EXPECT_THROW(encode(Message(Broadcast{"sixteen letters.", 1, 0}), 0), InvalidArgument);
}

// A name from the network is shown to people and written into files.
TEST(Commands, BroadcastCodesArePlainText) {
  const auto bytes = encode(Message(Broadcast{"0TFDG3B006H2Z11", 1, 0}), 0);
  const Frame frame = frame_of(bytes);
  std::vector<std::uint8_t> data(frame.data.begin(), frame.data.end());
  const auto fault = [&] {
    const auto decoded = decode_message({frame.type, 0, frame.command, data});
    return std::holds_alternative<DataFault>(decoded);
  };
  EXPECT_FALSE(fault());
  for (const int byte : {0x00, 0x1B, 0x20, 0x7F, 0xE4}) {
    data[0] = static_cast<std::uint8_t>(byte);
    EXPECT_TRUE(fault()) << byte;
  }
  data[0] = 'X';
  data[15] = 'X';
  EXPECT_TRUE(fault());
}

TEST(Commands, AddressesAsText) {
  EXPECT_EQ(to_string(kMask), "255.255.255.0");
  EXPECT_EQ(address_from("10.0.0.7"), kSomebody);
  for (const char* wrong : {"", "1.2.3", "1.2.3.4.5", "1.2.3.256", "1.2.3.", "a.b.c.d", "1.2.3.4 ",
                            "01.2.3.4", "-1.2.3.4"}) {
    EXPECT_FALSE(address_from(wrong)) << wrong;
  }
  EXPECT_EQ(firmware_text({3, 8, 0, 6}), "03.08.0006");
}

}  // namespace
}  // namespace risley::wire
