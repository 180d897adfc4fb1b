// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/control_client.hpp"

#include <utility>

namespace risley::wire {
namespace {

constexpr std::uint8_t kMillimetres = 1;  // data type
/// Interval between checks of a sensor that is about to start, ns.
constexpr std::int64_t kImpatient = 200'000'000;
constexpr std::uint16_t kStateKeys[] = {kFirmwareTypeKey, kStateKey, kDiagnosisKey,
                                        kTemperatureKey,  kSyncKey,  kFaultsKey};
constexpr std::size_t kSurelyKnown = 2;  // of these by every sensor

}  // namespace

ControlClient::ControlClient(const ClientSettings& settings, std::uint8_t device_type,
                             std::int64_t now_ns)
    : ClientSession(settings, now_ns), device_type_(device_type) {
  ask_to_identify();
  go_on(now_ns);
}

void ControlClient::ask_to_identify() {
  std::vector<std::uint16_t> keys(kStateKeys,
                                  kStateKeys + (all_keys_ ? std::size(kStateKeys) : kSurelyKnown));
  for (const std::uint16_t key : {kFirmwareKey, kDataTypeKey, kImuSwitchKey}) keys.push_back(key);
  to_ask_.push_back({Purpose::identify, ControlCommand::get, encode_keys(keys), "query"});
}

std::vector<std::uint8_t> ControlClient::heartbeat(std::uint16_t sequence) {
  const auto data =
      encode_keys(std::span(kStateKeys).first(all_keys_ ? std::size(kStateKeys) : kSurelyKnown));
  return encode_control_frame({ControlCommand::get, false, false, sequence, data});
}

ControlClient::Asked ControlClient::set_byte(Purpose purpose, std::uint16_t key, std::uint8_t value,
                                             const char* name) const {
  const KeyValue list[] = {{key, {&value, 1}}};
  return {purpose, ControlCommand::set, encode_list(list), name};
}

void ControlClient::set_up() {
  set_state(ClientState::setting_up);
  set_heartbeat_period(kImpatient);
  const ControlPorts ports = control_ports(device_type_);
  const auto target = [&](std::uint16_t host_port, std::uint16_t sensor_port) {
    return encode_target({settings().host, host_port, sensor_port});
  };
  const auto push = target(settings().command_port, ports.push);
  const auto points = target(settings().data_port, ports.points);
  const auto imu = target(settings().data_port, ports.imu);
  std::vector<KeyValue> targets;
  // Sensors with one port for both push to that.
  if (ports.push != ports.command) targets.push_back({kPushTargetKey, push});
  targets.push_back({kPointTargetKey, points});
  targets.push_back({kImuTargetKey, imu});
  to_ask_.push_back({Purpose::targets, ControlCommand::set, encode_list(targets), "targets"});
  if (settings().spherical && data_type_ != kMillimetres) {
    if (!data_type_before_) data_type_before_ = data_type_;
    to_ask_.push_back(set_byte(Purpose::setting, kDataTypeKey, kMillimetres, "coordinates"));
  }
  const auto wanted_imu = static_cast<std::uint8_t>(settings().imu.value_or(false) ? 1 : 0);
  if (settings().imu && imu_ != wanted_imu) {
    if (!imu_before_) imu_before_ = imu_;
    to_ask_.push_back(set_byte(Purpose::setting, kImuSwitchKey, wanted_imu, "inertial samples"));
  }
  to_ask_.push_back(set_byte(Purpose::start, kTargetStateKey, kSamplingState, "start"));
}

void ControlClient::ask_for_the_end() {
  to_ask_.clear();
  if (data_type_before_) {
    to_ask_.push_back(set_byte(Purpose::restore, kDataTypeKey, *data_type_before_, "coordinates"));
  }
  if (imu_before_) {
    to_ask_.push_back(set_byte(Purpose::restore, kImuSwitchKey, *imu_before_, "inertial samples"));
  }
  to_ask_.push_back(set_byte(Purpose::stop, kTargetStateKey, kIdleState, "stop"));
}

void ControlClient::ask_next(std::int64_t now_ns) {
  if (state() == ClientState::connecting && identified_ && is_application_) {
    if (settings().return_mode) notify(ClientEvent::Kind::refused, 0, "return mode");
    set_up();
  }
  if (to_ask_.empty()) return;
  asked_ = std::move(to_ask_.front());
  to_ask_.pop_front();
  const std::uint16_t sequence = next_sequence();
  send(encode_control_frame({asked_.command, false, false, sequence, asked_.data}), sequence,
       now_ns);
}

void ControlClient::take(std::span<const std::uint8_t> datagram, std::int64_t now_ns) {
  const auto decoded = decode_control_frame(datagram);
  const auto* frame = std::get_if<ControlFrame>(&decoded);
  const bool is_push =
      frame != nullptr && frame->command == ControlCommand::push && !frame->reply && connected();
  if (is_push) {
    note(list_of(*frame));
  } else if (frame == nullptr || !frame->reply || frame->data.empty() ||
             !take_reply(*frame, now_ns)) {
    reject();
    return;
  }
  go_on(now_ns);
}

/// @return whether it answers something
bool ControlClient::take_reply(const ControlFrame& frame, std::int64_t now_ns) {
  const auto sequence = static_cast<std::uint16_t>(frame.sequence);
  const std::uint8_t code = frame.data[0];
  if (frame.command == ControlCommand::get && answers_heartbeat(sequence, now_ns)) {
    note(list_of(frame));
    return true;
  }
  if (frame.command != asked_.command || !answers(sequence, now_ns)) return false;
  const bool good = code == 0;
  switch (asked_.purpose) {
    case Purpose::identify:
      if (!good && all_keys_) {
        all_keys_ = false;
        ask_to_identify();
        break;
      }
      if (!connected()) connect(now_ns);
      take_identity(list_of(frame));
      identified_ = true;
      break;
    case Purpose::targets:
      if (!good) lose("the sensor refuses to send to this address");
      break;
    case Purpose::start:
      if (!good) lose("the sensor refuses to start");
      break;
    case Purpose::setting:
    case Purpose::restore:
      if (!good) notify(ClientEvent::Kind::refused, 0, asked_.name);
      break;
    case Purpose::stop:
      close();
      break;
  }
  return true;
}

void ControlClient::take_identity(std::span<const KeyValue> list) {
  for (const auto& [key, value] : list) {
    if (value.size() == 1 && key == kDataTypeKey) data_type_ = value[0];
    if (value.size() == 1 && key == kImuSwitchKey) imu_ = value[0];
    if (key == kFirmwareKey && !std::exchange(told_firmware_, true)) {
      notify(ClientEvent::Kind::firmware, 0, version_text(value));
    }
  }
  note(list);
}

/// Processes a sensor's report, and follows its work state.
void ControlClient::note(std::span<const KeyValue> list) {
  for (const auto& [key, value] : list) {
    if (key == kFirmwareTypeKey && value.size() == 1) is_application_ = value[0] != 0;
  }
  SensorReport report = report_;
  update_report(report, list);
  if (report != report_) {
    report_ = std::move(report);
    notify(report_);
  }
  const bool samples = report_.work_state == kSamplingState;
  // While a request is pending, the state may be outdated.
  if (state() == ClientState::setting_up && samples && to_ask_.empty() &&
      asked_.purpose == Purpose::start) {
    set_state(ClientState::sampling);
    set_heartbeat_period(kHeartbeatPeriod);
    notify(ClientEvent::Kind::sampling);
  } else if (state() == ClientState::sampling &&
             (report_.work_state == kIdleState || report_.work_state == kReadyState)) {
    set_up();
  }
}

}  // namespace risley::wire
