// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/record_sensors.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <filesystem>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/convert_recording.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/recordings/livox/first_packets.hpp"
#include "risley/recordings/livox/numbered_order.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/livox/packet_decoder.hpp"
#include "risley/recordings/livox/packet_file.hpp"
#include "risley/wire/control_client.hpp"
#include "risley/wire/handshake_client.hpp"

#include "jobs/sensor_search.hpp"

namespace risley::jobs {
namespace {

using recordings::livox::PacketFile;
using wire::ClientEvent;
using wire::ClientState;

constexpr std::int64_t kMillisecond = 1'000'000, kWireSecond = 1'000'000'000;  // ns
constexpr std::int64_t kFramePeriod = 50 * kMillisecond;
constexpr std::int64_t kSilenceTold = kWireSecond;
/// Broadcasts in transit at the time of the handshake are ignored.
constexpr std::int64_t kBroadcastSettles = 1500 * kMillisecond;
constexpr std::int64_t kLongestStop = 2 * kWireSecond;
constexpr std::int64_t kLongestPoll = 20 * kMillisecond;
/// After a longer step this process was suspended, and packets from that time have not been read
/// yet.
constexpr std::int64_t kStoodStill = 200 * kMillisecond;
constexpr std::int64_t kWatchPeriod = 500 * kMillisecond;
/// Longest wait at the end of a recording for the estimate of the last packets, s.
constexpr double kLongestFinish = 2;
/// Half a second of an Avia at ten times its speed.
constexpr std::size_t kReceiveBuffer = std::size_t{16} << 20U;
constexpr std::size_t kMostStatuses = 100, kMostReports = 1000;
constexpr std::size_t kMostPassiveSensors = 16;
/// Of a status: anything but the reports of a healthy sensor (PPS, PTP, time synchronisation).
constexpr std::uint32_t kTroubles = 0xC0000DFF;

/// Whether the output is made from the growing file.
bool is_converted(const std::string& output) { return lower_case(output).ends_with(".nc"); }

/// The name of a generation's file.
std::string file_name(const std::string& output, bool numbered) {
  if (is_converted(output)) return output;
  const std::string ending = lower_case(output).ends_with(".lvx2") ? ".lvx2" : ".lvx";
  const std::string wanted = numbered ? ".lvx2" : ".lvx";
  // As typed, in either case.
  return ending == wanted ? output : output.substr(0, output.size() - ending.size()) + wanted;
}

/// A sensor while it is recorded.
struct LiveSensor {
  LiveSensor(const FoundSensor& found, bool is_numbered)
      : numbered(is_numbered),
        order(recordings::livox::packet_sequence(found.device_type, is_numbered)) {
    result.sensor = found;
  }

  RecordedSensor result;
  bool numbered;  ///< of the second generation
  std::unique_ptr<recordings::livox::PacketSequence> order;
  std::unique_ptr<wire::UdpSocket> commands, data;
  std::unique_ptr<wire::ClientSession> session;
  std::size_t place = 0;   ///< among all sensors
  std::uint8_t index = 0;  ///< in the table of its file
  std::int64_t session_begin_ns = 0;
  std::optional<std::int64_t> data_ns;  ///< when the last packet came
  bool silent = false, stopped = false;
  std::uint64_t session_rejected = 0;  ///< by sessions that are over
  std::optional<std::uint32_t> status;
  std::optional<wire::SensorReport> report;  ///< the last one, of the second generation
  /// Changes, by the host's clock, ns.
  std::vector<std::pair<std::int64_t, wire::SensorReport>> reports;
  std::uint64_t alarms_told = 0;
  std::string words_told;  ///< of its points
};

/// Of this machine, ns since 1970.
std::int64_t host_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

class Recorder {
 public:
  Recorder(const RecordOptions& options, const wire::Interface& interface, const RecordNote& note,
           const Progress& progress, const RecordWatch& watch)
      : options_(options),
        interface_(interface),
        note_(note),
        progress_(progress),
        watch_(watch),
        listener_(interface) {}

  RecordedSensors run();

 private:
  void find();
  void find_passively();
  void open_sockets();
  void begin_session(LiveSensor& live, std::int64_t now);
  void step(std::int64_t now, std::int64_t wait_until);
  void step_session(LiveSensor& live, std::int64_t now);
  void take_event(LiveSensor& live, const ClientEvent& event);
  void take_report(LiveSensor& live, const wire::SensorReport& report);
  void add_sensor(const FoundSensor& found, bool numbered);
  void open_files();
  void take_broadcasts(std::int64_t now);
  void note_newcomer(const FoundSensor& heard);
  void take_commands(LiveSensor& live, std::int64_t now);
  /// @return number of datagrams, including foreign ones
  std::size_t take_data(LiveSensor& live, std::int64_t now);
  void watch_silence(LiveSensor& live, std::int64_t now);
  void write_frame(bool last);
  void stop_all();
  void finish_files();
  void begin_watch();
  void report_to_watch(std::int64_t now, bool over);
  std::uint64_t rejected_by(const LiveSensor& live) const;
  RecordedSensors result();
  static std::string name_of(const LiveSensor& live) { return live.result.sensor.serial; }

  const RecordOptions& options_;
  wire::Interface interface_;
  const RecordNote& note_;
  const Progress& progress_;
  const RecordWatch& watch_;
  BroadcastListener listener_;
  std::unique_ptr<wire::UdpSocket> passive_data_;  // for all sensors
  std::vector<std::unique_ptr<LiveSensor>> sensors_;
  std::set<std::string> newcomers_;                 // serial numbers
  std::vector<std::unique_ptr<PacketFile>> files_;  // by RecordedSensors::files
  std::unique_ptr<OpticsWatch> optics_;             // where the optics are watched
  std::unique_ptr<LivePoints> points_;              // where points are published
  std::vector<const wire::UdpSocket*> waiting_;
  std::optional<std::int64_t> first_packet_ns_,
      first_data_ns_;  ///< also a rejected one; a sound one
  std::int64_t last_data_ns_ = 0, frame_due_ns_ = 0, watch_due_ns_ = 0;
  std::int64_t step_ns_ = 0;           // when the last step began
  std::int64_t patient_until_ns_ = 0;  // until then packets may wait longer
  std::uint64_t passive_strangers_ = 0;
};

/// Device type of a second-generation sensor, as far as the shot interval in its packet determines
/// it.
std::uint8_t numbered_type(std::span<const std::uint8_t> packet) {
  const auto header = recordings::livox::decode_numbered_header(packet);
  const auto grid = recordings::livox::interval_grid(header, recordings::kUnknownDeviceType);
  for (const std::uint8_t type : {recordings::kMid360, recordings::kHap}) {
    const auto usual = *recordings::livox::numbered_grid(type);
    constexpr double kNear = 0.02;
    const double ratio =
        static_cast<double>(grid.interval_numerator_ns) * usual.interval_denominator /
        (static_cast<double>(grid.interval_denominator) * usual.interval_numerator_ns);
    if (std::abs(ratio - 1) < kNear) return type;
  }
  return recordings::kUnknownDeviceType;
}

void Recorder::add_sensor(const FoundSensor& found, bool numbered) {
  sensors_.push_back(std::make_unique<LiveSensor>(found, numbered));
  if (found.device_type == recordings::kUnknownDeviceType) {
    sensors_.back()->order->set_grid(recordings::livox::kGrid240kHz);
  }
}

/// Registers the senders of packets to the data port, and the properties shown by their times.
void Recorder::find_passively() {
  struct Heard {
    recordings::livox::PacketDecoder decoder{{.grid = recordings::livox::kGrid100kHz}};
    recordings::livox::FirstPackets packets;
    std::optional<std::uint8_t> numbered_type;  ///< of the second generation
  };
  std::map<wire::Address, Heard> heard;
  std::map<wire::Address, FoundSensor> named;
  recordings::Chunk chunk;
  const std::int64_t begin = steady_ns();
  const auto time = static_cast<std::int64_t>(1e9 * options_.find_time);
  for (std::int64_t now = begin; now - begin < time; now = steady_ns()) {
    progress_.check();
    wire::wait_for(waiting_, std::min(kLongestPoll, begin + time - now));
    for (const FoundSensor& sensor : listener_.take()) named.try_emplace(sensor.address, sensor);
    passive_data_->receive([&](const wire::UdpSocket::Datagram& datagram) {
      if (heard.size() >= kMostPassiveSensors && !heard.contains(datagram.from.address)) return;
      chunk.clear();
      Heard one = heard.contains(datagram.from.address) ? heard[datagram.from.address] : Heard{};
      const bool numbered =
          !datagram.bytes.empty() && datagram.bytes[0] == recordings::livox::kNumberedVersion;
      try {
        if (numbered) {
          recordings::livox::decode_numbered_packet(datagram.bytes, recordings::kMid360, 0, chunk);
        } else {
          one.decoder.decode(datagram.bytes, chunk);
        }
      } catch (const recordings::livox::BadPacket&) {
        return;
      }
      if (chunk.observations.size() == 0) return;
      if (numbered) {
        one.numbered_type = numbered_type(datagram.bytes);
      } else {
        one.packets.add(chunk.packets.front(), chunk.observations, 0);
      }
      heard[datagram.from.address] = one;
    });
  }
  for (const auto& [address, one] : heard) {
    FoundSensor sensor{to_string(address), recordings::kUnknownDeviceType, address};
    if (const auto known = named.find(address); known != named.end()) {
      sensor = known->second;
    } else {
      sensor.device_type = one.numbered_type.value_or(one.packets.device_type());
    }
    add_sensor(sensor, one.numbered_type.has_value());
  }
}

void Recorder::find() {
  if (options_.passive) {
    passive_data_ = std::make_unique<wire::UdpSocket>(
        wire::Endpoint{interface_.address, options_.data_port}, kReceiveBuffer);
    waiting_.push_back(passive_data_.get());
    find_passively();
    if (sensors_.empty()) {
      throw wire::NetworkError(fmt::format(
          "{}: no packet came in {} s; a passive recording hears only what sensors send to this "
          "address and port: name the port that the other host set with {}",
          to_string(passive_data_->local()), options_.find_time,
          risley::name_of(kSetting.data_port)));
    }
  } else {
    const std::vector<FoundSensor> found = search_sensors(listener_, options_, progress_.silent());
    std::vector<std::string> missing = options_.serials;
    for (const FoundSensor& sensor : found) std::erase(missing, sensor.serial);
    if (found.empty() || !missing.empty()) {
      throw wire::NetworkError(fmt::format(
          "{}: {} in {} s; is it switched on, in the network of this address and not connected to "
          "another program?",
          to_string(wire::Endpoint{interface_.address, wire::kBroadcastPort}),
          missing.empty() ? "no sensor was heard"
                          : fmt::format("nothing was heard of {}", fmt::join(missing, ", ")),
          options_.find_time));
    }
    for (const FoundSensor& sensor : found) {
      add_sensor(sensor, recordings::is_second_generation(sensor.device_type));
    }
  }
}

void Recorder::open_sockets() {
  std::size_t granted = passive_data_ ? passive_data_->receive_buffer() : kReceiveBuffer;
  if (!passive_data_) {
    for (const auto& live : sensors_) {
      live->commands = std::make_unique<wire::UdpSocket>(wire::Endpoint{interface_.address, 0});
      live->data =
          std::make_unique<wire::UdpSocket>(wire::Endpoint{interface_.address, 0}, kReceiveBuffer);
      granted = std::min(granted, live->data->receive_buffer());
      waiting_.push_back(live->commands.get());
      waiting_.push_back(live->data.get());
    }
    listener_.add_to(waiting_);
  }
  if (granted < kReceiveBuffer) {
    note_(fmt::format("the receive buffer has {} bytes, {} were asked for: if the kernel drops "
                      "packets, allow more with sysctl -w net.core.rmem_max={}",
                      granted, kReceiveBuffer, kReceiveBuffer),
          true);
  }
}

void Recorder::begin_session(LiveSensor& live, std::int64_t now) {
  wire::ClientSettings settings;
  settings.host = interface_.address;
  settings.data_port = live.data->local().port;
  settings.command_port = live.commands->local().port;
  settings.spherical = options_.spherical;
  settings.return_mode = options_.return_mode;
  const std::uint8_t type = live.result.sensor.device_type;
  if (recordings::livox::has_imu(type)) settings.imu = options_.imu;
  if (live.session) live.session_rejected += live.session->rejected();
  if (live.numbered) {
    live.session = std::make_unique<wire::ControlClient>(settings, type, now);
  } else {
    live.session = std::make_unique<wire::HandshakeClient>(settings, now);
  }
  live.session_begin_ns = now;
}

void Recorder::take_event(LiveSensor& live, const ClientEvent& event) {
  switch (event.kind) {
    case ClientEvent::Kind::connected:
      // Pending packets were sent before; the sensor sends nothing more until it is started again.
      take_data(live, steady_ns());
      live.order->flush();
      ++live.result.sessions;
      break;
    case ClientEvent::Kind::firmware:
      live.result.firmware = event.text;
      if (const auto grid = recordings::livox::grid_of_firmware(event.text)) {
        live.order->set_grid(*grid);
        if (optics_) optics_->set_grid(live.place, *grid);
        if (points_) points_->set_grid(live.place, *grid);
      }
      break;
    case ClientEvent::Kind::sensor_state:
      if (event.value != static_cast<std::uint32_t>(wire::SensorState::normal)) {
        constexpr const char* kNames[] = {"starting", "normal", "power saving", "standby", "error"};
        note_(fmt::format("{}: its state is {}", name_of(live),
                          event.value < std::size(kNames) ? kNames[event.value] : "unknown"),
              true);
      }
      break;
    case ClientEvent::Kind::status:
      live.status = event.value;
      if ((event.value & kTroubles) != 0) {
        auto& known = live.result.statuses;
        if (known.size() < kMostStatuses &&
            std::find(known.begin(), known.end(), event.value) == known.end()) {
          known.push_back(event.value);
          note_(fmt::format("{}: it reports the status 0x{:08X}", name_of(live), event.value),
                true);
        }
      }
      break;
    case ClientEvent::Kind::report:
      take_report(live, event.report);
      break;
    case ClientEvent::Kind::refused:
      note_(fmt::format("{}: it refuses the command \"{}\"", name_of(live), event.text), true);
      break;
    case ClientEvent::Kind::sampling:
      note_(fmt::format("{} at {}: started", name_of(live), to_string(live.result.sensor.address)),
            false);
      break;
    case ClientEvent::Kind::closed:
      live.stopped = true;
      break;
    case ClientEvent::Kind::lost:
      note_(fmt::format("{}: lost, {}; waiting for it", name_of(live), event.text), true);
      live.order->flush();
      break;
  }
}

/// Processes a status report of a second-generation sensor: keeps changes and reports problems.
void Recorder::take_report(LiveSensor& live, const wire::SensorReport& report) {
  if (report.temperature_cdeg) {
    const double temperature = 1e-2 * *report.temperature_cdeg;
    live.result.coldest = std::min(live.result.coldest.value_or(temperature), temperature);
    live.result.warmest = std::max(live.result.warmest.value_or(temperature), temperature);
  }
  // The temperature changes all the time.
  wire::SensorReport before = live.report.value_or(wire::SensorReport{});
  before.temperature_cdeg = report.temperature_cdeg;
  if (live.report && before == report) {
    live.report = report;
    return;
  }
  const auto words = wire::trouble_words(report);
  if (!words.empty() && words != wire::trouble_words(before)) {
    note_(fmt::format("{}: it reports {}", name_of(live), fmt::join(words, ", ")), true);
  }
  live.report = report;
  if (live.reports.size() < kMostReports) live.reports.emplace_back(host_ns(), report);
}

void Recorder::step_session(LiveSensor& live, std::int64_t now) {
  if (!live.session) return;
  live.session->advance(now);
  const wire::Endpoint to{live.result.sensor.address, live.result.sensor.command_port};
  for (const auto& datagram : live.session->take_datagrams()) live.commands->send(to, datagram);
  for (const ClientEvent& event : live.session->take_events()) take_event(live, event);
}

/// Notes a sensor that appears late. It cannot join: the table of sensors stands before the data.
void Recorder::note_newcomer(const FoundSensor& heard) {
  constexpr std::size_t kMostNewcomers = 100;
  const bool known = std::any_of(sensors_.begin(), sensors_.end(), [&](const auto& live) {
    return live->result.sensor.serial == heard.serial;
  });
  if (known || !options_.serials.empty() || newcomers_.size() == kMostNewcomers ||
      !newcomers_.insert(heard.serial).second) {
    return;
  }
  note_(fmt::format("{} at {}: appeared after the recording had begun, and cannot join it, because "
                    "the file begins with the table of sensors; record it into another file",
                    heard.serial, to_string(heard.address)),
        true);
}

/// A sensor of the first generation that broadcasts has no host: it is new, or it returned. One of
/// the second answers every search.
void Recorder::take_broadcasts(std::int64_t now) {
  if (!options_.passive) listener_.search(now);
  for (const FoundSensor& heard : listener_.take()) {
    note_newcomer(heard);
    for (const auto& live : sensors_) {
      if (live->result.sensor.serial != heard.serial || !live->session || live->stopped) continue;
      const bool lost = live->session->state() == ClientState::lost;
      const bool settled = !live->numbered && now - live->session_begin_ns > kBroadcastSettles &&
                           now - live->session->heard_ns() > kBroadcastSettles / 2 &&
                           heard.address == live->result.sensor.address;
      if (!lost && !settled) continue;
      if (!lost) live->order->flush();
      live->result.sensor.address = heard.address;
      live->result.sensor.command_port = heard.command_port;
      begin_session(*live, now);
    }
  }
}

void Recorder::take_commands(LiveSensor& live, std::int64_t now) {
  const FoundSensor& sensor = live.result.sensor;
  live.commands->receive([&](const wire::UdpSocket::Datagram& datagram) {
    const bool from_it =
        datagram.from.address == sensor.address &&
        (datagram.from.port == sensor.command_port ||
         (live.numbered && datagram.from.port == wire::control_ports(sensor.device_type).push));
    if (from_it && live.session) {
      live.session->receive(datagram.bytes, now);
    } else {
      ++live.result.rejected;
    }
  });
}

std::size_t Recorder::take_data(LiveSensor& live, std::int64_t now) {
  const auto take = [&](LiveSensor& whose, const wire::UdpSocket::Datagram& datagram) {
    if (!first_packet_ns_) first_packet_ns_ = now;
    if (!whose.order->add(datagram.bytes, datagram.kernel_ns)) return;
    if (!first_data_ns_) first_data_ns_ = now;
    last_data_ns_ = now;
    whose.data_ns = now;
    // Without waiting for those that it may have overtaken.
    if (points_) points_->add(whose.place, datagram.bytes, datagram.kernel_ns);
  };
  if (passive_data_) {
    return passive_data_->receive([&](const wire::UdpSocket::Datagram& datagram) {
      for (const auto& one : sensors_) {
        if (one->result.sensor.address == datagram.from.address) {
          take(*one, datagram);
          return;
        }
      }
      ++passive_strangers_;
    });
  }
  // Only after the handshake, and only from the sensor that it was made with.
  const bool connected = live.session && live.result.sessions > 0;
  return live.data->receive([&](const wire::UdpSocket::Datagram& datagram) {
    if (connected && datagram.from.address == live.result.sensor.address) {
      take(live, datagram);
    } else {
      ++live.result.rejected;
    }
  });
}

void Recorder::watch_silence(LiveSensor& live, std::int64_t now) {
  if (!live.data_ns || live.stopped) return;
  const bool silent = now - *live.data_ns > kSilenceTold;
  if (silent == live.silent) return;
  live.silent = silent;
  note_(fmt::format("{}: {}", name_of(live), silent ? "no data for 1 s" : "data come again"), true);
}

void Recorder::write_frame(bool last) {
  for (std::size_t i = 0; i < sensors_.size(); ++i) {
    LiveSensor& live = *sensors_[i];
    if (last) live.order->flush();
    for (const auto& packet : live.order->take()) {
      files_[live.result.file]->add(live.index, packet);
      if (optics_) optics_->add(i, packet);
    }
  }
  for (const auto& file : files_) file->end_frame();
}

void Recorder::step(std::int64_t now, std::int64_t wait_until) {
  const std::int64_t host = host_ns();
  const std::int64_t begin = steady_ns();  // behind host, so that no suspension is missed
  if (begin - std::exchange(step_ns_, begin) > kStoodStill) {
    patient_until_ns_ = begin + recordings::livox::PacketOrder::kLongestWait;
  }
  take_broadcasts(now);
  std::int64_t until = std::min(wait_until, now + kLongestPoll);
  for (const auto& live : sensors_) {
    if (!passive_data_) take_commands(*live, now);
    step_session(*live, now);
    take_data(*live, now);
    watch_silence(*live, now);
    if (live->session) until = std::min(until, live->session->next_ns());
  }
  if (now >= frame_due_ns_) {
    if (begin >= patient_until_ns_) {
      for (const auto& live : sensors_) live->order->advance(host);
    }
    write_frame(false);
    frame_due_ns_ = now + kFramePeriod;
  }
  if (now >= watch_due_ns_) {
    report_to_watch(now, false);
    watch_due_ns_ = now + kWatchPeriod;
  }
  wire::wait_for(waiting_, std::min(until, frame_due_ns_) - steady_ns());
}

void Recorder::stop_all() {
  for (const auto& live : sensors_) {
    if (live->session) live->session->stop(steady_ns());
  }
  const auto all_stopped = [&] {
    return std::all_of(sensors_.begin(), sensors_.end(), [](const auto& live) {
      return !live->session || live->session->state() == ClientState::closed ||
             live->session->state() == ClientState::lost;
    });
  };
  const std::int64_t begin = steady_ns();
  for (std::int64_t now = begin; !all_stopped() && now - begin < kLongestStop; now = steady_ns()) {
    step(now, begin + kLongestStop);
  }
  // Packets from before the sensors stopped are still in the kernel, among foreign ones.
  constexpr int kMostRounds = 1000;
  for (int round = 0; round < kMostRounds && !sensors_.empty(); ++round) {
    const std::int64_t now = steady_ns();
    std::size_t datagrams = 0;
    for (const auto& live : sensors_) datagrams += take_data(*live, now);
    if (datagrams == 0) break;
  }
}

/// One for each generation present.
void Recorder::open_files() {
  std::array<std::vector<recordings::Device>, 2> devices;  // by generation
  for (const auto& live : sensors_) {
    auto& table = devices[live->numbered ? 1 : 0];
    recordings::Device device;
    device.serial = live->result.sensor.serial;
    device.type = live->result.sensor.device_type;
    device.address = live->numbered ? to_string(live->result.sensor.address) : "";
    live->index = device.index = static_cast<std::uint8_t>(table.size());
    table.push_back(device);
  }
  if (is_converted(options_.output) && !devices[0].empty() && !devices[1].empty()) {
    throw InvalidArgument(fmt::format(
        "{} = {}: sensors of both generations were found, and NetCDF holds one recording; choose "
        "sensors with {}, or record LVX, which writes one file for each generation",
        risley::name_of(kSetting.output), options_.output, risley::name_of(kSetting.serial)));
  }
  for (const bool numbered : {false, true}) {
    const auto& table = devices[numbered ? 1 : 0];
    if (table.empty()) continue;
    for (const auto& live : sensors_) {
      if (live->numbered == numbered) live->result.file = files_.size();
    }
    files_.push_back(
        std::make_unique<PacketFile>(file_name(options_.output, numbered), table, numbered));
  }
}

RecordedSensors Recorder::run() {
  find();
  open_sockets();
  begin_watch();
  open_files();
  const std::int64_t begin = steady_ns();
  if (!passive_data_) {
    for (const auto& live : sensors_) begin_session(*live, begin);
  }
  constexpr std::int64_t kEndless = std::numeric_limits<std::int64_t>::max();
  const auto duration =
      options_.duration ? static_cast<std::int64_t>(1e9 * *options_.duration) : kEndless;
  std::exception_ptr failure;
  try {
    for (std::int64_t now = begin; !progress_.cancelled(); now = steady_ns()) {
      // If all packets are rejected, the first one counts.
      const std::optional<std::int64_t> first = first_data_ns_ ? first_data_ns_ : first_packet_ns_;
      const std::int64_t end = first && options_.duration ? *first + duration : kEndless;
      if (now >= end) break;
      if (options_.duration && first_data_ns_) {
        try {
          progress_.report(static_cast<double>(now - *first_data_ns_) /
                           static_cast<double>(duration));
        } catch (const Cancelled&) {  // between two checks: the same clean end
          break;
        }
      }
      step(now, end);
    }
    stop_all();
  } catch (const FileError&) {  // disk full: the sensors are stopped anyway
    failure = std::current_exception();
    for (const auto& live : sensors_) {
      if (live->session) live->session->stop(steady_ns());
      step_session(*live, steady_ns());
    }
  }
  if (failure) std::rethrow_exception(failure);
  write_frame(true);
  const bool nothing = std::all_of(sensors_.begin(), sensors_.end(), [](const auto& live) {
    return live->order->counts().packets == 0;
  });
  if (nothing) {
    std::uint64_t rejected = 0;
    for (const auto& live : sensors_) rejected += rejected_by(*live);
    if (first_packet_ns_) {
      throw wire::NetworkError(
          fmt::format("{}: all {} packets that came from {} were rejected, because they are not of "
                      "Livox's protocol or hold no times in order; nothing was recorded",
                      to_string(interface_.address), rejected, name_of(*sensors_.front())));
    }
    throw wire::NetworkError(fmt::format("{}: no packet came from {}; nothing was recorded",
                                         to_string(interface_.address),
                                         name_of(*sensors_.front())));
  }
  finish_files();
  if (optics_) optics_->finish(kLongestFinish);
  if (points_) points_->finish(kLongestFinish);
  report_to_watch(last_data_ns_, true);
  return result();
}

void Recorder::begin_watch() {
  for (std::size_t i = 0; i < sensors_.size(); ++i) sensors_[i]->place = i;
  std::vector<WatchedSensor> watched;
  watched.reserve(sensors_.size());
  for (const auto& live : sensors_) {
    watched.push_back({live->result.sensor.serial, live->result.sensor.device_type});
  }
  if (options_.watch_optics) {
    optics_ = std::make_unique<OpticsWatch>(watched, options_.optics_reference);
  }
  if (!options_.publish) return;
  points_ = std::make_unique<LivePoints>(watched, *options_.publish);
  const std::vector<PublishedPoints> published = points_->published();
  for (std::size_t i = 0; i < published.size(); ++i) {
    if (published[i].is_calibrated || published[i].calibration.empty()) continue;
    note_(fmt::format("{}: no calibration was given for its points: they are where the sensor "
                      "says, with the sigmas of the preset {}",
                      name_of(*sensors_[i]), published[i].calibration),
          true);
  }
}

/// Reports alarms, and passes everything to the watcher.
void Recorder::report_to_watch(std::int64_t now, bool over) {
  std::vector<OpticsHealth> optics;
  if (optics_) optics = optics_->health();
  for (std::size_t i = 0; i < optics.size(); ++i) {
    LiveSensor& live = *sensors_[i];
    if (optics[i].state.alarms == live.alarms_told) continue;
    live.alarms_told = optics[i].state.alarms;
    note_(fmt::format("{}: {}", name_of(live), alarm_words(optics[i])), true);
  }
  std::vector<PublishedPoints> published;
  if (points_) published = points_->published();
  for (std::size_t i = 0; i < published.size(); ++i) {
    LiveSensor& live = *sensors_[i];
    if (published[i].words == live.words_told) continue;
    live.words_told = published[i].words;
    note_(live.words_told.empty()
              ? fmt::format("{}: its points come again", name_of(live))
              : fmt::format("{}: no points are published: {}", name_of(live), live.words_told),
          true);
  }
  if (!watch_) return;
  LiveRecording state;
  state.over = over;
  if (first_data_ns_) state.duration = 1e-9 * static_cast<double>(now - *first_data_ns_);
  for (const auto& live : sensors_) {
    LiveSensorState one;
    one.sensor = live->result.sensor;
    one.counts = live->order->counts();
    one.kernel_drops = (passive_data_ ? *passive_data_ : *live->data).kernel_drops();
    one.rejected = rejected_by(*live);
    one.silent = live->silent;
    one.status = live->status;
    one.report = live->report;
    if (live->place < optics.size()) one.optics = optics[live->place];
    if (live->place < published.size()) one.published = published[live->place];
    if (optics_) one.seen = optics_->take_seen(live->place);
    state.sensors.push_back(std::move(one));
  }
  watch_(state);
}

std::uint64_t Recorder::rejected_by(const LiveSensor& live) const {
  return live.result.rejected + live.order->counts().rejected + live.session_rejected +
         (live.session ? live.session->rejected() : 0);
}

/// Renames the files, or makes the requested output from the only one.
void Recorder::finish_files() {
  if (!is_converted(options_.output)) {
    for (const auto& file : files_) file->close();
    return;
  }
  PacketFile& file = *files_.front();
  file.settle();
  try {
    ConvertRecordingOptions wanted;
    wanted.recording = file.unfinished_path();
    wanted.output = options_.output;
    const ConvertedRecording converted = convert_recording(wanted);
    if (converted.damage) throw FileError(*converted.damage);
  } catch (const FileError& error) {
    throw FileError(
        error.path(), error.place(),
        fmt::format("{}; the recording is whole in {}", error.problem(), file.unfinished_path()));
  }
  file.discard();
}

RecordedSensors Recorder::result() {
  RecordedSensors recorded;
  recorded.interface = interface_.address;
  recorded.duration = 1e-9 * static_cast<double>(last_data_ns_ - first_data_ns_.value_or(0));
  for (const auto& file : files_) {
    std::error_code gone;
    recorded.files.push_back({file->path(), file->frames(),
                              is_converted(options_.output)
                                  ? std::filesystem::file_size(options_.output, gone)
                                  : file->size()});
  }
  recorded.receive_buffer_asked = kReceiveBuffer;
  recorded.receive_buffer_granted = kReceiveBuffer;
  recorded.strangers = listener_.strangers() + passive_strangers_;
  std::vector<OpticsHealth> optics;
  if (optics_) optics = optics_->health();
  std::vector<PublishedPoints> published;
  if (points_) published = points_->published();
  std::int64_t first_host_ns = std::numeric_limits<std::int64_t>::max();
  for (const auto& live : sensors_) {
    if (const auto first = live->order->first_host_ns()) {
      first_host_ns = std::min(first_host_ns, *first);
    }
  }
  for (const auto& live : sensors_) {
    RecordedSensor& one = live->result;
    const wire::UdpSocket& data = passive_data_ ? *passive_data_ : *live->data;
    recorded.receive_buffer_granted =
        std::min(recorded.receive_buffer_granted, data.receive_buffer());
    one.counts = live->order->counts();
    one.kernel_drops = data.kernel_drops();
    one.rejected = rejected_by(*live);
    if (live->place < optics.size()) one.optics = optics[live->place];
    if (live->place < published.size()) one.published = published[live->place];
    for (const recordings::livox::PacketGap& gap : live->order->gaps()) {
      one.gaps.push_back({1e-9 * static_cast<double>(gap.host_from_ns - first_host_ns),
                          1e-9 * static_cast<double>(gap.host_to_ns - first_host_ns), gap.lost,
                          gap.imu, gap.cause});
    }
    const auto since_first = [&](std::int64_t host_ns) {
      return 1e-9 * static_cast<double>(host_ns - first_host_ns);
    };
    const recordings::livox::ClockWatch& clock = live->order->clock();
    for (const recordings::livox::ClockStretch& stretch : clock.stretches()) {
      one.clocks.push_back({recordings::livox::time_reference_of(stretch.timestamp_type),
                            since_first(stretch.host_from_ns), since_first(stretch.host_to_ns),
                            1e-9 * static_cast<double>(stretch.least_offset_ns),
                            1e-9 * static_cast<double>(stretch.greatest_offset_ns), stretch.drift});
    }
    // Packets of the second generation have no status.
    for (const recordings::livox::StatusChange& change : clock.status_changes()) {
      if (!live->numbered) {
        one.status_changes.push_back({since_first(change.host_ns), change.status});
      }
    }
    for (const auto& [host_ns, report] : live->reports) {
      one.reports.push_back({std::max(since_first(host_ns), 0.0), report});
    }
    recorded.sensors.push_back(one);
  }
  return recorded;
}

}  // namespace

RecordedSensors record_sensors(const RecordOptions& options, const RecordNote& note,
                               const Progress& progress, const RecordWatch& watch) {
  if (options.duration) require_positive(kSetting.duration, *options.duration);
  require_find_time(options);
  if (!is_converted(options.output) && !lower_case(options.output).ends_with(".lvx") &&
      !lower_case(options.output).ends_with(".lvx2")) {
    throw InvalidArgument(
        fmt::format("{} = {}: packets are recorded as LVX or NetCDF, expected the ending .lvx, "
                    ".lvx2 or .nc; convert the recording afterwards",
                    name_of(kSetting.output), options.output));
  }
  if (options.watch_optics)
    given_sensor(options.optics_reference);  // not after a search of seconds
  if (options.publish) require_usable(*options.publish);
  return Recorder(options, wire::interface_of(options.interface), note, progress, watch).run();
}

std::string alarm_words(const OpticsHealth& health) {
  const auto& alarm = health.state.alarm;
  if (!alarm) return {};
  const ParameterInfo* known = find_parameter_of_any_train(alarm->parameter);
  const double per_unit = known != nullptr ? known->si_per_unit : 1;
  constexpr double kLeast = 1e-300;  // below, doubles lose their digits and end at zero
  return fmt::format(
      "{}: {}, if nothing else differs, is {:+.2g} +- {:.1g} from {}; the probability of such a "
      "difference by chance is {} {:.1g}",
      alarm->kind == estimation::OpticsAlarmKind::changed
          ? "its optics have changed"
          : "its optics are not those of " + health.reference,
      alarm->parameter, alarm->difference / per_unit, alarm->sigma / per_unit,
      alarm->kind == estimation::OpticsAlarmKind::changed ? "what it was in the beginning"
                                                          : "what it should be",
      alarm->p_value < kLeast ? "below" : "at most", std::max(alarm->p_value, kLeast));
}

}  // namespace risley::jobs
