// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/lvx_reader.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "risley/io/little_endian.hpp"
#include "risley/recordings/livox/first_packets.hpp"

namespace risley::recordings {

using namespace livox;

namespace {

using io::load;

}  // namespace

std::string lvx_text(const std::uint8_t* bytes, std::size_t count) {
  return {bytes, std::find(bytes, bytes + count, std::uint8_t{0})};
}

const std::uint8_t* lvx_header_bytes(io::BlockInput& file, std::uint64_t offset, std::size_t count,
                                     std::string_view part) {
  if (offset > file.size() || count > file.size() - offset) {
    throw FileError(file.path(), {file.size(), {}},
                    fmt::format("the file ends within the {}, which takes {} bytes from byte {} on",
                                part, count, offset));
  }
  return file.at(offset, count);
}

std::array<std::uint8_t, 4> lvx_version(io::BlockInput& file) {
  const std::uint8_t* bytes = lvx_header_bytes(file, 0, kLvxPublicHeaderBytes, "LVX file header");
  if (!std::equal(kLvxName.begin(), kLvxName.end(), bytes,
                  [](char a, std::uint8_t b) { return static_cast<std::uint8_t>(a) == b; })) {
    throw FileError(file.path(), {0, {}}, "expected 'livox_tech' and six zero bytes");
  }
  const auto code = load<std::uint32_t>(bytes + 20);
  if (code != kLvxMagicCode) {
    throw FileError(
        file.path(), {20, {}},
        fmt::format("expected the magic code {:08X} of LVX, found {:08X}", kLvxMagicCode, code));
  }
  return {bytes[16], bytes[17], bytes[18], bytes[19]};
}

std::vector<Device> read_lvx_devices(io::BlockInput& file, std::uint64_t offset, std::size_t count,
                                     bool has_extrinsic_flag) {
  if (count == 0) {
    throw FileError(file.path(), {offset - 1, {}}, "number of devices = 0, allowed 1 to 255");
  }
  const std::size_t bytes_per_device = has_extrinsic_flag ? 59 : 58;
  const std::uint8_t* bytes =
      lvx_header_bytes(file, offset, count * bytes_per_device, "device table");
  std::vector<Device> devices(count);
  for (std::size_t i = 0; i < count; ++i, bytes += bytes_per_device) {
    Device& device = devices[i];
    device.serial = lvx_text(bytes, 16);
    device.hub_serial = lvx_text(bytes + 16, 16);
    device.index = bytes[32];
    device.type = bytes[33];
    device.extrinsic_enabled = has_extrinsic_flag && bytes[34] != 0;
    const std::uint8_t* numbers = bytes + bytes_per_device - 24;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      device.roll_pitch_yaw_deg[axis] = load<float>(numbers + 4 * axis);
      device.translation_m[axis] = load<float>(numbers + 12 + 4 * axis);
    }
    for (std::size_t other = 0; other < i; ++other) {
      if (devices[other].index == device.index) {
        throw FileError(
            file.path(), {offset + i * bytes_per_device + 32, {}},
            fmt::format("device index {} is used twice in the device table", device.index));
      }
    }
  }
  return devices;
}

LvxFrameReader::LvxFrameReader(io::BlockInput file, RecordingHeader header,
                               std::uint64_t first_frame, std::size_t frame_header_bytes)
    : file_(std::move(file)), first_frame_(first_frame), frame_header_bytes_(frame_header_bytes) {
  header_ = std::move(header);
  rewind_frames();
}

void LvxFrameReader::rewind_frames() {
  position_ = first_frame_;
  frames_ = 0;
  in_frame_ = open_ended_ = ended_ = told_end_ = false;
  failure_.reset();
  warnings_.clear();
}

LvxReader::LvxReader(io::BlockInput file, RecordingHeader header, const LvxVersion& version)
    : LvxFrameReader(std::move(file), std::move(header), version.first_frame,
                     version.frame_header_bytes),
      float_points_(version.float_points) {
  grids_.resize(header_.devices.size());
  device_rows_.fill(-1);
  for (std::size_t row = 0; row < header_.devices.size(); ++row) {
    device_rows_[header_.devices[row].index] = static_cast<int>(row);
  }
  rewind();
  describe();
}

void LvxReader::rewind() {
  rewind_frames();
  decoders_.clear();
  for (std::size_t row = 0; row < header_.devices.size(); ++row) make_decoder(row);
  clock_wraps_ = 0;
  stepped_over_.clear();
  frames_stepped_over_.clear();
}

/// A new decoder of a device's packets.
void LvxReader::make_decoder(std::size_t device_row) {
  const PacketDecoder decoder({.device_type = header_.devices[device_row].type,
                               .device = static_cast<std::uint8_t>(device_row),
                               .grid = grids_[device_row],
                               .float_points = float_points_});
  if (device_row == decoders_.size()) {
    decoders_.push_back(decoder);
  } else {
    decoders_[device_row] = decoder;
  }
}

/// Completes the header from the first packets: their contents, the origin of their times, and the
/// shot rate of devices whose type does not determine it.
void LvxReader::describe() {
  constexpr std::size_t kEnoughRows = 20'000;
  std::vector<FirstPackets> first(header_.devices.size());
  Chunk chunk;
  // Damage after the first undamaged packets is reported when the caller reaches it.
  try {
    read(chunk, kEnoughRows);
  } catch (const FileError&) {
    chunk.clear();
  }
  bool described = false;
  std::size_t row = 0;
  for (const Packet& packet : chunk.packets) {
    if (packet.rows == 0) continue;
    const RecordLayout& layout = *record_layout(packet.data_type);
    if (!described) {
      header_.time_reference = time_reference_of(packet.timestamp_type);
      header_.cartesian = layout.cartesian;
      header_.returns_per_shot = layout.returns;
      described = true;
    }
    first[chunk.observations.device[row]].add(packet, chunk.observations, row);
    row += packet.rows;
  }
  if (!described) {
    header_.cartesian = float_points_;
  }

  std::vector<Warning> unknown;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const FirstPackets& device = first[i];
    if (device.empty() || float_points_) continue;
    grids_[i] = device.grid(header_.devices[i].type);
    if (!grids_[i]) continue;
    header_.returns_per_shot = std::max<int>(header_.returns_per_shot, grids_[i]->records_per_shot);
    if (!shot_grid(header_.devices[i].type, device.data_type())) {
      unknown.push_back(
          {kWarning.devices_unclear,
           fmt::format("device {} has the unknown type {}; judging by the times of its packets, it "
                       "measures at {} kHz",
                       i, header_.devices[i].type, grids_[i]->beams > 1 ? 240 : 100)});
    }
  }
  rewind();
  warnings_ = std::move(unknown);
}

double LvxFrameReader::fraction_read() const {
  return static_cast<double>(std::min(position_, file_.size())) / static_cast<double>(file_.size());
}

void LvxFrameReader::fail(std::uint64_t offset, std::string problem) {
  failure_.emplace(file_.path(), FilePlace{offset, {}}, std::move(problem));
  ended_ = true;
}

bool LvxFrameReader::read(Chunk& chunk, std::size_t max_rows) {
  chunk.packets.clear();
  chunk.imu.clear();
  chunk.packet_begins.clear();
  rows_ = 0;
  // Room for all rows at once, with the previous rows. No record has less than 7 bytes per row, so
  // a huge max_rows costs no memory.
  const std::uint64_t left = file_.size() - std::min(position_, file_.size());
  chunk.observations.resize(static_cast<std::size_t>(std::min<std::uint64_t>(max_rows, left / 7)));
  while (!ended_) {
    if (!in_frame_) {
      open_frame();
    } else if (!next_package(chunk, max_rows)) {
      break;
    }
  }
  chunk.observations.resize(rows_);
  if (ended_ && !std::exchange(told_end_, true)) at_end();
  if (!chunk.packets.empty()) return true;
  if (failure_) throw FileError(*failure_);
  return false;
}

void LvxFrameReader::open_frame() {
  if (position_ == file_.size()) {
    ended_ = true;
    if (frames_ == 0) {
      warn(kWarning.cut_off, "the file ends before its first frame").place = {position_, {}};
    }
    return;
  }
  const std::uint64_t left = file_.size() - position_;
  if (left < frame_header_bytes_) {
    warn(kWarning.cut_off, "cut off while recording: {} bytes are left, a frame header has {}",
         left, frame_header_bytes_)
        .place = {position_, {}};
    position_ = file_.size();
    ended_ = true;
    return;
  }
  const std::uint8_t* bytes = file_.at(position_, frame_header_bytes_);
  const auto current = load<std::uint64_t>(bytes);
  if (current != position_) {
    fail(position_,
         fmt::format("expected a frame header with its own position, found the position {}",
                     current));
    return;
  }
  next_offset_ = load<std::uint64_t>(bytes + kLvxFrameNextAt);
  position_ += frame_header_bytes_;
  open_ended_ = next_offset_ < position_ || next_offset_ > file_.size();
  frame_end_ = open_ended_ ? file_.size() : next_offset_;
  in_frame_ = true;
  ++frames_;
}

void LvxFrameReader::stop_at_cut(std::optional<std::size_t> records) {
  const std::uint64_t left = frame_end_ - position_;
  std::string message = "cut off while recording: ";
  if (left == 0) {
    message += "the last packet is complete";
  } else if (records) {
    message += fmt::format("only {} bytes of a packet of {} records are there", left, *records);
  } else {
    message += fmt::format("only {} bytes of a packet are there", left);
  }
  if (open_ended_ && next_offset_ > file_.size()) {
    message += fmt::format("; its frame should end at byte {}", next_offset_);
  } else if (open_ended_) {
    message += fmt::format("; its frame was never closed (next offset {})", next_offset_);
  }
  warnings_.push_back({kWarning.cut_off, message, {position_, {}}, records.value_or(0)});
  position_ = file_.size();
  ended_ = true;
}

void LvxFrameReader::pass_package(std::uint64_t bytes, std::size_t rows) {
  rows_ += rows;
  position_ += bytes;
}

void LvxFrameReader::skip_frame() {
  position_ = frame_end_;
  in_frame_ = false;
  ended_ = open_ended_;
}

bool LvxFrameReader::next_package(Chunk& chunk, std::size_t max_rows) {
  const std::uint64_t left = frame_end_ - position_;
  if (left == 0) {
    in_frame_ = false;
    if (open_ended_) stop_at_cut(0);
    return true;
  }
  // A frame that was never closed may still be followed by a complete one.
  if (open_ended_ && left >= frame_header_bytes_ &&
      load<std::uint64_t>(file_.at(position_, sizeof(std::uint64_t))) == position_) {
    warn(kWarning.header_contradicted, "the previous frame was never closed (next offset {})",
         next_offset_)
        .place = {position_, {}};
    in_frame_ = false;
    return true;
  }
  return read_package(chunk, max_rows, left);
}

void LvxReader::step_over(std::uint8_t data_type) {
  // One warning per data type, however long the recording is.
  const std::uint64_t frames = ++frames_stepped_over_[data_type];
  const auto [entry, is_new] = stepped_over_.try_emplace(data_type, warnings_.size());
  if (is_new) warnings_.push_back({kWarning.content_left_out, {}, {position(), {}}});
  warnings_[entry->second].message = fmt::format(
      "a packet has the unknown data type {}; the rest of {} was skipped", data_type,
      frames == 1 ? std::string("its frame") : fmt::format("its frame and of {} more", frames - 1));
  skip_frame();
}

bool LvxReader::read_package(Chunk& chunk, std::size_t max_rows, std::uint64_t left) {
  const std::size_t known = std::min<std::uint64_t>(left, kLvxPackageHeaderBytes);
  const std::uint8_t* bytes = file().at(position(), known);
  const int device = device_rows_[bytes[0]];
  if (device < 0) {
    fail(position(),
         fmt::format("a packet names device {}, which is not in the device table", bytes[0]));
    return true;
  }
  // LVX 1.0 was written before the version was settled.
  if (known > 1 && (float_points_ ? bytes[1] == 0 : bytes[1] != kPacketVersion)) {
    fail(position() + 1, fmt::format("packet version = {}, expected {}", bytes[1], kPacketVersion));
    return true;
  }
  const RecordLayout* layout = nullptr;
  if (known > 1 + kDataTypeAt) {
    const std::uint8_t data_type = bytes[1 + kDataTypeAt];
    layout = float_points_ && data_type != 0 ? nullptr : record_layout(data_type);
    if (!layout) {
      if (known < kLvxPackageHeaderBytes && !at_file_end()) {
        fail(position(), fmt::format("a packet of the unknown data type {} does not fit into its "
                                     "frame, which ends at byte {}",
                                     data_type, frame_end()));
      } else {
        step_over(data_type);
      }
      return true;
    }
  }
  if (known < kLvxPackageHeaderBytes || kLvxPackageHeaderBytes + layout->bytes() > left) {
    if (at_file_end()) {
      stop_at_cut(layout ? std::optional<std::size_t>(layout->records) : std::nullopt);
    } else {
      fail(position(),
           fmt::format("a packet does not fit into its frame, which ends at byte {}", frame_end()));
    }
    return true;
  }

  // Packets stay complete; a single one is delivered however small the chunk should be.
  if (has_to_wait(chunk, max_rows, layout->rows())) return false;
  const auto device_row = static_cast<std::size_t>(device);
  const std::uint8_t device_type = header_.devices[device_row].type,
                     data_type = bytes[1 + kDataTypeAt];
  if (!grids_[device_row] && !shot_grid(device_type, data_type)) {
    grids_[device_row] = kGrid100kHz;  // the first packets did not show it either
    make_decoder(device_row);
  }
  PacketDecoder& decoder = decoders_[device_row];
  const std::uint64_t wraps_before = decoder.clock_wraps();
  const std::span package(file().at(position(), kLvxPackageHeaderBytes + layout->bytes()),
                          kLvxPackageHeaderBytes + layout->bytes());
  try {
    chunk.observations.resize(std::max(chunk.observations.size(), rows() + layout->rows()));
    decoder.decode_into(package.subspan(1), chunk, rows());
  } catch (const BadPacket& bad) {
    fail(position() + 1 + bad.byte_offset(), bad.problem());
    return true;
  }
  clock_wraps_ += decoder.clock_wraps() - wraps_before;
  chunk.packets.back().device_index = package[0];
  chunk.packets.back().frame = frames() - 1;
  pass_package(kLvxPackageHeaderBytes + layout->bytes(), layout->rows());
  return true;
}

}  // namespace risley::recordings
