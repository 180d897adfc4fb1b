// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// LVX 2, of Livox Viewer 2: the frames of LVX 1.1, with packages that contain the records of the
// second generation's packets. A package does not state the interval of its shots, which follows
// from its sensor's type. It names its sensor by four bytes, its IP address.
//
// The specification has only the data types 1 and 2. Others are read, too, and inertial samples and
// two returns are written in packages of their data types: a package states its length, so that
// readers can skip unknown ones.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/saturating.hpp"
#include "risley/io/block_file.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/livox/packet_encoder.hpp"
#include "risley/wire/address.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/lvx2_frames.hpp"
#include "recordings/formats/lvx_reader.hpp"

namespace risley::recordings {

using namespace livox;

namespace {

using io::load;
using io::store;

/// A package is what a datagram held.
constexpr std::uint32_t kMostPointBytes = 65'535;
constexpr auto kLatestPackage =
    static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() - 3'600'000'000'000);
constexpr ShotGrid kUsualGrid{5000, 1, 4, 1};  // of the Mid-360

bool recognises_lvx2(std::string_view head) {
  return head.starts_with(kLvxName) && head.size() > kLvxName.size() && head[kLvxName.size()] == 2;
}

LidarId lidar_id(const std::uint8_t* bytes) { return {bytes[0], bytes[1], bytes[2], bytes[3]}; }

/// The entries of the device table.
std::vector<Device> read_lvx2_devices(io::BlockInput& file, std::size_t count) {
  if (count == 0) {
    throw FileError(file.path(), {kLvx2CountAt, {}}, "number of devices = 0, allowed 1 to 255");
  }
  const std::uint8_t* bytes =
      lvx_header_bytes(file, kLvx2TableAt, count * kLvx2DeviceBytes, "device table");
  std::vector<Device> devices(count);
  for (std::size_t i = 0; i < count; ++i, bytes += kLvx2DeviceBytes) {
    Device& device = devices[i];
    device.serial = lvx_text(bytes, kLvx2SerialBytes);
    device.address = wire::to_string(wire::Address{lidar_id(bytes + kIdAt)});
    device.index = static_cast<std::uint8_t>(i);
    device.type = bytes[kDeviceTypeAt];
    device.extrinsic_enabled = bytes[kEnableAt] != 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      device.roll_pitch_yaw_deg[axis] = load<float>(bytes + kPoseAt + 4 * axis);
      device.translation_m[axis] = load<float>(bytes + kPoseAt + 12 + 4 * axis);
    }
  }
  return devices;
}

/// The header of a package before its points.
struct Package {
  LidarId id{};
  NumberedHeader header;
  std::uint32_t length = 0;  ///< of the points, bytes
};

Package lvx2_package(const std::uint8_t* bytes) {
  Package package;
  package.id = lidar_id(bytes + kPackageIdAt);
  package.header.time_type = bytes[kPackageTimeTypeAt];
  package.header.time_ns = load<std::uint64_t>(bytes + kPackageTimeAt);
  package.header.number = load<std::uint16_t>(bytes + kPackageNumberAt);
  package.header.data_type = bytes[kPackageDataTypeAt];
  package.header.frame = bytes[kPackageFrameAt];
  package.length = load<std::uint32_t>(bytes + kPackageLengthAt);
  return package;
}

class Lvx2Reader final : public LvxFrameReader {
 public:
  Lvx2Reader(io::BlockInput file, RecordingHeader header, std::uint64_t first_frame)
      : LvxFrameReader(std::move(file), std::move(header), first_frame, kLvx2FrameHeaderBytes) {
    for (std::size_t row = 0; row < header_.devices.size(); ++row) {
      const auto address = wire::address_from(header_.devices[row].address);
      if (address) rows_of_ids_.emplace(address->bytes, row);
    }
    grids_.assign(header_.devices.size(), kUsualGrid);
    rewind();
    describe();
  }

 private:
  /// Points and inertial samples of a device count apart.
  struct Numbers {
    std::array<PacketNumbers, 2> count;
    std::int64_t lost = 0;
    std::uint64_t duplicates = 0;
  };

  void rewind() {
    rewind_frames();
    numbers_.assign(header_.devices.size(), {});
    unknown_types_.clear();
    strangers_ = leftovers_ = 0;
  }

  void describe();
  std::optional<ShotGrid> measured_grid(const std::vector<Packet>& packets, std::size_t device);
  bool read_package(Chunk& chunk, std::size_t max_rows, std::uint64_t left) override;
  void at_end() override;
  std::optional<std::size_t> device_row(const LidarId& id);

  std::map<LidarId, std::size_t> rows_of_ids_;
  bool one_for_all_ = false;     // the only device, whose packages have another id
  std::vector<ShotGrid> grids_;  // by device row
  std::vector<Numbers> numbers_;
  std::map<std::uint8_t, std::uint64_t> unknown_types_;  // packages of each
  std::uint64_t strangers_ = 0, leftovers_ = 0;
};

/// Row of the device table; empty for an id that is not in it.
std::optional<std::size_t> Lvx2Reader::device_row(const LidarId& id) {
  const auto found = rows_of_ids_.find(id);
  if (found != rows_of_ids_.end()) return found->second;
  return one_for_all_ ? std::optional<std::size_t>(0) : std::nullopt;
}

/// By the times and numbers of neighbouring packets; empty if there are none.
std::optional<ShotGrid> Lvx2Reader::measured_grid(const std::vector<Packet>& packets,
                                                  std::size_t device) {
  double least = std::numeric_limits<double>::infinity();
  const Packet* before = nullptr;
  for (const Packet& packet : packets) {
    if (packet.device_index != device || packet.is_imu()) continue;
    const bool follows = before != nullptr && packet.data_type == before->data_type &&
                         packet.number == ((before->number + 1) & 0xFFFFU);
    const std::int64_t passed = follows ? numbered_time_ns(packet) - numbered_time_ns(*before) : 0;
    const int returns = numbered_layout(packet.data_type, 1)->returns;
    if (passed > 0) {
      least = std::min(least, static_cast<double>(passed) * returns / before->rows);
    }
    before = &packet;
  }
  constexpr double kShortest_ns = 100, kLongest_ns = 1e6;
  if (!(least > kShortest_ns && least < kLongest_ns)) return std::nullopt;
  constexpr double kPart = 1000;
  return ShotGrid{static_cast<std::uint32_t>(std::lround(least * kPart)),
                  static_cast<std::uint32_t>(kPart), 1, 1};
}

/// Completes the header from the first packages: their contents, the origin of their times, and the
/// shot interval of devices whose type does not determine it.
void Lvx2Reader::describe() {
  constexpr std::size_t kEnoughRows = 20'000;
  Chunk chunk;
  const auto look = [&] {
    // Damage after the first undamaged packages is reported when the caller reaches it.
    try {
      read(chunk, kEnoughRows);
    } catch (const FileError&) {
      chunk.clear();
    }
  };
  look();
  std::vector<Warning> unclear;
  if (chunk.packets.empty() && strangers_ > 0 && header_.devices.size() == 1) {
    one_for_all_ = true;
    rewind();
    look();
    risley::warn(unclear, kWarning.devices_unclear,
                 "no package names the sensor {} of the device table; they were taken as its own",
                 header_.devices.front().address);
  }
  header_.cartesian = true;
  bool described = false;
  for (const Packet& packet : chunk.packets) {
    if (packet.is_imu()) continue;
    const RecordLayout layout = *numbered_layout(packet.data_type, 1);
    if (!described) {
      header_.time_reference = numbered_time_reference(packet.timestamp_type);
      header_.cartesian = layout.cartesian;
    }
    described = true;
    header_.returns_per_shot = std::max<int>(header_.returns_per_shot, layout.returns);
  }
  const auto step = [](const ShotGrid& grid) {
    return static_cast<double>(grid.interval_numerator_ns) / grid.interval_denominator;
  };
  for (std::size_t row = 0; row < header_.devices.size(); ++row) {
    Device& device = header_.devices[row];
    const auto named = numbered_grid(device.type);
    const auto measured = measured_grid(chunk.packets, row);
    if (named) grids_[row] = *named;
    if (!measured) continue;
    const auto is_near = [&](const ShotGrid& grid) {
      constexpr double kNear = 0.05;
      return std::abs(step(*measured) / step(grid) - 1.0) < kNear;
    };
    if (named && is_near(*named)) continue;
    std::optional<std::uint8_t> type;
    for (const std::uint8_t one : {kMid360, kHap}) {
      if (is_near(*numbered_grid(one))) type = one;
    }
    grids_[row] = type ? *numbered_grid(*type) : *measured;
    risley::warn(
        unclear, kWarning.devices_unclear,
        "device {} has the type {} ({}); judging by the times of its packets, it measures at "
        "{:.4g} kHz{}",
        row, device.type, device_type_name(device.type), 1e6 / step(grids_[row]),
        type ? fmt::format(", as a {} does", device_type_name(*type)) : std::string());
    if (type && !named) {
      device.type = *type;
      device.type_inferred = true;
    }
  }
  rewind();
  warnings_ = std::move(unclear);
}

bool Lvx2Reader::read_package(Chunk& chunk, std::size_t max_rows, std::uint64_t left) {
  const auto stop = [&](std::optional<std::size_t> records) {
    if (at_file_end()) {
      stop_at_cut(records);
    } else {
      fail(position(), fmt::format("a package does not fit into its frame, which ends at byte {}",
                                   frame_end()));
    }
    return true;
  };
  const std::size_t known = std::min<std::uint64_t>(left, kLvx2PackageBytes);
  const std::uint8_t* bytes = file().at(position(), known);
  if (bytes[0] != 0) {
    fail(position(), fmt::format("package version = {}, expected 0", bytes[0]));
    return true;
  }
  if (known < kLvx2PackageBytes) return stop({});
  Package package = lvx2_package(bytes);
  NumberedHeader& header = package.header;
  if (package.length > kMostPointBytes) {
    fail(position() + kPackageLengthAt,
         fmt::format("a package has {} bytes of points, expected at most {}", package.length,
                     kMostPointBytes));
    return true;
  }
  const auto layout_of_one = numbered_layout(header.data_type, 1);
  const std::size_t size = layout_of_one ? layout_of_one->bytes_per_record : 1;
  header.records = static_cast<std::uint16_t>(package.length / size);
  const std::uint64_t whole = kLvx2PackageBytes + std::uint64_t{package.length};
  if (whole > left) return stop(header.records);
  if (!layout_of_one) {
    ++unknown_types_[header.data_type];
    pass_package(whole, 0);
    return true;
  }
  const auto row = device_row(package.id);
  if (!row) {
    ++strangers_;
    pass_package(whole, 0);
    return true;
  }
  if (header.time_ns > kLatestPackage) {
    fail(position() + kPackageTimeAt, fmt::format("{} ns is not a time", header.time_ns));
    return true;
  }
  // Packages stay complete; one is delivered even if the chunk should be smaller.
  const RecordLayout layout = *numbered_layout(header.data_type, header.records);
  if (has_to_wait(chunk, max_rows, layout.rows())) return false;
  if (package.length % size != 0) ++leftovers_;
  const auto device = static_cast<std::uint8_t>(*row);
  Numbers& numbers = numbers_[*row];
  const auto place =
      numbers.count[header.data_type == kNumberedImu ? 1 : 0].add(packet_of(header, device));
  if (place.kind == PacketNumbers::Kind::duplicate) {
    ++numbers.duplicates;
    pass_package(whole, 0);
    return true;
  }
  numbers.lost = saturating_sum(numbers.lost, place.kind == PacketNumbers::Kind::late
                                                  ? -1
                                                  : static_cast<std::int64_t>(place.lost));
  const std::span records(file().at(position() + kLvx2PackageBytes, package.length),
                          layout.bytes());
  const std::size_t packets = chunk.packets.size();
  try {
    chunk.observations.resize(std::max(chunk.observations.size(), rows() + layout.rows()));
    decode_numbered_records_into(header, records, grids_[*row], device, chunk, rows());
  } catch (const BadPacket& bad) {
    fail(position() + kLvx2PackageBytes + bad.byte_offset(), bad.problem());
    return true;
  }
  for (std::size_t i = packets; i < chunk.packets.size(); ++i) {
    chunk.packets[i].frame = frames() - 1;
  }
  pass_package(whole, layout.rows());
  return true;
}

void Lvx2Reader::at_end() {
  for (std::size_t row = 0; row < numbers_.size(); ++row) {
    const Device& device = header_.devices[row];
    const std::string& name = device.serial.empty() ? device.address : device.serial;
    if (numbers_[row].lost > 0) {
      warn(kWarning.shots_lost, "{}: {} packets are missing between others", name,
           numbers_[row].lost);
    }
    if (numbers_[row].duplicates > 0) {
      warn(kWarning.content_left_out,
           "{}: {} packets are duplicated there; the second ones were ignored", name,
           numbers_[row].duplicates);
    }
  }
  for (const auto& [type, packages] : unknown_types_) {
    warn(kWarning.content_left_out, "{} packages of the unknown data type {} were ignored",
         packages, type);
  }
  if (strangers_ > 0) {
    warn(kWarning.content_left_out,
         "{} packages were ignored: they name sensors that are not in the device table",
         strangers_);
  }
  if (leftovers_ > 0) {
    warn(kWarning.content_left_out,
         "{} packages end within a record; their complete records were read", leftovers_);
  }
}

std::unique_ptr<Reader> open_lvx2(const io::InputFile& input, const Progress&) {
  io::BlockInput file(input);
  const auto version = lvx_version(file);
  if (version != std::array<std::uint8_t, 4>{2, 0, 0, 0}) {
    throw FileError(input.path(), {kLvxName.size(), {}},
                    fmt::format("LVX version = {}, allowed 1.0.0.0, 1.1.0.0 and 2.0.0.0",
                                fmt::join(version, ".")));
  }
  const std::uint8_t* bytes =
      lvx_header_bytes(file, kLvx2DurationAt, kLvx2TableAt - kLvx2DurationAt, "private header");
  RecordingHeader header;
  header.format = kLvx2Format.name;
  header.frame_duration_ms = load<std::uint32_t>(bytes);
  const std::size_t count = bytes[kLvx2CountAt - kLvx2DurationAt];
  header.devices = read_lvx2_devices(file, count);
  return std::make_unique<Lvx2Reader>(std::move(file), std::move(header),
                                      kLvx2TableAt + count * kLvx2DeviceBytes);
}

void require_time(std::int64_t time_ns, std::uint64_t row_number) {
  if (time_ns >= 0 && static_cast<std::uint64_t>(time_ns) <= kLatestPackage) return;
  throw InvalidArgument(fmt::format("row {}: time = {} ns of a package, allowed 0 to {}",
                                    row_number, time_ns, kLatestPackage));
}

class Lvx2Writer final : public Writer {
 public:
  Lvx2Writer(const std::string& path, const RecordingHeader& header);

  void append(const Chunk& chunk) override;
  void close() override;

 private:
  /// A package being formed from rows that came without packets.
  struct OpenPackage {
    std::uint16_t records = 0;  ///< 0 while there is none
    std::int64_t time_ns = 0;
    Observations rows;                       ///< all slots; null records for missing shots
    std::vector<std::uint64_t> row_numbers;  ///< by slot, for messages
    std::uint32_t last_slot = 0;
    std::uint8_t last_return = 0;
  };
  /// One device of the table.
  struct State {
    LidarId id{};
    ShotGrid grid;
    OpenPackage open;
    std::optional<std::int64_t> last_ns, last_imu_ns;  ///< of the packages formed
    std::uint16_t number = 0, imu_number = 0;          ///< of the next of them
  };

  void write_packets(const Chunk& chunk);
  void write_rows(const Chunk& chunk);
  void place(const Observations& o, std::size_t row);
  void start_package(State& state, std::int64_t time_ns, std::uint32_t slot,
                     std::uint64_t row_number);
  void flush(std::size_t device);
  void flush_all();
  void write_imu(const ImuSample& sample);
  void end_frame();
  std::uint8_t* package(std::size_t device, const NumberedHeader& header);
  State& state_of(std::uint8_t device, std::uint64_t row_number);
  std::uint16_t records() const { return data_type_ == kNumberedTwoReturns ? 48 : 96; }
  std::int64_t length_ns(const State& state) const { return state.grid.offset_ns(records()); }

  RecordingHeader header_;
  std::vector<State> states_;
  std::uint8_t data_type_ = kNumberedPoints;  ///< of packages that are formed
  io::BlockOutput output_;
  std::uint64_t rows_written_ = 0;
  Lvx2FrameCut cut_;
  std::optional<std::uint64_t> frame_at_;  ///< position of the frame being written
  std::uint64_t frames_ = 0;
};

Lvx2Writer::Lvx2Writer(const std::string& path, const RecordingHeader& header)
    : header_(header), output_(path), cut_(header.devices.size()) {
  if (!header_.has_range) {
    throw InvalidArgument(fmt::format(
        "{}: LVX needs ranges, and this recording holds directions only; write a scan sequence "
        "(.sequence.csv) or .nc instead",
        path));
  }
  if (header_.returns_per_shot < 1 || header_.returns_per_shot > 2) {
    throw InvalidArgument(
        fmt::format("returns_per_shot = {}, allowed 1 and 2 in LVX 2", header_.returns_per_shot));
  }
  if (header_.returns_per_shot == 2) data_type_ = kNumberedTwoReturns;
  const Lvx2Head head = lvx2_head(header_.devices);
  for (std::size_t row = 0; row < header_.devices.size(); ++row) {
    const Device& device = header_.devices[row];
    const auto grid = numbered_grid(device.type);
    if (!grid && !is_second_generation(device.type) && device.address.empty()) {
      throw InvalidArgument(
          fmt::format("device {} has the type {} ({}), which LVX 2 does not support; allowed {}; "
                      "sensors of the first generation need LVX 1.1 (.lvx)",
                      row, device.type, device_type_name(device.type), livox_types_text(false)));
    }
    State state;
    state.grid = grid.value_or(kUsualGrid);
    state.id = head.ids[row];
    states_.push_back(std::move(state));
  }
  std::copy(head.bytes.begin(), head.bytes.end(), output_.append(head.bytes.size()));
}

void Lvx2Writer::end_frame() {
  if (frame_at_) output_.patch_u64(*frame_at_ + kLvxFrameNextAt, output_.size());
  frame_at_.reset();
}

/// Appends a package, in a new frame if that is due. @return where its records go
std::uint8_t* Lvx2Writer::package(std::size_t device, const NumberedHeader& header) {
  if (cut_.begins_frame(device, static_cast<std::int64_t>(header.time_ns))) {
    end_frame();
    frame_at_ = output_.size();
    std::uint8_t* bytes = output_.append(kLvx2FrameHeaderBytes);
    store<std::uint64_t>(bytes, *frame_at_);
    store<std::uint64_t>(bytes + kLvxFrameNextAt, 0);
    store<std::uint64_t>(bytes + kLvxFrameIndexAt, frames_++);
  }
  const std::size_t length = numbered_layout(header.data_type, header.records)->bytes();
  std::uint8_t* bytes = output_.append(kLvx2PackageBytes + length);
  put_lvx2_package(states_[device].id, header, length, bytes);
  return bytes + kLvx2PackageBytes;
}

Lvx2Writer::State& Lvx2Writer::state_of(std::uint8_t device, std::uint64_t row_number) {
  if (device >= states_.size()) {
    throw InvalidArgument(fmt::format("row {}: device = {}, allowed 0 to {}", row_number, device,
                                      states_.size() - 1));
  }
  return states_[device];
}

void Lvx2Writer::append(const Chunk& chunk) {
  const bool numbered =
      !chunk.packets.empty() &&
      std::all_of(chunk.packets.begin(), chunk.packets.end(), [](const Packet& one) {
        return one.version == kNumberedVersion && numbered_layout(one.data_type, 1).has_value();
      });
  if (numbered) {
    flush_all();
    write_packets(chunk);
  } else {
    write_rows(chunk);
  }
  rows_written_ += chunk.observations.size();
}

void Lvx2Writer::write_packets(const Chunk& chunk) {
  const Observations& o = chunk.observations;
  std::size_t row = 0, imu = 0;
  for (const Packet& packet : chunk.packets) {
    const auto refuse = [&](const std::string& problem) {
      throw InvalidArgument(fmt::format(
          "a packet at row {}: {}; clear Chunk::packets to have new packets formed from the rows",
          rows_written_ + row, problem));
    };
    NumberedHeader header;
    header.number = static_cast<std::uint16_t>(packet.number);
    header.frame = packet.reserved;
    header.time_type = packet.timestamp_type;
    header.time_ns = load<std::uint64_t>(packet.timestamp.data());
    // The specification has no spherical records.
    header.data_type = packet.data_type == kNumberedSpherical ? kNumberedPoints : packet.data_type;
    if (packet.is_imu()) {
      if (imu == chunk.imu.size()) refuse("its inertial sample is missing");
      header.data_type = kNumberedImu;
      header.records = 1;
      state_of(chunk.imu[imu].device, rows_written_ + row);
      encode_imu(chunk.imu[imu], package(chunk.imu[imu].device, header));
      ++imu;
      continue;
    }
    const RecordLayout layout = *numbered_layout(header.data_type, 1);
    if (row + packet.rows > o.size() || packet.rows % std::max<int>(layout.returns, 1) != 0 ||
        layout.returns == 0) {
      refuse(fmt::format("rows = {} of data type {}", packet.rows, packet.data_type));
    }
    // Changed row times, or packets that belong to other rows, must not be lost silently.
    if (header.time_ns > kLatestPackage || numbered_time_ns(packet) != o.time_ns[row]) {
      refuse(fmt::format("time = {} ns, but the packet's timestamp is {} ns", o.time_ns[row],
                         header.time_ns));
    }
    header.records = static_cast<std::uint16_t>(packet.rows / layout.returns);
    State& state = state_of(o.device[row], rows_written_ + row);
    std::uint8_t* bytes = package(o.device[row], header);
    for (std::size_t record = 0; record < header.records; ++record) {
      encode_numbered_record(header.data_type, o, row, rows_written_ + row, bytes);
      bytes += layout.bytes_per_record;
      row += layout.returns;
    }
    state.last_ns = static_cast<std::int64_t>(header.time_ns);
    state.number = static_cast<std::uint16_t>(header.number + 1);
  }
  if (row != o.size() || imu != chunk.imu.size()) {
    throw InvalidArgument(
        fmt::format("the packets hold {} rows and {} inertial samples, the chunk {} and {}; clear "
                    "Chunk::packets to have new packets formed from the rows",
                    row, imu, o.size(), chunk.imu.size()));
  }
}

void Lvx2Writer::write_rows(const Chunk& chunk) {
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

/// Puts one row into its slot of the open package, or into a new one if it does not fit.
void Lvx2Writer::place(const Observations& o, std::size_t row) {
  const std::uint64_t row_number = rows_written_ + row;
  State& state = state_of(o.device[row], row_number);
  OpenPackage& open = state.open;
  const int returns = header_.returns_per_shot;
  const int number = returns == 1 ? 1 : o.return_number[row];
  if (number < 1 || number > returns || o.return_number[row] > returns) {
    throw InvalidArgument(fmt::format("row {}: return_number = {}, allowed 1 to {} in this file",
                                      row_number, o.return_number[row], returns));
  }
  const std::int64_t time = o.time_ns[row];
  const std::uint8_t beams = state.grid.beams;
  const std::uint32_t beam = o.beam[row] % beams;
  std::optional<std::uint32_t> slot;
  if (open.records > 0) {
    const std::int64_t since = time - open.time_ns;
    if (since >= 0 && since < length_ns(state)) {
      const double interval =
          static_cast<double>(state.grid.interval_numerator_ns) / state.grid.interval_denominator;
      const auto nearest =
          static_cast<std::uint32_t>(std::lround(static_cast<double>(since) / interval));
      const bool on_grid = std::abs(since - state.grid.offset_ns(nearest)) <= 1;
      const bool free =
          nearest > open.last_slot || (nearest == open.last_slot && number > open.last_return);
      // A shot's place gives its emitter; 0 in files that do not store emitters.
      const bool its_emitter = beam == 0 || nearest % beams == beam;
      if (on_grid && free && its_emitter && nearest < open.records) slot = nearest;
    }
  }
  if (!slot) {
    flush(o.device[row]);
    start_package(state, time, beam, row_number);
    slot = beam;
  }
  const std::size_t target =
      std::size_t{*slot} * static_cast<std::size_t>(returns) + static_cast<std::size_t>(number - 1);
  Observations& rows = open.rows;
  rows.azimuth[target] = o.azimuth[row];
  rows.zenith[target] = o.zenith[row];
  rows.range[target] = o.range[row];
  rows.intensity[target] = o.intensity[row];
  rows.tag[target] = o.tag[row];
  rows.valid[target] = o.valid[row];
  open.row_numbers[*slot] = row_number;
  open.last_slot = *slot;
  open.last_return = static_cast<std::uint8_t>(number);
}

void Lvx2Writer::start_package(State& state, std::int64_t time_ns, std::uint32_t slot,
                               std::uint64_t row_number) {
  OpenPackage& open = state.open;
  open.time_ns = time_ns - state.grid.offset_ns(slot);
  require_time(open.time_ns, row_number);
  open.records = records();
  open.last_slot = 0;
  open.last_return = 0;
  open.rows.clear();
  open.rows.resize(numbered_layout(data_type_, open.records)->rows());
  open.row_numbers.assign(open.records, row_number);
}

void Lvx2Writer::flush(std::size_t device) {
  State& state = states_[device];
  OpenPackage& open = state.open;
  if (open.records == 0) return;
  NumberedHeader header;
  header.data_type = data_type_;
  header.records = open.records;
  header.time_type = time_type_of(header_.time_reference);
  header.time_ns = static_cast<std::uint64_t>(open.time_ns);
  if (state.last_ns) {  // missing ones keep their numbers
    const double periods =
        static_cast<double>(open.time_ns - *state.last_ns) / static_cast<double>(length_ns(state));
    const double skipped = std::clamp(std::round(periods) - 1.0, 0.0, 1e15);
    state.number = static_cast<std::uint16_t>(state.number + static_cast<std::uint64_t>(skipped));
  }
  header.number = state.number++;
  state.last_ns = open.time_ns;
  std::uint8_t* bytes = package(device, header);
  const RecordLayout layout = *numbered_layout(data_type_, 1);
  for (std::size_t record = 0; record < open.records; ++record) {
    encode_numbered_record(data_type_, open.rows, record * layout.returns, open.row_numbers[record],
                           bytes);
    bytes += layout.bytes_per_record;
  }
  open.records = 0;
}

void Lvx2Writer::flush_all() {
  std::vector<std::size_t> order;
  for (std::size_t device = 0; device < states_.size(); ++device) {
    if (states_[device].open.records > 0) order.push_back(device);
  }
  std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
    return states_[a].open.time_ns < states_[b].open.time_ns;
  });
  for (const std::size_t device : order) flush(device);
}

void Lvx2Writer::write_imu(const ImuSample& sample) {
  State& state = state_of(sample.device, rows_written_);
  // A package whose time is over is written first, so that the device's times do not run backwards.
  if (state.open.records > 0 && sample.time_ns >= state.open.time_ns + length_ns(state)) {
    flush(sample.device);
  }
  require_time(sample.time_ns, rows_written_);
  NumberedHeader header;
  header.data_type = kNumberedImu;
  header.records = 1;
  header.time_type = time_type_of(header_.time_reference);
  header.time_ns = static_cast<std::uint64_t>(sample.time_ns);
  header.number = state.imu_number++;
  encode_imu(sample, package(sample.device, header));
}

void Lvx2Writer::close() {
  flush_all();
  end_frame();
  output_.commit();
}

}  // namespace

const Format kLvx2Format = {
    "lvx-2",         ".lvx2",   "Livox LVX 2 of the Mid-360 and HAP, as written by Livox Viewer 2",
    recognises_lvx2, open_lvx2, create_with<Lvx2Writer>,
};

}  // namespace risley::recordings
