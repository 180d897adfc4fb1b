// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Datagrams of strangers, given to both sides of a session.
#include <algorithm>
#include <array>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/wire/control_client.hpp"
#include "risley/wire/control_frame.hpp"
#include "risley/wire/control_sensor.hpp"
#include "risley/wire/handshake_client.hpp"
#include "risley/wire/handshake_sensor.hpp"

#include "fuzz/invariants.hpp"
#include "fuzz/targets.hpp"

namespace risley::fuzz {
namespace {

using namespace wire;

constexpr Address kHostAddress{{127, 0, 0, 1}}, kStrangerAddress{{127, 0, 0, 9}};
constexpr std::int64_t kStep = 100'000'000;  // ns

/// Datagrams one after the other: a byte says how long each is, and another what is done to it.
template <class Receive>
void for_each_datagram(std::span<const std::uint8_t> bytes, const Receive& receive) {
  while (bytes.size() > 2) {
    const std::size_t length = std::min<std::size_t>(bytes.size() - 2, bytes[0]);
    std::vector<std::uint8_t> datagram(bytes.begin() + 2, bytes.begin() + 2 + length);
    const std::uint8_t how = bytes[1];
    constexpr unsigned kMended = 1;  // no fuzzer finds checksums
    if ((how & kMended) != 0 && length >= kFrameOverhead) {
      datagram[0] = 0xAA;
      datagram[1] = 1;
      io::store<std::uint16_t>(&datagram[2], static_cast<std::uint16_t>(length));
      io::store<std::uint16_t>(&datagram[7], frame_crc16(std::span(datagram).first(7)));
      io::store<std::uint32_t>(&datagram[length - 4],
                               frame_crc32(std::span(datagram).first(length - 4)));
    }
    receive(std::span<const std::uint8_t>(datagram), how);
    bytes = bytes.subspan(2 + length);
  }
}

/// What is decoded makes the same bytes again.
void run_frames(std::span<const std::uint8_t> bytes) {
  for_each_datagram(bytes, [](std::span<const std::uint8_t> datagram, std::uint8_t) {
    const auto decoded = decode_frame(datagram);
    const auto* frame = std::get_if<Frame>(&decoded);
    if (frame == nullptr) {
      require(!to_string(std::get<FrameRefusal>(decoded)).empty(), "a refusal has words");
      return;
    }
    const auto again = encode_frame(*frame);
    require(std::equal(again.begin(), again.end(), datagram.begin(), datagram.end()),
            "a frame is its bytes");
    const auto check = [&](const auto& meaning) {
      if (meaning.index() != 0) return;
      auto encoded = encode(std::get<0>(meaning), frame->sequence);
      const auto read = std::get<Frame>(decode_frame(encoded));
      require(std::equal(read.data.begin(), read.data.end(), frame->data.begin(),
                         frame->data.end()) ||
                  frame->command == Broadcast::kId,  // whose text may be followed by anything
              "data are what they mean");
    };
    check(decode_command(*frame));
    check(decode_reply(*frame));
    check(decode_message(*frame));
  });
}

/// The same of the second generation, whose lists make the same bytes again, too.
void run_control_frames(std::span<const std::uint8_t> bytes) {
  while (bytes.size() > 2) {
    const std::size_t length = std::min<std::size_t>(bytes.size() - 2, bytes[0] + 256U * bytes[1]);
    const auto datagram = bytes.subspan(2, length);
    const auto decoded = decode_control_frame(datagram);
    const auto* frame = std::get_if<ControlFrame>(&decoded);
    if (frame == nullptr) {
      require(!to_string(std::get<FrameRefusal>(decoded)).empty(), "a refusal has words");
    }
    // No fuzzer finds checksums: what stands there is data of every command, too.
    for (const auto command :
         {ControlCommand::search, ControlCommand::set, ControlCommand::get, ControlCommand::push}) {
      for (const bool reply : {false, true}) {
        if (length + kControlHeaderBytes > kMostFrameBytes) continue;
        const auto encoded = encode_control_frame({command, reply, true, 7, datagram});
        const auto read = std::get<ControlFrame>(decode_control_frame(encoded));
        require(std::equal(read.data.begin(), read.data.end(), datagram.begin(), datagram.end()),
                "data are what they were");
        const auto list = list_of(read);
        require(list.size() * 4 <= length, "no more entries than bytes");
        for (const KeyValue& entry : list) {
          require(entry.value.size() <= length, "no longer values than bytes");
          view_of(entry.value);
        }
        if (const auto found = search_reply_of(read)) {
          require(found->serial.size() <= 16, "no longer serial numbers than their field");
        }
      }
    }
    bytes = bytes.subspan(2 + length);
  }
}

void run_sensor(std::span<const std::uint8_t> bytes) {
  std::int64_t now = 0;
  HandshakeSensor sensor({"0TFDG3B006H2Z11", 7, {}, kHostAddress},
                         {true, true, true, true, true, kSensorPort}, now);
  std::optional<Address> host;
  for_each_datagram(bytes, [&](std::span<const std::uint8_t> datagram, std::uint8_t how) {
    constexpr unsigned kFromStranger = 2, kLater = 4;
    const bool stranger = (how & kFromStranger) != 0;
    const bool was_sampling = sensor.sampling(), was_connected = sensor.connected();
    const Endpoint data = sensor.data_target();
    sensor.receive({stranger ? kStrangerAddress : kHostAddress, 1000}, kSensorPort, datagram, now);
    const auto replies = sensor.take_datagrams(now);
    require(replies.size() <= 1, "one reply to a command");
    for (const auto& reply : replies) {
      require(reply.to.has_value(), "replies are not broadcast");
      require(reply.to->address == (stranger ? kStrangerAddress : kHostAddress),
              "replies go to the host that asked");
    }
    if (was_connected && data.address != (stranger ? kStrangerAddress : kHostAddress)) {
      require(sensor.sampling() == was_sampling && sensor.data_target() == data,
              "a stranger changes nothing");
    }
    if ((how & kLater) == 0) return;
    now += kStep * (how >> 3U);
    sensor.advance(now);
    require(sensor.take_datagrams(now).size() <= 2, "a sensor says little on its own");
  });
}

void run_client(std::span<const std::uint8_t> bytes) {
  std::int64_t now = 0;
  HandshakeClient client({kHostAddress, 1, 2, true, ReturnMode::dual, true}, now);
  for_each_datagram(bytes, [&](std::span<const std::uint8_t> datagram, std::uint8_t how) {
    constexpr unsigned kAnswer = 2, kLater = 4;
    std::vector<std::uint8_t> answer(datagram.begin(), datagram.end());
    const auto asked = client.take_datagrams();
    if ((how & kAnswer) != 0 && !asked.empty() && answer.size() >= kFrameOverhead) {
      // The sequence that the client waits for, so that the fuzzer gets on.
      std::copy_n(asked.back().begin() + 5, 2, answer.begin() + 5);
      io::store<std::uint16_t>(&answer[7], frame_crc16(std::span(answer).first(7)));
      io::store<std::uint32_t>(&answer[answer.size() - 4],
                               frame_crc32(std::span(answer).first(answer.size() - 4)));
    }
    client.receive(answer, now);
    require(client.take_events().size() <= 4, "few events of a datagram");
    if ((how & kLater) == 0) return;
    now += kStep * (how >> 3U);
    client.advance(now);
    require(client.take_datagrams().size() <= 4, "few commands at a time");
    client.take_events();
  });
}

/// A datagram of the second generation: no fuzzer finds checksums, so that what stands there is the
/// data of a command.
std::vector<std::uint8_t> control_datagram(std::span<const std::uint8_t> bytes, std::uint8_t how,
                                           std::uint16_t sequence, bool reply) {
  constexpr std::array kCommands = {ControlCommand::get,    ControlCommand::set,
                                    ControlCommand::push,   ControlCommand::search,
                                    ControlCommand::reboot, ControlCommand::factory_reset};
  const auto command = kCommands.at((how >> 1U & 7U) % kCommands.size());
  return encode_control_frame({command, reply, reply, sequence, bytes});
}

void run_control_sensor(std::span<const std::uint8_t> bytes) {
  std::int64_t now = 0;
  std::size_t heard = 0, said = 0;
  ControlSensor sensor({"47MDGEN2000001", 9, {13, 18, 2, 44}, kHostAddress}, now);
  for_each_datagram(bytes, [&](std::span<const std::uint8_t> datagram, std::uint8_t how) {
    constexpr unsigned kBare = 0x80;
    const auto framed = control_datagram(datagram, how, 7, false);
    sensor.receive({kHostAddress, 1000}, kSearchPort,
                   (how & kBare) != 0 ? datagram : std::span<const std::uint8_t>(framed), now);
    now += kStep * (how >> 4U & 7U);
    sensor.advance(now);
    said += sensor.take_datagrams(now).size();
    require(said <= 3 * ++heard, "two replies to a search, one to others, and a push now and then");
    if (sensor.connected()) {
      const Address to = sensor.data_target().address;
      require(to == kHostAddress || (to.bytes[0] >= 224 && to.bytes[0] <= 239),
              "nobody is sent what somebody else asked for");
    }
    require(sensor.data_type() >= 1 && sensor.data_type() <= 3, "a data type of points");
  });
}

void run_control_client(std::span<const std::uint8_t> bytes) {
  std::int64_t now = 0;
  ControlClient client({kHostAddress, 1, 2, true, ReturnMode::dual, true}, 9, now);
  std::uint16_t sequence = 0;
  for_each_datagram(bytes, [&](std::span<const std::uint8_t> datagram, std::uint8_t how) {
    for (const auto& asked : client.take_datagrams()) {
      const auto decoded = decode_control_frame(asked);
      sequence = static_cast<std::uint16_t>(std::get<ControlFrame>(decoded).sequence);
    }
    client.receive(control_datagram(datagram, how, sequence, (how & 0x80U) == 0), now);
    require(client.take_events().size() <= 6, "few events of a datagram");
    now += kStep * (how >> 4U & 7U);
    client.advance(now);
    client.take_events();
  });
}

}  // namespace

std::vector<Target> wire_targets() {
  return {{"wire-frames", run_frames},
          {"control-frames", run_control_frames},
          {"wire-sensor", run_sensor},
          {"wire-client", run_client},
          {"control-sensor", run_control_sensor},
          {"control-client", run_control_client}};
}

}  // namespace risley::fuzz
