// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/control_sensor.hpp"

#include <algorithm>
#include <limits>
#include <string_view>

#include "risley/io/little_endian.hpp"

namespace risley::wire {
namespace {

/// Codes of replies.
constexpr std::uint8_t kDone = 0, kFails = 1, kOutOfRange = 3, kNotSupported = 0x20,
                       kReadOnly = 0x22, kWrongLength = 0x23, kWrongCount = 0x24;
constexpr std::uint8_t kOfMid360 = 1, kOfMid360s = 2, kOfHap = 4, kOfAll = 7, kOfBothMids = 3;
constexpr std::uint16_t kProductKey = 0x8001, kLoaderKey = 0x8003, kHardwareKey = 0x8004,
                        kMacKey = 0x8005, kPowerUpsKey = 0x8008, kLastSyncKey = 0x800A,
                        kStatusCodeKey = 0x800D, kPatternKey = 0x0001;
/// Within the work states, except for the motors.
constexpr std::int64_t kStep = 100'000'000;  // ns

/// A key of a sensor.
struct KeyInfo {
  std::uint16_t key;
  std::uint8_t bytes, of;    ///< length of its value; supporting types
  std::uint8_t most = 0xFF;  ///< greatest value if it has one byte
};

/// In the order used by sensors.
constexpr KeyInfo kKeys[] = {
    {kDataTypeKey, 1, kOfAll, 3},
    {kPatternKey, 1, kOfAll, 2},
    {0x0002, 1, kOfHap, 1},
    {0x0003, 1, kOfHap, 1},
    {kAddressKey, 12, kOfAll},
    {kPushTargetKey, 8, kOfBothMids},
    {kPointTargetKey, 8, kOfAll},
    {kImuTargetKey, 8, kOfAll},
    {0x0009, 8, kOfHap},
    {kAttitudeKey, 24, kOfAll},
    {0x0013, 4, kOfHap},
    {kViewKey, 20, kOfBothMids},
    {kViewKey + 1, 20, kOfBothMids},
    {kViewSwitchKey, 1, kOfBothMids, 3},
    {0x0018, 1, kOfBothMids, 1},
    {0x0019, 4, kOfBothMids},
    {kTargetStateKey, 1, kOfAll, kReadyState},
    {0x001B, 1, kOfHap, 1},
    {kImuSwitchKey, 1, kOfAll, 1},
    {0x001D, 1, kOfHap, 1},
    {0x001E, 1, kOfHap, 1},
    {0x0021, 1, kOfMid360s, 1},
    {0x002B, 3, kOfMid360s},
    {kSerialKey, 16, kOfAll},
    {kProductKey, 64, kOfAll},
    {kFirmwareKey, 4, kOfAll},
    {kLoaderKey, 4, kOfAll},
    {kHardwareKey, 4, kOfAll},
    {kMacKey, 6, kOfAll},
    {kStateKey, 1, kOfAll},
    {kTemperatureKey, 4, kOfBothMids},
    {kPowerUpsKey, 4, kOfBothMids},
    {kClockKey, 8, kOfBothMids},
    {kLastSyncKey, 8, kOfBothMids},
    {0x800B, 8, kOfBothMids},
    {kSyncKey, 1, kOfBothMids},
    {kStatusCodeKey, 32, kOfHap},
    {kDiagnosisKey, 2, kOfAll},
    {0x800F, 1, kOfHap},
    {kFirmwareTypeKey, 1, kOfAll},
    {kFaultsKey, 32, kOfBothMids},
    {0x8012, 1, kOfHap},
};

const KeyInfo& info_of(std::uint16_t key) { return *std::ranges::find(kKeys, key, &KeyInfo::key); }

std::uint8_t kind_of(std::uint8_t device_type) {
  constexpr std::uint8_t kHap = 10, kHapT1 = 15, kMid360s = 35;
  if (device_type == kHap || device_type == kHapT1) return kOfHap;
  return device_type == kMid360s ? kOfMid360s : kOfMid360;
}

bool is_multicast(const Address& address) {
  constexpr std::uint8_t kFirst = 224, kLast = 239;
  return address.bytes[0] >= kFirst && address.bytes[0] <= kLast;
}

}  // namespace

ControlSensor::ControlSensor(SensorIdentity identity, std::int64_t now_ns)
    : SensorSession(std::move(identity)),
      ports_(control_ports(this->identity().device_type)),
      step_due_ns_(std::numeric_limits<std::int64_t>::max()),
      push_due_ns_(now_ns) {
  ahead_ns_ = -now_ns;
  reset_values();
}

void ControlSensor::reset_values() {
  values_.clear();
  for (const KeyInfo& info : kKeys) {
    if ((info.of & kind_of(identity().device_type)) != 0) values_[info.key] = Bytes(info.bytes);
  }
  const auto text = [&](std::uint16_t key, std::string_view words) {
    std::copy_n(words.begin(), std::min(words.size(), values_[key].size()), values_[key].begin());
  };
  const auto& own = identity().address.bytes;
  values_[kDataTypeKey] = {1};
  values_[kAddressKey] = {own[0], own[1], own[2], own[3], 255,    255,
                          255,    0,      own[0], own[1], own[2], 1};
  values_[kTargetStateKey] = {kIdleState};
  values_[kImuSwitchKey] = {1};
  text(kSerialKey, identity().code);
  text(kProductKey, "a virtual sensor");
  values_[kFirmwareKey].assign(identity().firmware.begin(), identity().firmware.end());
  values_[kMacKey] = {2, 0, own[0], own[1], own[2], own[3]};  // administered locally
  values_[kFirmwareTypeKey] = {1};
  if (const auto temperature = values_.find(kTemperatureKey); temperature != values_.end()) {
    constexpr std::int32_t kUsual_cdeg = 5213;
    io::store<std::int32_t>(temperature->second.data(), kUsual_cdeg);
  }
  imu_ = true;
}

std::vector<std::uint16_t> ControlSensor::ports() const {
  std::vector<std::uint16_t> all{kSearchPort,   ports_.command, ports_.push,
                                 ports_.points, ports_.imu,     ports_.log};
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

void ControlSensor::set_clock(std::uint8_t sync, std::int64_t ahead_ns) {
  sync_ = sync;
  ahead_ns_ = ahead_ns;
}

/// Updates values that change by themselves.
void ControlSensor::refresh(std::int64_t now_ns) {
  values_[kStateKey] = {state_};
  const auto clock = values_.find(kClockKey);
  if (clock == values_.end()) return;
  io::store<std::int64_t>(clock->second.data(), now_ns + ahead_ns_);
  values_[kSyncKey] = {sync_};
  if (sync_ != 0) values_[kLastSyncKey] = clock->second;
}

/// Advances one work state towards the requested one.
void ControlSensor::take_step(std::int64_t now_ns) {
  const std::uint8_t wanted = values_[kTargetStateKey][0];
  const bool has_ready = kind_of(identity().device_type) != kOfHap;
  if (wanted == kIdleState) {
    state_ = state_ == kSamplingState && has_ready ? kReadyState : kIdleState;
  } else if (state_ == kIdleState) {
    state_ = kStartingState;
  } else if (state_ == kStartingState || state_ == kSamplingState) {
    state_ = has_ready ? kReadyState : kSamplingState;
  } else {
    state_ = kSamplingState;
  }
  step_due_ns_ = state_ == wanted ? std::numeric_limits<std::int64_t>::max()
                                  : now_ns + (state_ == kStartingState ? kMotorStart : kStep);
  sampling_ = state_ == kSamplingState && connected_;
}

void ControlSensor::advance(std::int64_t now_ns) {
  if (now_ns >= step_due_ns_) take_step(now_ns);
  if (now_ns < push_due_ns_) return;
  push_due_ns_ = now_ns + kPushPeriod;
  // Without a separate target it is sent to the destination of the points.
  const bool has_target = values_.contains(kPushTargetKey);
  auto target = *target_of(values_.at(has_target ? kPushTargetKey : kPointTargetKey));
  if (!has_target) target.host_port = ports_.push;
  if (target.address == Address{}) return;
  refresh(now_ns);
  std::vector<KeyValue> list;
  for (const KeyInfo& info : kKeys) {
    if (const auto found = values_.find(info.key); found != values_.end()) {
      list.push_back({found->first, found->second});
    }
  }
  const auto data = encode_list(list);
  datagrams_.push_back(
      {ports_.push, Endpoint{target.address, target.host_port},
       encode_control_frame({ControlCommand::push, false, true, push_sequence_++, data})});
}

std::int64_t ControlSensor::next_ns() const {
  const std::int64_t next = std::min(step_due_ns_, push_due_ns_);
  return replies_.empty() ? next : std::min(next, replies_.front().first);
}

std::vector<SensorSession::Outgoing> ControlSensor::take_datagrams(std::int64_t now_ns) {
  auto due = SensorSession::take_datagrams(now_ns);
  for (; !replies_.empty() && replies_.front().first <= now_ns; replies_.pop_front()) {
    due.push_back(std::move(replies_.front().second));
  }
  return due;
}

void ControlSensor::receive(const Endpoint& from, std::uint16_t port,
                            std::span<const std::uint8_t> datagram, std::int64_t now_ns) {
  constexpr std::size_t kMostReplies = 256;
  const auto decoded = decode_control_frame(datagram);
  const auto* frame = std::get_if<ControlFrame>(&decoded);
  if (frame == nullptr || replies_.size() >= kMostReplies) {
    ++rejected_;
    return;
  }
  // Of other sensors, and its own, which it receives, too.
  if (frame->reply || frame->from_sensor) return;
  const bool is_search = frame->command == ControlCommand::search;
  const auto data = is_search ? answer_search() : answer(from, *frame, now_ns);
  const Outgoing reply{port, from,
                       encode_control_frame({frame->command, true, true, frame->sequence, data})};
  replies_.emplace_back(now_ns + kReplyDelay, reply);
  // Hosts listen for it at either.
  if (is_search) replies_.emplace_back(now_ns + kReplyDelay, Outgoing{port, {}, reply.bytes});
}

ControlSensor::Bytes ControlSensor::answer_search() const {
  return encode_search_reply(
      {kDone, identity().device_type, identity().code, identity().address, ports_.command});
}

/// Does what a request asks. @return data of the reply
ControlSensor::Bytes ControlSensor::answer(const Endpoint& from, const ControlFrame& frame,
                                           std::int64_t now_ns) {
  constexpr std::size_t kRebootBytes = 2;
  switch (frame.command) {
    case ControlCommand::get:
      return answer_get(frame.data, now_ns);
    case ControlCommand::set:
      return answer_set(from.address, frame, now_ns);
    case ControlCommand::reboot:
      if (frame.data.size() < kRebootBytes) return {kWrongLength};
      reboot_ = std::int64_t{io::load<std::uint16_t>(frame.data.data())} * 1'000'000;
      return {kDone};
    case ControlCommand::factory_reset: {
      // Any data may follow it in hosts' packets.
      const std::string& serial = identity().code;
      if (frame.data.size() < serial.size() ||
          !std::equal(serial.begin(), serial.end(), frame.data.begin())) {
        return {kFails};
      }
      reset_values();
      follow_values(now_ns);
      return {kDone};
    }
    // It has a separate clock, no logs and no other data.
    case ControlCommand::gps_time:
    case ControlCommand::log_switch:
    case ControlCommand::log_time:
    case ControlCommand::raw_data:
      return {kDone};
    default:
      return {kNotSupported};
  }
}

ControlSensor::Bytes ControlSensor::answer_get(std::span<const std::uint8_t> data,
                                               std::int64_t now_ns) {
  constexpr std::size_t kHead = 4;
  if (data.size() < kHead) return encode_list_reply(kWrongLength, {});
  const std::size_t count = io::load<std::uint16_t>(data.data());
  if (data.size() != kHead + 2 * count) return encode_list_reply(kWrongCount, {});
  refresh(now_ns);
  std::vector<KeyValue> list;
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto found = values_.find(io::load<std::uint16_t>(&data[kHead + 2 * i]));
    if (found == values_.end()) return encode_list_reply(kNotSupported, {});
    list.push_back({found->first, found->second});
    bytes += kHead + found->second.size();
  }
  // Keys that are requested repeatedly.
  if (bytes + 3 + kControlHeaderBytes > kMostFrameBytes) return encode_list_reply(kWrongCount, {});
  return encode_list_reply(kDone, list);
}

std::uint8_t ControlSensor::judge(const Address& from, const KeyValue& entry) const {
  const auto known = values_.find(entry.key);
  if (known == values_.end()) return kNotSupported;
  if (entry.key >= kSerialKey) return kReadOnly;
  if (entry.value.size() != known->second.size()) return kWrongLength;
  const std::uint8_t kind = kind_of(identity().device_type);
  if (entry.value.size() == 1) {
    const std::uint8_t value = entry.value[0];
    if (value > info_of(entry.key).most) return kOutOfRange;
    constexpr std::uint8_t kSpherical = 3;
    if (entry.key == kDataTypeKey && (value == 0 || (kind == kOfHap && value == kSpherical))) {
      return kOutOfRange;
    }
    if (entry.key == kPatternKey && kind != kOfHap && value != 0) return kOutOfRange;
    const bool is_state =
        value == kSamplingState || value == kIdleState || (value == kReadyState && kind != kOfHap);
    if (entry.key == kTargetStateKey && !is_state) return kOutOfRange;
  }
  // Its address is the one with which it was started.
  if (entry.key == kAddressKey) return kFails;
  const bool is_target =
      entry.key >= kPushTargetKey && entry.key <= 0x0009 && entry.value.size() == 8;
  if (!is_target) return kDone;
  const HostTarget target = *target_of(entry.value);
  const bool allowed =
      (target.address == from || is_multicast(target.address)) && target.host_port != 0;
  return allowed ? kDone : kOutOfRange;
}

ControlSensor::Bytes ControlSensor::answer_set(const Address& from, const ControlFrame& frame,
                                               std::int64_t now_ns) {
  const auto reply = [](std::uint8_t code, std::uint16_t key) {
    Bytes bytes(3);
    bytes[0] = code;
    io::store<std::uint16_t>(&bytes[1], key);
    return bytes;
  };
  const std::vector<KeyValue> list = list_of(frame);
  std::size_t bytes = 4;
  for (const KeyValue& entry : list) bytes += 4 + entry.value.size();
  if (frame.data.size() != bytes || list.size() != io::load<std::uint16_t>(frame.data.data())) {
    return reply(kWrongCount, 0);
  }
  for (const KeyValue& entry : list) {
    if (const std::uint8_t code = judge(from, entry); code != kDone) return reply(code, entry.key);
  }
  for (const KeyValue& entry : list) {
    Bytes& value = values_[entry.key];
    // Hosts that missed the reply repeat it.
    const bool changes = !std::ranges::equal(value, entry.value);
    if (entry.key == kPointTargetKey && changes) ++handshakes_;
    value.assign(entry.value.begin(), entry.value.end());
  }
  follow_values(now_ns);
  return reply(kDone, 0);
}

/// Applies the settings.
void ControlSensor::follow_values(std::int64_t now_ns) {
  const auto target = [&](std::uint16_t key) {
    const HostTarget to = *target_of(values_.at(key));
    return Endpoint{to.address, to.host_port};
  };
  data_target_ = target(kPointTargetKey);
  imu_target_ = target(kImuTargetKey);
  connected_ = data_target_.port != 0;
  imu_ = values_.at(kImuSwitchKey)[0] != 0 && imu_target_.port != 0;
  sampling_ = state_ == kSamplingState && connected_;
  const bool on_its_way = step_due_ns_ != std::numeric_limits<std::int64_t>::max();
  if (state_ != values_.at(kTargetStateKey)[0] && !on_its_way) take_step(now_ns);
}

}  // namespace risley::wire
