// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/io/block_file.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/lvx11_head.hpp"
#include "recordings/formats/lvx_reader.hpp"

namespace risley::recordings {

using namespace livox;

namespace {

using io::load;
using io::store;

constexpr std::size_t kFrameDurationAt = kLvxPublicHeaderBytes, kLvx11DeviceCountAt = 28;
constexpr std::size_t kDeviceTableAt = 29, kLvx11DeviceBytes = 59;
constexpr std::size_t kSerialBytes = 16;
constexpr std::uint32_t kUsualFrameDurationMs = 50;

/// Every LVX file but 1.0 and 2, so that unknown versions get a message of their own.
bool recognises_lvx11(std::string_view head) {
  return head.starts_with(kLvxName) && !kLvx10Format.recognises(head) &&
         !kLvx2Format.recognises(head);
}

std::unique_ptr<Reader> open_lvx11(const io::InputFile& input, const Progress&) {
  io::BlockInput file(input);
  const auto version_bytes = lvx_version(file);
  if (version_bytes != std::array<std::uint8_t, 4>{1, 1, 0, 0}) {
    throw FileError(input.path(), {kLvxName.size(), {}},
                    fmt::format("LVX version = {}, allowed 1.0.0.0, 1.1.0.0 and 2.0.0.0",
                                fmt::join(version_bytes, ".")));
  }
  const std::uint8_t* bytes =
      lvx_header_bytes(file, kFrameDurationAt, kDeviceTableAt - kFrameDurationAt, "private header");
  RecordingHeader header;
  header.format = kLvx11Format.name;
  header.frame_duration_ms = load<std::uint32_t>(bytes);
  const std::size_t count = bytes[kLvx11DeviceCountAt - kFrameDurationAt];
  header.devices = read_lvx_devices(file, kDeviceTableAt, count, true);
  LvxVersion version;
  version.first_frame = kDeviceTableAt + count * kLvx11DeviceBytes;
  version.frame_header_bytes = kLvx11FrameHeaderBytes;
  return std::make_unique<LvxReader>(std::move(file), std::move(header), version);
}

}  // namespace

std::vector<std::uint8_t> lvx11_head(const std::vector<Device>& devices,
                                     std::uint32_t frame_duration_ms) {
  constexpr std::size_t kMostDevices = 255;
  if (devices.empty() || devices.size() > kMostDevices) {
    throw InvalidArgument(
        fmt::format("number of devices = {}, allowed 1 to 255 in LVX", devices.size()));
  }
  std::vector<std::uint8_t> head(kDeviceTableAt + devices.size() * kLvx11DeviceBytes);
  std::copy(kLvxName.begin(), kLvxName.end(), head.begin());
  constexpr std::array<std::uint8_t, 4> kVersion{1, 1, 0, 0};
  std::copy(kVersion.begin(), kVersion.end(), &head[kLvxName.size()]);
  store<std::uint32_t>(&head[20], kLvxMagicCode);
  store<std::uint32_t>(&head[kFrameDurationAt], frame_duration_ms);
  head[kLvx11DeviceCountAt] = static_cast<std::uint8_t>(devices.size());
  std::array<bool, 256> taken{};
  std::uint8_t* bytes = &head[kDeviceTableAt];
  for (const Device& device : devices) {
    if (taken[device.index]) {
      throw InvalidArgument(fmt::format(
          "device index {} is used twice; LVX distinguishes devices by their index", device.index));
    }
    taken[device.index] = true;
    const auto put_text = [](const std::string& text, std::uint8_t* field) {
      if (text.size() > kSerialBytes) {
        throw InvalidArgument(
            fmt::format("serial '{}' has {} characters, allowed at most 16", text, text.size()));
      }
      std::copy(text.begin(), text.end(), field);
    };
    put_text(device.serial, bytes);
    put_text(device.hub_serial, bytes + 16);
    bytes[32] = device.index;
    bytes[33] = device.type;
    bytes[34] = device.extrinsic_enabled ? 1 : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      store<float>(bytes + 35 + 4 * axis, device.roll_pitch_yaw_deg[axis]);
      store<float>(bytes + 47 + 4 * axis, device.translation_m[axis]);
    }
    bytes += kLvx11DeviceBytes;
  }
  return head;
}

namespace {

/// A packet being formed from rows that came without packets.
struct OpenPacket {
  const RecordLayout* layout = nullptr;  ///< nullptr while there is none
  Packet header;
  ShotGrid grid;
  std::int64_t time_ns = 0;
  Observations rows;                       ///< all slots; null records for missing shots
  std::vector<std::uint64_t> row_numbers;  ///< by slot, for messages
  std::uint32_t last_slot = 0;
  std::uint8_t last_return = 0;
};

/// One device of the table and the state of its rows.
struct DeviceState {
  bool tagged = false;
  int returns = 1;
  OpenPacket packet;
  PacketClock clock;
  std::optional<std::int64_t> first_second_ns;  // whole seconds that PPS times do not hold
};

class Lvx11Writer final : public Writer {
 public:
  Lvx11Writer(const std::string& path, const RecordingHeader& header);

  void append(const Chunk& chunk) override;
  void close() override;

 private:
  void write_packets(const Chunk& chunk);
  void write_rows(const Chunk& chunk);
  void place(const Observations& o, std::size_t row);
  void start_packet(std::size_t device, std::int64_t time_ns, std::uint64_t row_number);
  void widen(std::size_t device, bool tagged, int returns);
  void flush(std::size_t device);
  void flush_all();
  void write_imu(const ImuSample& sample);
  void check_pps(std::size_t device, const Packet& packet, std::int64_t time_ns,
                 std::uint64_t row_number);
  void start_frame();
  void end_frame();
  void start_frame_at(std::int64_t time_ns);
  std::uint8_t* package(const Packet& header);
  std::size_t device_row(std::uint8_t device, std::uint64_t row_number) const;

  RecordingHeader header_;
  std::vector<DeviceState> devices_;
  io::BlockOutput output_;
  std::uint64_t rows_written_ = 0;
  std::int64_t time_tolerance_ns_ = 1;
  std::optional<std::uint64_t> frame_at_;  // position of the frame being written
  std::uint64_t frames_ = 0;
  std::optional<std::uint64_t> source_frame_;  // Packet::frame of the frame being written
  std::optional<std::int64_t> frame_time_ns_;  // of the first packet that was formed in it
};

Lvx11Writer::Lvx11Writer(const std::string& path, const RecordingHeader& header)
    : header_(header), output_(path) {
  if (!header_.has_range) {
    throw InvalidArgument(fmt::format(
        "{}: LVX needs ranges, and this recording holds directions only; write a scan sequence "
        "(.sequence.csv) or .nc instead",
        path));
  }
  if (header_.devices.empty()) header_.devices.emplace_back();
  if (header_.returns_per_shot < 1 || header_.returns_per_shot > 3) {
    throw InvalidArgument(
        fmt::format("returns_per_shot = {}, allowed 1 to 3 in LVX", header_.returns_per_shot));
  }
  devices_.resize(header_.devices.size());
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    devices_[i].tagged = header_.devices[i].type != kMid40 || header_.returns_per_shot > 1;
    devices_[i].returns = header_.returns_per_shot;
  }
  // openpylivox rounds times to us; two rounded times differ by up to one step from the grid.
  if (header_.format.starts_with("openpylivox")) time_tolerance_ns_ = 1000;
  const auto head = lvx11_head(header_.devices, header_.frame_duration_ms);
  std::copy(head.begin(), head.end(), output_.append(head.size()));
}

void Lvx11Writer::end_frame() {
  if (frame_at_) output_.patch_u64(*frame_at_ + kLvxFrameNextAt, output_.size());
  frame_at_.reset();
}

void Lvx11Writer::start_frame() {
  end_frame();
  frame_at_ = output_.size();
  std::uint8_t* bytes = output_.append(kLvx11FrameHeaderBytes);
  store<std::uint64_t>(bytes, *frame_at_);
  store<std::uint64_t>(bytes + kLvxFrameNextAt, 0);
  store<std::uint64_t>(bytes + kLvxFrameIndexAt, frames_++);
}

/// Starts a frame when a formed packet of this time does not belong to the current one.
void Lvx11Writer::start_frame_at(std::int64_t time_ns) {
  const std::uint32_t duration_ms =
      header_.frame_duration_ms > 0 ? header_.frame_duration_ms : kUsualFrameDurationMs;
  const std::int64_t duration_ns = std::int64_t{duration_ms} * 1'000'000;
  if (frame_at_ && frame_time_ns_ && time_ns > *frame_time_ns_ - duration_ns &&
      time_ns < *frame_time_ns_ + duration_ns) {
    return;
  }
  start_frame();
  source_frame_.reset();
  frame_time_ns_ = time_ns;
}

/// Appends a package. @return where its records go
std::uint8_t* Lvx11Writer::package(const Packet& header) {
  std::uint8_t* bytes =
      output_.append(kLvxPackageHeaderBytes + record_layout(header.data_type)->bytes());
  bytes[0] = header.device_index;
  encode_packet_header(header, bytes + 1);
  return bytes + kLvxPackageHeaderBytes;
}

std::size_t Lvx11Writer::device_row(std::uint8_t device, std::uint64_t row_number) const {
  if (device >= devices_.size()) {
    throw InvalidArgument(fmt::format("row {}: device = {}, allowed 0 to {}", row_number, device,
                                      devices_.size() - 1));
  }
  return device;
}

void Lvx11Writer::append(const Chunk& chunk) {
  // Packets of the second generation do not fit this format.
  const auto is_of_first = [](const Packet& packet) { return packet.version != kNumberedVersion; };
  if (!std::all_of(chunk.packets.begin(), chunk.packets.end(), is_of_first) ||
      chunk.packets.empty()) {
    write_rows(chunk);
  } else {
    flush_all();
    write_packets(chunk);
  }
  rows_written_ += chunk.observations.size();
}

void Lvx11Writer::write_packets(const Chunk& chunk) {
  const Observations& o = chunk.observations;
  std::size_t row = 0, imu = 0;
  for (std::size_t i = 0; i < chunk.packets.size(); ++i) {
    Packet packet = chunk.packets[i];
    const auto refuse = [&](const std::string& problem) {
      throw InvalidArgument(fmt::format(
          "packet {} at row {}: {}; clear Chunk::packets to have new packets formed from the rows",
          i, rows_written_ + row, problem));
    };
    const RecordLayout* layout = record_layout(packet.data_type);
    if (!layout) refuse(fmt::format("data type = {}, allowed 0 to 8", packet.data_type));
    if (packet.rows != layout->rows() || row + packet.rows > o.size()) {
      refuse(fmt::format("rows = {}, data type {} has {}", packet.rows, packet.data_type,
                         layout->rows()));
    }
    if (std::none_of(header_.devices.begin(), header_.devices.end(),
                     [&](const Device& device) { return device.index == packet.device_index; })) {
      refuse(fmt::format("device index = {} is not in the device table", packet.device_index));
    }
    if (!frame_at_ || source_frame_ != packet.frame) {
      start_frame();
      source_frame_ = packet.frame;
      frame_time_ns_.reset();
    }
    packet.version = kPacketVersion;
    if (packet.data_type == kImuDataType) {
      if (imu == chunk.imu.size()) refuse("its inertial sample is missing");
      encode_imu(chunk.imu[imu++], package(packet));
      continue;
    }
    // Changed row times, or packets that belong to other rows, must not be lost silently.
    const std::int64_t stamped = PacketClock().time_ns(packet).value_or(o.time_ns[row]);
    constexpr std::uint8_t kPps = 4;
    if (packet.timestamp_type != kPps && std::abs(stamped - o.time_ns[row]) > 1000) {
      refuse(fmt::format("time = {} ns, but the packet's timestamp is {} ns", o.time_ns[row],
                         stamped));
    }
    std::uint8_t* bytes = package(packet);
    for (std::size_t record = 0; record < layout->records; ++record) {
      encode_record(*layout, o, row, rows_written_ + row, bytes);
      bytes += layout->bytes_per_record;
      row += layout->returns;
    }
  }
  if (row != o.size() || imu != chunk.imu.size()) {
    throw InvalidArgument(
        fmt::format("the packets hold {} rows and {} inertial samples, the chunk {} and {}; clear "
                    "Chunk::packets to have new packets formed from the rows",
                    row, imu, o.size(), chunk.imu.size()));
  }
}

void Lvx11Writer::write_rows(const Chunk& chunk) {
  const Observations& o = chunk.observations;
  std::size_t imu = 0;
  for (std::size_t row = 0; row < o.size(); ++row) {
    while (imu < chunk.imu.size() && chunk.imu[imu].time_ns <= o.time_ns[row]) {
      write_imu(chunk.imu[imu++]);
    }
    place(o, row);
  }
  while (imu < chunk.imu.size()) write_imu(chunk.imu[imu++]);
}

/// Puts one row into its slot of the open packet, or into a new packet if it does not fit.
void Lvx11Writer::place(const Observations& o, std::size_t row) {
  const std::uint64_t row_number = rows_written_ + row;
  const std::size_t device = device_row(o.device[row], row_number);
  DeviceState& state = devices_[device];
  OpenPacket& packet = state.packet;
  const int number = o.return_number[row];
  if (number < 1 || number > 3) {
    throw InvalidArgument(
        fmt::format("row {}: return_number = {}, allowed 1 to 3 in LVX", row_number, number));
  }
  const bool tagged = state.tagged || o.tag[row] != 0 || number > 1;
  if (tagged != state.tagged || number > state.returns) {
    widen(device, tagged, std::max(number, state.returns));
  }
  const std::int64_t time = o.time_ns[row];

  std::optional<std::uint32_t> slot;
  if (packet.layout) {
    const std::int64_t since = time - packet.time_ns;
    if (since >= 0 && since <= packet.grid.offset_ns(packet.layout->records)) {
      const double interval =
          static_cast<double>(packet.grid.interval_numerator_ns) / packet.grid.interval_denominator;
      const auto nearest =
          static_cast<std::uint32_t>(std::lround(static_cast<double>(since) / interval));
      const bool on_grid = std::abs(since - packet.grid.offset_ns(nearest)) <= time_tolerance_ns_;
      const bool free = nearest > packet.last_slot ||
                        (nearest == packet.last_slot && number > packet.last_return);
      if (on_grid && free && nearest < packet.layout->records) slot = nearest;
    }
  }
  if (!slot) {
    flush(device);
    start_packet(device, time, row_number);
    slot = 0;
  }
  const std::size_t target =
      std::size_t{*slot} * packet.layout->returns + static_cast<std::size_t>(number - 1);
  Observations& rows = packet.rows;
  rows.azimuth[target] = o.azimuth[row];
  rows.zenith[target] = o.zenith[row];
  rows.range[target] = o.range[row];
  rows.intensity[target] = o.intensity[row];
  rows.tag[target] = o.tag[row];
  rows.valid[target] = o.valid[row];
  if (packet.last_slot != *slot || packet.last_return == 0) {
    packet.row_numbers[*slot] = row_number - static_cast<std::uint64_t>(number - 1);
  }
  packet.last_slot = *slot;
  packet.last_return = static_cast<std::uint8_t>(number);
}

void Lvx11Writer::start_packet(std::size_t device, std::int64_t time_ns, std::uint64_t row_number) {
  DeviceState& state = devices_[device];
  OpenPacket& packet = state.packet;
  const Device& table = header_.devices[device];
  Packet& header = packet.header;
  header = {};
  header.device_index = table.index;
  header.data_type = data_type_of(header_.cartesian, state.tagged, state.returns);
  header.timestamp_type = timestamp_type_of(header_.time_reference);
  try {
    header.timestamp = encode_timestamp(header.timestamp_type, time_ns);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(fmt::format("row {}: {}", row_number, error.what()));
  }
  const auto grid = shot_grid(table.type, header.data_type);
  if (!grid) {
    throw InvalidArgument(fmt::format(
        "device {} has the type {} ({}), whose shot rate LVX readers cannot know; allowed {}",
        device, table.type, device_type_name(table.type), livox_types_text()));
  }
  packet.grid = *grid;
  check_pps(device, header, time_ns, row_number);
  packet.layout = record_layout(header.data_type);
  packet.time_ns = time_ns;
  packet.last_slot = 0;
  packet.last_return = 0;
  packet.rows.clear();
  packet.rows.resize(packet.layout->rows());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::fill(packet.rows.azimuth.begin(), packet.rows.azimuth.end(), nan);
  std::fill(packet.rows.zenith.begin(), packet.rows.zenith.end(), nan);
  packet.row_numbers.assign(packet.layout->records, row_number);
}

/// PPS times hold no whole seconds: a reader must restore the intended times, up to the seconds
/// before the first packet.
void Lvx11Writer::check_pps(std::size_t device, const Packet& packet, std::int64_t time_ns,
                            std::uint64_t row_number) {
  if (header_.time_reference != TimeReference::pps) return;
  DeviceState& state = devices_[device];
  const std::int64_t read_again = state.clock.time_ns(packet).value_or(0);
  if (!state.first_second_ns) state.first_second_ns = time_ns - read_again;
  if (time_ns - read_again != *state.first_second_ns) {
    throw InvalidArgument(
        fmt::format("row {}: time = {} ns cannot be distinguished from {} ns by a PPS clock, which "
                    "starts again every "
                    "second; gaps must be shorter than 0.99 s",
                    row_number, time_ns, read_again + *state.first_second_ns));
  }
}

/// Makes the device's packets hold tags and this many returns from the last shot on.
void Lvx11Writer::widen(std::size_t device, bool tagged, int returns) {
  DeviceState& state = devices_[device];
  state.tagged = tagged;
  state.returns = returns;
  OpenPacket& packet = state.packet;
  if (!packet.layout) return;
  // The last shot may get another return that does not fit the old packet: it moves.
  Observations shot;
  const std::size_t old_returns = packet.layout->returns;
  const std::size_t first = packet.last_slot * old_returns;
  shot.resize(old_returns);
  const std::int64_t shot_time = packet.time_ns + packet.grid.offset_ns(packet.last_slot);
  const std::uint64_t row_number = packet.row_numbers[packet.last_slot];
  const std::uint8_t last_return = packet.last_return;
  const auto move_row = [](Observations& from, std::size_t a, Observations& to, std::size_t b) {
    to.azimuth[b] = std::exchange(from.azimuth[a], std::numeric_limits<double>::quiet_NaN());
    to.zenith[b] = std::exchange(from.zenith[a], std::numeric_limits<double>::quiet_NaN());
    to.range[b] = std::exchange(from.range[a], 0.0);
    to.intensity[b] = std::exchange(from.intensity[a], std::uint8_t{0});
    to.tag[b] = std::exchange(from.tag[a], std::uint8_t{0});
    to.valid[b] = std::exchange(from.valid[a], std::uint8_t{0});
  };
  for (std::size_t i = 0; i < old_returns; ++i) move_row(packet.rows, first + i, shot, i);
  if (packet.last_slot == 0) {
    packet.layout = nullptr;
  } else {
    flush(device);
  }
  start_packet(device, shot_time, row_number);
  for (std::size_t i = 0; i < old_returns; ++i) move_row(shot, i, packet.rows, i);
  packet.last_return = last_return;
}

void Lvx11Writer::flush(std::size_t device) {
  OpenPacket& packet = devices_[device].packet;
  if (!packet.layout) return;
  const RecordLayout& layout = *packet.layout;
  start_frame_at(packet.time_ns);
  std::uint8_t* bytes = package(packet.header);
  for (std::size_t record = 0; record < layout.records; ++record) {
    encode_record(layout, packet.rows, record * layout.returns, packet.row_numbers[record], bytes);
    bytes += layout.bytes_per_record;
  }
  packet.layout = nullptr;
}

void Lvx11Writer::flush_all() {
  std::vector<std::size_t> order;
  for (std::size_t device = 0; device < devices_.size(); ++device) {
    if (devices_[device].packet.layout) order.push_back(device);
  }
  std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return devices_[a].packet.time_ns < devices_[b].packet.time_ns;
  });
  for (const std::size_t device : order) flush(device);
}

void Lvx11Writer::write_imu(const ImuSample& sample) {
  const std::size_t device = device_row(sample.device, rows_written_);
  // A packet whose time is over is written first, so that the device's times do not run backwards.
  const OpenPacket& open_packet = devices_[device].packet;
  if (open_packet.layout &&
      sample.time_ns >=
          open_packet.time_ns + open_packet.grid.offset_ns(open_packet.layout->records)) {
    flush(device);
  }
  Packet packet;
  packet.device_index = header_.devices[device].index;
  packet.data_type = kImuDataType;
  packet.timestamp_type = timestamp_type_of(header_.time_reference);
  packet.timestamp = encode_timestamp(packet.timestamp_type, sample.time_ns);
  check_pps(device, packet, sample.time_ns, rows_written_);
  start_frame_at(sample.time_ns);
  encode_imu(sample, package(packet));
}

void Lvx11Writer::close() {
  flush_all();
  end_frame();
  output_.commit();
}

}  // namespace

const Format kLvx11Format = {
    "lvx-1.1",        ".lvx",     "Livox LVX 1.1, as written by Livox Viewer and the Livox SDK",
    recognises_lvx11, open_lvx11, create_with<Lvx11Writer>,
};

}  // namespace risley::recordings
