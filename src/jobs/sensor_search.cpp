// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "jobs/sensor_search.hpp"

#include <algorithm>
#include <chrono>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"

namespace risley::jobs {
namespace {

/// Of one network; more are noise.
constexpr std::size_t kMostSensors = 255;

}  // namespace

std::int64_t steady_ns() {
  return std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void require_find_time(const RecordOptions& options) {
  require_between(kSetting.find, options.find_time, 0.1, 3600);
}

BroadcastListener::BroadcastListener(const wire::Interface& interface) {
  // Each receives only packets for its address. Broadcasts come to 255.255.255.255; those of some
  // emulators to the network, or to this host alone.
  const auto listen = [&](std::vector<wire::UdpSocket>& sockets, std::uint16_t port) {
    sockets.emplace_back(wire::Endpoint{wire::kEverybody, port}, 0, interface.name);
    if (interface.broadcast && *interface.broadcast != wire::kEverybody) {
      sockets.emplace_back(wire::Endpoint{*interface.broadcast, port}, 0, interface.name);
    }
  };
  listen(broadcasts_, wire::kBroadcastPort);
  broadcasts_.emplace_back(wire::Endpoint{interface.address, wire::kBroadcastPort});
  listen(answers_, wire::kSearchPort);
  try {
    answers_.emplace_back(wire::Endpoint{interface.address, wire::kSearchPort});
  } catch (const wire::NetworkError&) {
    // Another program, such as a driver, has the port: sensors answer any sender.
    answers_.emplace_back(wire::Endpoint{interface.address, 0});
  }
}

void BroadcastListener::add_to(std::vector<const wire::UdpSocket*>& waiting) const {
  for (const auto* sockets : {&broadcasts_, &answers_}) {
    for (const wire::UdpSocket& socket : *sockets) waiting.push_back(&socket);
  }
}

void BroadcastListener::search(std::int64_t now_ns) {
  constexpr std::int64_t kSearchPeriod = 1'000'000'000;
  if (now_ns < search_due_ns_) return;
  search_due_ns_ = now_ns + kSearchPeriod;
  answers_.back().send(
      {wire::kEverybody, wire::kSearchPort},
      wire::encode_control_frame({wire::ControlCommand::search, false, false, ++sequence_, {}}));
}

std::optional<FoundSensor> BroadcastListener::sensor_of(const wire::UdpSocket::Datagram& datagram,
                                                        bool searched) {
  if (searched) {
    const auto decoded = wire::decode_control_frame(datagram.bytes);
    const auto* frame = std::get_if<wire::ControlFrame>(&decoded);
    const auto reply = frame != nullptr ? wire::search_reply_of(*frame) : std::nullopt;
    if (reply && reply->code == 0 && datagram.from.port == wire::kSearchPort &&
        !reply->serial.empty()) {
      return FoundSensor{reply->serial, reply->device_type, datagram.from.address,
                         reply->command_port};
    }
    // Searches of this host and others, and messages of sensors to their hosts.
    if (frame == nullptr) ++strangers_;
    return std::nullopt;
  }
  const auto decoded = wire::decode_frame(datagram.bytes);
  const auto* frame = std::get_if<wire::Frame>(&decoded);
  // Some sensors broadcast with the type of a command.
  if (frame != nullptr && frame->type != wire::FrameType::reply &&
      datagram.from.port == wire::kSensorPort) {
    const auto meaning = wire::decode_message(*frame);
    const auto* message = std::get_if<wire::Message>(&meaning);
    const auto* broadcast = message != nullptr ? std::get_if<wire::Broadcast>(message) : nullptr;
    if (broadcast != nullptr) {
      return FoundSensor{broadcast->code, broadcast->device_type, datagram.from.address};
    }
  }
  ++strangers_;
  return std::nullopt;
}

std::vector<FoundSensor> BroadcastListener::take() {
  std::vector<FoundSensor> found;
  for (auto* sockets : {&broadcasts_, &answers_}) {
    for (wire::UdpSocket& socket : *sockets) {
      socket.receive([&](const wire::UdpSocket::Datagram& datagram) {
        if (auto sensor = sensor_of(datagram, sockets == &answers_)) {
          found.push_back(std::move(*sensor));
        }
      });
    }
  }
  return found;
}

std::vector<FoundSensor> search_sensors(BroadcastListener& listener, const RecordOptions& options,
                                        const Progress& progress) {
  std::map<std::string, FoundSensor> found;
  std::vector<const wire::UdpSocket*> waiting;
  listener.add_to(waiting);
  const auto wanted = [&](const std::string& serial) {
    return options.serials.empty() || std::find(options.serials.begin(), options.serials.end(),
                                                serial) != options.serials.end();
  };
  const std::int64_t begin = steady_ns();
  const auto time = static_cast<std::int64_t>(1e9 * options.find_time);
  for (std::int64_t passed = 0; passed < time; passed = steady_ns() - begin) {
    progress.report(static_cast<double>(passed) / static_cast<double>(time));
    constexpr std::int64_t kLongestWait = 50'000'000;
    listener.search(begin + passed);
    wire::wait_for(waiting, std::min(time - passed, kLongestWait));
    for (FoundSensor& sensor : listener.take()) {
      if (wanted(sensor.serial) && found.size() < kMostSensors) {
        found.try_emplace(sensor.serial, sensor);
      }
    }
    if (!options.serials.empty() && found.size() == options.serials.size()) break;
  }
  std::vector<FoundSensor> sensors;
  sensors.reserve(found.size());
  for (auto& [serial, sensor] : found) sensors.push_back(std::move(sensor));
  return sensors;
}

std::vector<FoundSensor> find_sensors(const RecordOptions& options, const Progress& progress) {
  require_find_time(options);
  BroadcastListener listener(wire::interface_of(options.interface));
  return search_sensors(listener, options, progress);
}

}  // namespace risley::jobs
