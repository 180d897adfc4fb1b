// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/control_frame.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"

namespace risley::wire {
namespace {

using io::load;
using io::store;
using Bytes = std::span<const std::uint8_t>;

constexpr std::uint8_t kControlStart = 0xAA, kControlVersion = 0;
constexpr std::size_t kControlLengthAt = 2, kControlSequenceAt = 4, kControlCommandAt = 8,
                      kControlTypeAt = 10, kSenderAt = 11, kHeaderCrcAt = 18, kDataCrcAt = 20;
constexpr std::size_t kSerialBytes = 16, kReplyBytes = 24, kViewBytes = 20, kTargetBytes = 8,
                      kEntryHead = 4;

/// CCITT: polynomial 0x1021, register 0xFFFF at the start.
std::uint16_t control_crc16(Bytes bytes) {
  unsigned rest = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    rest ^= static_cast<unsigned>(byte) << 8U;
    for (int bit = 0; bit < 8; ++bit) {
      rest = (rest & 0x8000U) != 0 ? (rest << 1U) ^ 0x1021U : rest << 1U;
    }
  }
  return static_cast<std::uint16_t>(rest);
}

/// That of zlib.
std::uint32_t control_crc32(Bytes bytes) {
  std::uint32_t rest = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) {
    rest ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      rest = (rest & 1U) != 0 ? (rest >> 1U) ^ 0xEDB88320U : rest >> 1U;
    }
  }
  return ~rest;
}

void append_u16(std::vector<std::uint8_t>& bytes, std::size_t value) {
  bytes.resize(bytes.size() + 2);
  store<std::uint16_t>(&bytes[bytes.size() - 2], static_cast<std::uint16_t>(value));
}

void append_entries(std::vector<std::uint8_t>& bytes, std::span<const KeyValue> list) {
  for (const KeyValue& entry : list) {
    append_u16(bytes, entry.key);
    append_u16(bytes, entry.value.size());
    bytes.insert(bytes.end(), entry.value.begin(), entry.value.end());
  }
}

}  // namespace

std::vector<std::uint8_t> encode_control_frame(const ControlFrame& frame) {
  const std::size_t length = kControlHeaderBytes + frame.data.size();
  if (length > kMostFrameBytes) {
    throw InvalidArgument(fmt::format("a frame with {} bytes of data, allowed at most {}",
                                      frame.data.size(), kMostFrameBytes - kControlHeaderBytes));
  }
  std::vector<std::uint8_t> bytes(length);
  bytes[0] = kControlStart;
  bytes[1] = kControlVersion;
  store<std::uint16_t>(&bytes[kControlLengthAt], static_cast<std::uint16_t>(length));
  store<std::uint32_t>(&bytes[kControlSequenceAt], frame.sequence);
  store<std::uint16_t>(&bytes[kControlCommandAt], static_cast<std::uint16_t>(frame.command));
  bytes[kControlTypeAt] = frame.reply ? 1 : 0;
  bytes[kSenderAt] = frame.from_sensor ? 1 : 0;
  store<std::uint16_t>(&bytes[kHeaderCrcAt], control_crc16(Bytes(bytes).first(kHeaderCrcAt)));
  const std::uint32_t checksum = frame.data.empty() ? 0 : control_crc32(frame.data);
  store<std::uint32_t>(&bytes[kDataCrcAt], checksum);
  std::ranges::copy(frame.data, bytes.begin() + kControlHeaderBytes);
  return bytes;
}

std::variant<ControlFrame, FrameRefusal> decode_control_frame(Bytes bytes) {
  const auto refuse = [](FrameFault fault, std::size_t expected, std::size_t found) {
    return FrameRefusal{fault, static_cast<std::uint32_t>(expected),
                        static_cast<std::uint32_t>(found)};
  };
  if (bytes.size() < kControlHeaderBytes) {
    return refuse(FrameFault::too_short, kControlHeaderBytes, bytes.size());
  }
  if (bytes[0] != kControlStart) return refuse(FrameFault::start, kControlStart, bytes[0]);
  if (bytes[1] != kControlVersion) return refuse(FrameFault::version, kControlVersion, bytes[1]);
  const auto length = load<std::uint16_t>(&bytes[kControlLengthAt]);
  if (length < kControlHeaderBytes || length > std::min(bytes.size(), kMostFrameBytes)) {
    return refuse(FrameFault::length, std::min(bytes.size(), kMostFrameBytes), length);
  }
  const auto header = load<std::uint16_t>(&bytes[kHeaderCrcAt]);
  if (const auto right = control_crc16(bytes.first(kHeaderCrcAt)); header != right) {
    return refuse(FrameFault::header_checksum, right, header);
  }
  if (bytes[kControlTypeAt] > 1) return refuse(FrameFault::type, 1, bytes[kControlTypeAt]);
  const Bytes data = bytes.subspan(kControlHeaderBytes, length - kControlHeaderBytes);
  const auto checksum = load<std::uint32_t>(&bytes[kDataCrcAt]);
  if (const auto right = data.empty() ? 0 : control_crc32(data); checksum != right) {
    return refuse(FrameFault::checksum, right, checksum);
  }
  return ControlFrame{static_cast<ControlCommand>(load<std::uint16_t>(&bytes[kControlCommandAt])),
                      bytes[kControlTypeAt] == 1, bytes[kSenderAt] == 1,
                      load<std::uint32_t>(&bytes[kControlSequenceAt]), data};
}

std::vector<KeyValue> list_of(const ControlFrame& frame) {
  Bytes rest = frame.data;
  std::size_t count = 0;
  const bool is_request =
      frame.command == ControlCommand::set || frame.command == ControlCommand::push;
  if (is_request && !frame.reply && rest.size() >= 4) {
    count = load<std::uint16_t>(rest.data());
    rest = rest.subspan(4);
  } else if (frame.command == ControlCommand::get && frame.reply && rest.size() >= 3) {
    count = load<std::uint16_t>(rest.data() + 1);
    rest = rest.subspan(3);
  }
  std::vector<KeyValue> list;
  for (; count > 0 && rest.size() >= kEntryHead; --count) {
    const auto length = load<std::uint16_t>(rest.data() + 2);
    if (length > rest.size() - kEntryHead) break;
    list.push_back({load<std::uint16_t>(rest.data()), rest.subspan(kEntryHead, length)});
    rest = rest.subspan(kEntryHead + length);
  }
  return list;
}

std::vector<std::uint8_t> encode_list(std::span<const KeyValue> list) {
  std::vector<std::uint8_t> bytes;
  append_u16(bytes, list.size());
  append_u16(bytes, 0);
  append_entries(bytes, list);
  return bytes;
}

std::vector<std::uint8_t> encode_keys(std::span<const std::uint16_t> keys) {
  std::vector<std::uint8_t> bytes;
  append_u16(bytes, keys.size());
  append_u16(bytes, 0);
  for (const std::uint16_t key : keys) append_u16(bytes, key);
  return bytes;
}

std::vector<std::uint8_t> encode_list_reply(std::uint8_t code, std::span<const KeyValue> list) {
  std::vector<std::uint8_t> bytes{code};
  append_u16(bytes, list.size());
  append_entries(bytes, list);
  return bytes;
}

std::optional<SearchReply> search_reply_of(const ControlFrame& frame) {
  if (frame.command != ControlCommand::search || !frame.reply || frame.data.size() < kReplyBytes) {
    return std::nullopt;
  }
  const std::uint8_t* at = frame.data.data();
  SearchReply reply;
  reply.code = at[0];
  reply.device_type = at[1];
  reply.serial.assign(at + 2, std::find(at + 2, at + 2 + kSerialBytes, std::uint8_t{0}));
  std::copy_n(at + 18, 4, reply.address.bytes.begin());
  reply.command_port = load<std::uint16_t>(at + 22);
  return reply;
}

std::vector<std::uint8_t> encode_search_reply(const SearchReply& reply) {
  std::vector<std::uint8_t> bytes(kReplyBytes);
  bytes[0] = reply.code;
  bytes[1] = reply.device_type;
  std::copy_n(reply.serial.begin(), std::min(reply.serial.size(), kSerialBytes), &bytes[2]);
  std::copy_n(reply.address.bytes.begin(), 4, &bytes[18]);
  store<std::uint16_t>(&bytes[22], reply.command_port);
  return bytes;
}

std::array<std::uint8_t, 8> encode_target(const HostTarget& target) {
  std::array<std::uint8_t, kTargetBytes> value{};
  std::copy_n(target.address.bytes.begin(), 4, value.begin());
  store<std::uint16_t>(&value[4], target.host_port);
  store<std::uint16_t>(&value[6], target.sensor_port);
  return value;
}

std::optional<HostTarget> target_of(Bytes value) {
  if (value.size() != kTargetBytes) return std::nullopt;
  HostTarget target;
  std::copy_n(value.begin(), 4, target.address.bytes.begin());
  target.host_port = load<std::uint16_t>(&value[4]);
  target.sensor_port = load<std::uint16_t>(&value[6]);
  return target;
}

ControlPorts control_ports(std::uint8_t device_type) {
  constexpr std::uint8_t kHap = 10, kHapT1 = 15;
  if (device_type == kHap || device_type == kHapT1) {
    return {kSearchPort, 56000, 56000, 57000, 58000, 59000};
  }
  return {};
}

void update_report(SensorReport& report, std::span<const KeyValue> list) {
  constexpr std::size_t kMostFaults = 8;
  for (const auto& [key, value] : list) {
    const std::size_t size = value.size();
    if (key == kStateKey && size == 1) report.work_state = value[0];
    if (key == kSyncKey && size == 1) report.sync = value[0];
    if (key == kTemperatureKey && size == 4)
      report.temperature_cdeg = load<std::int32_t>(value.data());
    if (key == kDiagnosisKey && size == 2) report.diagnosis = load<std::uint16_t>(value.data());
    if (key != kFaultsKey) continue;
    report.faults.clear();
    for (std::size_t at = 0; at + 4 <= size && report.faults.size() < kMostFaults; at += 4) {
      const auto fault = load<std::uint32_t>(&value[at]);
      if (fault != 0) report.faults.push_back(fault);
    }
  }
}

std::vector<std::string> trouble_words(const SensorReport& report) {
  constexpr std::array kParts{"system", "scanner", "ranging", "communication"};
  constexpr std::array kHow{"", "warning", "error", "stopped for safety"};
  constexpr std::array kLevels{"", "info", "warning", "error", "fatal"};
  std::vector<std::string> words;
  for (std::size_t i = 0; i < kParts.size(); ++i) {
    const unsigned value = report.diagnosis.value_or(0) >> (4 * i) & 0xFU;
    if (value == 0) continue;
    words.push_back(
        fmt::format("{}: {}", kParts[i], value < kHow.size() ? kHow[value] : "unknown"));
  }
  for (const std::uint32_t fault : report.faults) {
    const std::uint32_t level = fault & 0xFFFFU;
    words.push_back(fmt::format("fault {:04X}: {}", fault >> 16U,
                                level > 0 && level < kLevels.size() ? kLevels[level] : "unknown"));
  }
  return words;
}

std::optional<FieldOfView> view_of(Bytes value) {
  if (value.size() != kViewBytes) return std::nullopt;
  const auto number = [&](std::size_t i) { return load<std::int32_t>(&value[4 * i]); };
  return FieldOfView{number(0), number(1), number(2), number(3)};
}

std::array<std::uint8_t, 20> encode_view(const FieldOfView& view) {
  std::array<std::uint8_t, kViewBytes> value{};
  store<std::int32_t>(&value[0], view.yaw_start_deg);
  store<std::int32_t>(&value[4], view.yaw_stop_deg);
  store<std::int32_t>(&value[8], view.pitch_start_deg);
  store<std::int32_t>(&value[12], view.pitch_stop_deg);
  return value;
}

std::string version_text(Bytes value) {
  if (value.size() != 4) return {};
  return fmt::format("{}.{}.{}.{}", value[0], value[1], value[2], value[3]);
}

std::string work_state_words(std::uint8_t state) {
  static constexpr std::array kWords{"",        "sampling",  "idle",           "sleep",
                                     "error",   "self-test", "motor starting", "motor stopping",
                                     "upgrade", "ready"};
  if (state > 0 && state < kWords.size()) return kWords[state];
  return fmt::format("state {}", state);
}

}  // namespace risley::wire
