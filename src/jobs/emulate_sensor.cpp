// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/emulate_sensor.hpp"

#include <algorithm>
#include <chrono>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/random.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"
#include "risley/wire/control_sensor.hpp"
#include "risley/wire/handshake_sensor.hpp"
#include "risley/wire/udp_socket.hpp"

#include "jobs/emulated_scan.hpp"
#include "jobs/sensor_search.hpp"

namespace risley::jobs {
namespace {

constexpr std::int64_t kEmulatedSecond = 1'000'000'000;  // ns
constexpr std::int64_t kImuStep = 5'000'000;             // ns of the sensor's clock
constexpr std::int64_t kLongestRest = 20'000'000, kShortestRest = 200'000;  // ns
constexpr int kPacketsAtOnce = 256;
constexpr double kFastest = 100;
constexpr std::int64_t kFarthestJump = 3600;  // s
/// Of a status: the time source of the clock.
constexpr std::uint32_t kPpsSignal = 1U << 9U, kPtpSignal = 1U << 13U, kSyncByPtp = 1U << 14U,
                        kSyncByPps = 3U << 14U;

/// Capabilities of a sensor type. @param device_type  as recordings::Device::type
wire::SensorAbilities abilities_of(std::uint8_t device_type) {
  const bool is_avia = device_type == recordings::kAvia;
  wire::SensorAbilities abilities;
  abilities.return_modes = device_type != recordings::kMid40;
  abilities.triple = abilities.scan_pattern = is_avia;
  abilities.imu = recordings::livox::has_imu(device_type);
  abilities.high_sensitivity = is_avia || device_type == recordings::kTele15;
  if (is_avia) abilities.reserved = wire::kSensorPort;
  return abilities;
}

/// Random decisions with a given share, in sequence; each purpose has its own, so that one fault
/// does not move others.
class Chance {
 public:
  Chance(std::uint64_t seed, std::uint64_t purpose, double share)
      : random_(seed, purpose), share_(share) {}
  bool falls() { return share_ > 0 && random_.uniform(index_++) < share_; }
  /// A whole number from 1 to the largest.
  int count(int most) {
    return 1 + std::min(most - 1, static_cast<int>(random_.uniform(index_++) * most));
  }

 private:
  RandomStream random_;
  double share_;
  std::uint64_t index_ = 0;
};

/// A packet to send.
struct Outgoing {
  std::vector<std::uint8_t> bytes;
  wire::Endpoint to;
  std::uint64_t number = 0;
  std::size_t rows = 0;
  std::int64_t due_ns = 0;
  bool twice = false;  ///< it has a copy
};

/// Data from a start to a stop.
struct Stream {
  std::uint8_t data_type = 0;
  std::int64_t first_ns = 0;  ///< of the sensor's clock
  std::int64_t begin_ns = 0;  ///< of real time
  std::uint64_t number = 0;   ///< packets since then
  std::uint64_t of_all = 0;   ///< packets since the start, of all types
  std::uint64_t imu_number = 0;
  bool sent_any = false;
  std::uint64_t pending_lost = 0;
  std::uint64_t last_sent = 0;
};

class Emulator {
 public:
  Emulator(const EmulateOptions& options, const EmulateNote& note, const Progress& progress)
      : options_(options),
        note_(note),
        progress_(progress),
        scan_(options.simulation, options.recording, options.faults.bend),
        rate_(options.speed * (1 + 1e-6 * options.clock.drift_ppm)),
        interface_(wire::interface_of(options.interface)),
        loss_(options.simulation.seed, 101, options.faults.loss),
        duplication_(options.simulation.seed, 102, options.faults.duplication),
        disorder_(options.simulation.seed, 103, options.faults.disorder),
        damage_(options.simulation.seed, 104, options.faults.wrong_checksums) {
    identity_.code = options.serial.empty() ? scan_.device().serial : options.serial;
    if (identity_.code.empty()) {
      throw InvalidArgument(fmt::format("{} = {}: does not name its serial number; choose one",
                                        name_of(kSetting.recording), options.recording));
    }
    identity_.device_type = scan_.device().type;
    identity_.firmware = {3, 8, 0, 0};
    if (scan_.numbered()) identity_.firmware = {13, 18, 2, 44};
    identity_.address = interface_.address;
    if (scan_.numbered() && options.faults.heartbeat_dies) {
      throw InvalidArgument(fmt::format("{}: sensors of the second generation have no heartbeat",
                                        name_of(kSetting.heartbeat_dies)));
    }
    session_ = make_session(0);
    open_sockets();
  }

  EmulatedSensor run();

 private:
  std::unique_ptr<wire::SensorSession> make_session(std::int64_t now) const;
  void open_sockets();
  const wire::UdpSocket& socket_of(std::uint16_t port) const;
  void power_on(std::int64_t now);
  void power_off(std::int64_t now, std::int64_t time_ns);
  void end_session();
  void take_commands(std::int64_t now);
  void say(std::int64_t now);
  void follow_session(std::int64_t now);
  void start_stream(std::int64_t now);
  void end_stream(std::int64_t now);
  void send_due(std::int64_t now);
  void make_packet(std::int64_t now);
  void let_go(std::int64_t now, bool all);
  void send(const Outgoing& packet);
  std::int64_t clock_ns(std::int64_t now) const {
    return static_cast<std::int64_t>(static_cast<double>(now - power_on_ns_) * rate_);
  }
  std::int64_t rest_until(std::int64_t now) const;
  void set_clock(std::int64_t now);
  std::int64_t stamp(std::int64_t time_ns) const { return time_ns + epoch_ns_; }
  std::int64_t next_time_ns(std::int64_t now) const;

  const EmulateOptions& options_;
  const EmulateNote& note_;
  const Progress& progress_;
  EmulatedScan scan_;
  double rate_;  ///< of its clock, to this machine's
  /// Since power-on, on its clock.
  std::int64_t epoch_ns_ = 0;
  bool has_source_ = false, has_jumped_ = false;
  wire::Interface interface_;
  std::vector<wire::UdpSocket> sockets_;         // one for each port
  std::vector<wire::UdpSocket> public_sockets_;  // for broadcasts
  Chance loss_, duplication_, disorder_, damage_;
  wire::SensorIdentity identity_;
  std::unique_ptr<wire::SensorSession> session_;
  std::optional<Stream> stream_;
  std::multimap<std::uint64_t, Outgoing> overtaken_;  // by the packet that they follow
  std::deque<Outgoing> delayed_;
  std::set<std::uint64_t> sent_once_;  // whose copy must still be sent
  std::int64_t power_on_ns_ = 0, dead_until_ns_ = 0;
  std::optional<std::int64_t> first_start_ns_;
  bool restarted_ = false, heart_dead_ = false, heart_died_ = false;
  EmulatedSensor truth_;
};

std::unique_ptr<wire::SensorSession> Emulator::make_session(std::int64_t now) const {
  if (scan_.numbered()) return std::make_unique<wire::ControlSensor>(identity_, now);
  return std::make_unique<wire::HandshakeSensor>(identity_, abilities_of(identity_.device_type),
                                                 now);
}

void Emulator::open_sockets() {
  for (const std::uint16_t port : session_->ports()) {
    sockets_.emplace_back(wire::Endpoint{interface_.address, port});
  }
  const std::uint16_t port = session_->public_port();
  if (port == 0) return;
  public_sockets_.emplace_back(wire::Endpoint{wire::kEverybody, port}, 0, interface_.name);
  if (interface_.broadcast && *interface_.broadcast != wire::kEverybody) {
    public_sockets_.emplace_back(wire::Endpoint{*interface_.broadcast, port}, 0, interface_.name);
  }
}

const wire::UdpSocket& Emulator::socket_of(std::uint16_t port) const {
  return *std::ranges::find(sockets_, port, [](const auto& one) { return one.local().port; });
}

void Emulator::power_on(std::int64_t now) {
  power_on_ns_ = now;
  epoch_ns_ = 0;
  has_source_ = false;
  scan_.begin();
  session_ = make_session(now);
}

void Emulator::power_off(std::int64_t now, std::int64_t time_ns) {
  end_stream(now);
  end_session();
  dead_until_ns_ = now + time_ns;
}

/// Acquires its time source and lets its clock jump when it is time.
void Emulator::set_clock(std::int64_t now) {
  if (!first_start_ns_) return;
  const EmulatedClock& clock = options_.clock;
  const double since_start = 1e-9 * static_cast<double>(now - *first_start_ns_);
  const bool synchronised = clock.source != recordings::TimeReference::power_on;
  if (synchronised && !has_source_ && since_start >= clock.source_from) {
    has_source_ = true;
    const bool by_ptp = clock.source == recordings::TimeReference::ptp;
    if (by_ptp || scan_.numbered()) {
      // Whole microseconds, as its own times have.
      constexpr std::int64_t kMicrosecond = 1000;
      const std::int64_t here = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                    std::chrono::system_clock::now().time_since_epoch())
                                    .count();
      epoch_ns_ = (here - clock_ns(now)) / kMicrosecond * kMicrosecond;
    } else {
      epoch_ns_ = kFarthestJump * kEmulatedSecond;  // so that it can jump back
    }
    scan_.set_header(clock.source, by_ptp ? kPtpSignal | kSyncByPtp : kPpsSignal | kSyncByPps);
    if (clock.source_from > 0 && stream_) {
      ++truth_.clock_jumps;
      note_(fmt::format("it now uses the time of {}", to_string(clock.source)));
    }
  }
  if (clock.jump && !has_jumped_ && since_start >= *clock.jump) {
    has_jumped_ = true;
    // A clock does not go below zero.
    const std::int64_t jump_ns =
        std::max(static_cast<std::int64_t>(1e9 * clock.jump_by), -stamp(next_time_ns(now)));
    epoch_ns_ += jump_ns;
    ++truth_.clock_jumps;
    note_(fmt::format("its clock jumps by {:.9g} s", 1e-9 * static_cast<double>(jump_ns)));
  }
  constexpr std::uint8_t kPtp = 1, kGps = 2;  // SensorReport::sync
  std::uint8_t sync = 0;
  if (has_source_) sync = clock.source == recordings::TimeReference::ptp ? kPtp : kGps;
  if (session_) session_->set_clock(sync, stamp(clock_ns(now)) - now);
}

/// Of the next packet, since power-on.
std::int64_t Emulator::next_time_ns(std::int64_t now) const {
  if (!stream_) return clock_ns(now);
  const std::int64_t packet =
      stream_->first_ns + scan_.time_of(stream_->number, stream_->data_type);
  if (!session_->imu()) return packet;
  return std::min(packet, static_cast<std::int64_t>(stream_->imu_number) * kImuStep);
}

void Emulator::end_session() {
  if (!session_) return;
  truth_.rejected += session_->rejected();
  truth_.sessions += session_->handshakes();
  session_.reset();
}

void Emulator::take_commands(std::int64_t now) {
  for (auto* sockets : {&sockets_, &public_sockets_}) {
    for (wire::UdpSocket& socket : *sockets) {
      socket.receive([&](const wire::UdpSocket::Datagram& datagram) {
        if (!session_) return;
        if (heart_dead_) {
          const auto decoded = wire::decode_frame(datagram.bytes);
          const auto* frame = std::get_if<wire::Frame>(&decoded);
          if (frame != nullptr && frame->command == wire::Heartbeat::kId) return;
        }
        session_->receive(datagram.from, socket.local().port, datagram.bytes, now);
        follow_session(now);
      });
    }
  }
}

void Emulator::say(std::int64_t now) {
  if (!session_) return;
  session_->advance(now);
  follow_session(now);
  for (auto& datagram : session_->take_datagrams(now)) {
    if (damage_.falls()) {
      datagram.bytes.back() ^= 1U;
      ++truth_.wrong_checksums;
    }
    const wire::Endpoint everybody{wire::kEverybody, session_->broadcast_port()};
    socket_of(datagram.from).send(datagram.to.value_or(everybody), datagram.bytes);
  }
}

/// Starts, stops and changes the data according to commands.
void Emulator::follow_session(std::int64_t now) {
  if (!session_->connected()) heart_dead_ = false;
  if (!session_->sampling()) {
    end_stream(now);
  } else if (!stream_) {
    start_stream(now);
  } else if (stream_->data_type != session_->data_type()) {
    // The next packet follows the last one.
    Stream& stream = *stream_;
    const std::int64_t passed = scan_.time_of(stream.number, stream.data_type);
    stream.first_ns += passed;
    stream.begin_ns += static_cast<std::int64_t>(static_cast<double>(passed) / rate_);
    stream.number = 0;
    stream.data_type = session_->data_type();
  }
  if (const auto delay = session_->take_reboot()) {
    // The reply goes out first.
    for (const auto& datagram : session_->take_datagrams(now + kEmulatedSecond)) {
      if (datagram.to) socket_of(datagram.from).send(*datagram.to, datagram.bytes);
    }
    ++truth_.restarts;
    note_("restarts on command");
    power_off(now, *delay + static_cast<std::int64_t>(1e9 * options_.faults.restart_time));
  }
}

void Emulator::start_stream(std::int64_t now) {
  constexpr std::int64_t kClockStep = 1000;
  Stream stream;
  stream.data_type = session_->data_type();
  stream.first_ns = clock_ns(now) / kClockStep * kClockStep;
  stream.begin_ns = now;
  stream.imu_number = static_cast<std::uint64_t>(stream.first_ns / kImuStep) + 1;
  stream_ = stream;
  if (!first_start_ns_) first_start_ns_ = now;
  note_(fmt::format("sends data of type {} to {}", stream.data_type,
                    to_string(session_->data_target())));
}

void Emulator::end_stream(std::int64_t now) {
  if (!stream_) return;
  let_go(now, true);
  sent_once_.clear();
  truth_.lost_at_ends += stream_->pending_lost;
  stream_.reset();
}

void Emulator::send_due(std::int64_t now) {
  if (!stream_) return;
  Stream& stream = *stream_;
  const auto passed = static_cast<std::int64_t>(static_cast<double>(now - stream.begin_ns) * rate_);
  const std::uint64_t due = scan_.packets_in(passed, stream.data_type) + 1;
  const std::uint64_t behind = due - std::min(due, stream.number);
  truth_.behind =
      std::max(truth_.behind, 1e-9 * static_cast<double>(scan_.time_of(behind, stream.data_type)));
  for (int i = 0; i < kPacketsAtOnce && stream.number < due; ++i) make_packet(now);
  let_go(now, false);
}

void Emulator::make_packet(std::int64_t now) {
  Stream& stream = *stream_;
  const std::int64_t time_ns = stream.first_ns + scan_.time_of(stream.number, stream.data_type);
  const auto delay_ns = static_cast<std::int64_t>(1e9 * options_.faults.delay);
  if (session_->imu() && static_cast<std::int64_t>(stream.imu_number) * kImuStep <= time_ns) {
    const auto sample = scan_.imu(stamp(static_cast<std::int64_t>(stream.imu_number++) * kImuStep));
    if (socket_of(session_->imu_port()).send(session_->imu_target(), sample)) {
      ++truth_.packets;
      ++truth_.imu_samples;
    } else {
      ++truth_.unsent;
      ++truth_.lost;
    }
  }
  const auto bytes = scan_.next(stream.data_type, stamp(time_ns));
  const std::uint64_t number = stream.of_all++;
  ++stream.number;
  if (loss_.falls()) {
    ++stream.pending_lost;
  } else {
    (stream.sent_any ? truth_.lost : truth_.lost_at_ends) += std::exchange(stream.pending_lost, 0);
    stream.sent_any = true;
    const auto place = [&] {
      return number + (disorder_.falls()
                           ? static_cast<std::uint64_t>(disorder_.count(options_.faults.farthest))
                           : 0);
    };
    const Outgoing packet{
        {bytes.begin(), bytes.end()}, session_->data_target(), number,
        scan_.rows(stream.data_type), now + delay_ns,          duplication_.falls()};
    overtaken_.emplace(place(), packet);
    if (packet.twice) overtaken_.emplace(place(), packet);
  }
}

/// Sends what waits no longer. @param all  nothing waits
void Emulator::let_go(std::int64_t now, bool all) {
  while (!overtaken_.empty() && (all || overtaken_.begin()->first < stream_->of_all)) {
    delayed_.push_back(std::move(overtaken_.begin()->second));
    overtaken_.erase(overtaken_.begin());
  }
  while (!delayed_.empty() && (all || delayed_.front().due_ns <= now)) {
    send(delayed_.front());
    delayed_.pop_front();
  }
}

void Emulator::send(const Outgoing& packet) {
  const bool sent = socket_of(session_->data_port()).send(packet.to, packet.bytes);
  // Of two copies only the one sent first counts.
  if (packet.twice && !sent_once_.insert(packet.number).second) {
    sent_once_.erase(packet.number);
    if (sent) ++truth_.duplicates;
    return;
  }
  if (!sent) {
    ++truth_.unsent;
    ++truth_.lost;
    return;
  }
  ++truth_.packets;
  truth_.rows += packet.rows;
  if (packet.number < stream_->last_sent) ++truth_.reordered;
  stream_->last_sent = std::max(stream_->last_sent, packet.number);
}

std::int64_t Emulator::rest_until(std::int64_t now) const {
  std::int64_t until = now + kLongestRest;
  if (session_) until = std::min(until, session_->next_ns());
  if (stream_) {
    const auto due = static_cast<std::int64_t>(
        static_cast<double>(scan_.time_of(stream_->number, stream_->data_type)) / rate_);
    until = std::min(until, std::max(stream_->begin_ns + due, now + kShortestRest));
  }
  if (!delayed_.empty()) until = std::min(until, delayed_.front().due_ns);
  return until;
}

EmulatedSensor Emulator::run() {
  const std::int64_t begin = steady_ns();
  const auto duration = static_cast<std::int64_t>(1e9 * options_.duration.value_or(0));
  power_on(begin);
  note_(fmt::format("{}, a {}, at {}", identity_.code,
                    recordings::device_type_name(identity_.device_type),
                    to_string(sockets_.front().local())));
  std::vector<const wire::UdpSocket*> sockets;
  for (const auto* some : {&sockets_, &public_sockets_}) {
    for (const wire::UdpSocket& socket : *some) sockets.push_back(&socket);
  }
  const EmulatedFaults& faults = options_.faults;
  for (std::int64_t now = begin; !progress_.cancelled(); now = steady_ns()) {
    if (options_.duration && now - begin >= duration) break;
    take_commands(now);
    if (!session_ && now >= dead_until_ns_) power_on(now);
    say(now);
    set_clock(now);
    send_due(now);
    const auto since_start =
        first_start_ns_ ? 1e-9 * static_cast<double>(now - *first_start_ns_) : -1.0;
    if (faults.heartbeat_dies && !heart_died_ && since_start >= *faults.heartbeat_dies) {
      heart_dead_ = heart_died_ = true;
      note_("its heartbeat dies");
    }
    if (faults.restart && !restarted_ && session_ && since_start >= *faults.restart) {
      restarted_ = true;
      ++truth_.restarts;
      note_("restarts");
      power_off(now, static_cast<std::int64_t>(1e9 * faults.restart_time));
    }
    if (faults.bend_time && truth_.bends == 0 && since_start >= *faults.bend_time) {
      ++truth_.bends;
      scan_.bend();
      note_("its optics bend");
    }
    wire::wait_for(sockets, rest_until(now) - steady_ns());
  }
  end_stream(steady_ns());
  truth_.serial = identity_.code;
  truth_.device_type = identity_.device_type;
  truth_.address = identity_.address;
  truth_.duration = 1e-9 * static_cast<double>(steady_ns() - begin);
  for (const wire::UdpSocket* socket : sockets) truth_.kernel_drops += socket->kernel_drops();
  end_session();
  return truth_;
}

}  // namespace

EmulatedSensor emulate_sensor(const EmulateOptions& options, const EmulateNote& note,
                              const Progress& progress) {
  if (options.duration) require_positive(kSetting.duration, *options.duration);
  require_between(kSetting.speed, options.speed, 1 / kFastest, kFastest);
  const EmulatedClock& clock = options.clock;
  require_between(kSetting.time_from, clock.source_from, 0, 1e6);
  require_between(kSetting.clock_drift, 1e-6 * clock.drift_ppm, -0.01, 0.01);
  require_between(kSetting.clock_jump_by, clock.jump_by, -kFarthestJump, kFarthestJump);
  if (clock.jump) require_not_negative(kSetting.clock_jump, *clock.jump);
  if (clock.source == recordings::TimeReference::utc ||
      clock.source == recordings::TimeReference::relative) {
    throw InvalidArgument(fmt::format("{} = {}, allowed power-on, PTP and PPS",
                                      name_of(kSetting.time), to_string(clock.source)));
  }
  const EmulatedFaults& faults = options.faults;
  require_between(kSetting.loss, faults.loss, 0, 1);
  require_between(kSetting.duplication, faults.duplication, 0, 1);
  require_between(kSetting.disorder, faults.disorder, 0, 1);
  require_between(kSetting.wrong_checksums, faults.wrong_checksums, 0, 1);
  require_between(kSetting.disorder_packets, faults.farthest, 1, 1000);
  require_between(kSetting.delay, faults.delay, 0, 60);
  require_between(kSetting.restart_takes, faults.restart_time, 0, 3600);
  if (faults.heartbeat_dies) {
    require_not_negative(kSetting.heartbeat_dies, *faults.heartbeat_dies);
  }
  if (faults.restart) require_not_negative(kSetting.restart, *faults.restart);
  if (faults.bend_time) require_not_negative(kSetting.bend_time, *faults.bend_time);
  if (faults.bend_time.has_value() == faults.bend.empty()) {
    throw InvalidArgument(
        fmt::format("{} and {} need each other: which parameters change, and when",
                    name_of(kSetting.bend), name_of(kSetting.bend_time)));
  }
  return Emulator(options, note, progress).run();
}

}  // namespace risley::jobs
