// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_file.hpp"

#include <utility>

#include "risley/io/little_endian.hpp"

#include "recordings/formats/lvx11_head.hpp"
#include "recordings/formats/lvx2_frames.hpp"
#include "recordings/formats/lvx_reader.hpp"

namespace risley::recordings::livox {
namespace {

constexpr std::uint32_t kFrameDurationMs = 50;

}  // namespace

/// State that LVX 2 needs from package to package.
struct PacketFile::Numbered {
  std::vector<LidarId> ids;
  Lvx2FrameCut cut;
};

PacketFile::PacketFile(const std::string& path, const std::vector<Device>& devices, bool numbered)
    : file_(path) {
  try {
    if (numbered) {
      Lvx2Head head = lvx2_head(devices);
      numbered_ =
          std::make_unique<Numbered>(Numbered{std::move(head.ids), Lvx2FrameCut(devices.size())});
      file_.append(std::move(head.bytes));
    } else {
      file_.append(lvx11_head(devices, kFrameDurationMs));
    }
    file_.settle();
  } catch (...) {
    file_.discard();
    throw;
  }
}

PacketFile::~PacketFile() {
  if (!closed_ && frames_ == 0) file_.discard();
}

void PacketFile::add(std::uint8_t device_index, std::span<const std::uint8_t> packet) {
  static_assert(kLvx11FrameHeaderBytes == kLvx2FrameHeaderBytes);
  if (!numbered_) {
    if (frame_.empty()) frame_.resize(kLvx11FrameHeaderBytes);
    frame_.push_back(device_index);
    frame_.insert(frame_.end(), packet.begin(), packet.end());
    return;
  }
  const NumberedHeader header = decode_numbered_header(packet);
  if (numbered_->cut.begins_frame(device_index, static_cast<std::int64_t>(header.time_ns))) {
    write_frame();
    frame_.resize(kLvx2FrameHeaderBytes);
  }
  const std::size_t length = numbered_layout(header.data_type, header.records)->bytes();
  const std::size_t at = frame_.size();
  frame_.resize(at + kLvx2PackageBytes);
  put_lvx2_package(numbered_->ids[device_index], header, length, &frame_[at]);
  const auto records = packet.subspan(kNumberedHeaderBytes, length);
  frame_.insert(frame_.end(), records.begin(), records.end());
}

void PacketFile::end_frame() {
  if (!numbered_) write_frame();
}

void PacketFile::write_frame() {
  if (frame_.empty()) return;
  io::store<std::uint64_t>(frame_.data(), size());
  io::store<std::uint64_t>(&frame_[kLvxFrameNextAt], size() + frame_.size());
  io::store<std::uint64_t>(&frame_[kLvxFrameIndexAt], frames_);
  frame_ = file_.append(std::move(frame_));
  ++frames_;
}

void PacketFile::settle() {
  write_frame();
  file_.settle();
}

void PacketFile::close() {
  write_frame();
  file_.commit();
  closed_ = true;
}

void PacketFile::discard() {
  file_.discard();
  closed_ = true;
}

}  // namespace risley::recordings::livox
