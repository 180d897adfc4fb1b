// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/livox/packet_file.hpp"

#include <utility>

#include "risley/io/little_endian.hpp"

#include "recordings/formats/lvx11_head.hpp"
#include "recordings/formats/lvx_reader.hpp"

namespace risley::recordings::livox {
namespace {

constexpr std::uint32_t kFrameDurationMs = 50;

}  // namespace

PacketFile::PacketFile(const std::string& path, const std::vector<Device>& devices) : file_(path) {
  try {
    file_.append(lvx11_head(devices, kFrameDurationMs));
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
  if (frame_.empty()) frame_.resize(kLvx11FrameHeaderBytes);
  frame_.push_back(device_index);
  frame_.insert(frame_.end(), packet.begin(), packet.end());
}

void PacketFile::end_frame() {
  if (frame_.empty()) return;
  io::store<std::uint64_t>(frame_.data(), size());
  io::store<std::uint64_t>(&frame_[kLvxFrameNextAt], size() + frame_.size());
  io::store<std::uint64_t>(&frame_[kLvxFrameIndexAt], frames_);
  frame_ = file_.append(std::move(frame_));
  ++frames_;
}

void PacketFile::settle() {
  end_frame();
  file_.settle();
}

void PacketFile::close() {
  end_frame();
  file_.commit();
  closed_ = true;
}

void PacketFile::discard() {
  file_.discard();
  closed_ = true;
}

}  // namespace risley::recordings::livox
