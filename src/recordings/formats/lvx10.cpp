// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>

#include "risley/io/little_endian.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/lvx_reader.hpp"

namespace risley::recordings {
namespace {

using io::load;

constexpr std::size_t kLvx10DeviceCountAt = kLvxPublicHeaderBytes;
constexpr std::size_t kLvx10DeviceBytes = 58;
constexpr std::size_t kPackageBytes = kLvxPackageHeaderBytes + 1300;

bool recognises_lvx10(std::string_view head) {
  return head.starts_with(kLvxName) &&
         head.substr(kLvxName.size(), 4) == std::string_view("\1\0\0\0", 4);
}

/// Bytes of a frame header: files with 24 and with 32 are known, and the header does not say
/// which. The size after which complete packages follow is right.
std::size_t probe_frame_header(io::BlockInput& file, std::uint64_t first_frame,
                               const std::vector<Device>& devices) {
  constexpr std::size_t kShort = 24, kLong = 32;
  constexpr int kFrames = 100;
  std::uint64_t frame = first_frame;
  for (int i = 0; i < kFrames && frame + kShort <= file.size(); ++i) {
    const std::uint8_t* header = file.at(frame, kShort);
    const auto next = load<std::uint64_t>(header + kLvxFrameNextAt);
    const bool closed =
        load<std::uint64_t>(header) == frame && next >= frame + kShort && next <= file.size();
    const std::uint64_t end = closed ? next : file.size();
    const auto fits = [&](std::size_t header_bytes) {
      const std::uint64_t start = frame + header_bytes;
      if (closed && (next < start || (next - start) % kPackageBytes != 0)) return false;
      if (closed && next == start) return true;  // an empty frame
      if (start + kPackageBytes > end) return false;
      const std::uint8_t* package = file.at(start, kLvxPackageHeaderBytes);
      const bool known_device =
          std::any_of(devices.begin(), devices.end(),
                      [&](const Device& device) { return device.index == package[0]; });
      const bool has_version = package[1] != 0, slot_possible = package[2] <= 9;
      return known_device && has_version && slot_possible && package[10] == 0;
    };
    const bool fits_short = fits(kShort), fits_long = fits(kLong);
    if (fits_short != fits_long) return fits_short ? kShort : kLong;
    if (!closed) break;
    frame = next;
  }
  return kLong;
}

std::unique_ptr<Reader> open_lvx10(const io::InputFile& input, const Progress&) {
  io::BlockInput file(input);
  lvx_version(file);
  const std::size_t count = *lvx_header_bytes(file, kLvx10DeviceCountAt, 1, "number of devices");
  RecordingHeader header;
  header.format = kLvx10Format.name;
  header.devices = read_lvx_devices(file, kLvx10DeviceCountAt + 1, count, false);
  LvxVersion version;
  version.float_points = true;
  version.first_frame = kLvx10DeviceCountAt + 1 + count * kLvx10DeviceBytes;
  version.frame_header_bytes = probe_frame_header(file, version.first_frame, header.devices);
  return std::make_unique<LvxReader>(std::move(file), std::move(header), version);
}

}  // namespace

const Format kLvx10Format = {
    "lvx-1.0",        "",         "Livox LVX 1.0, early Mid-40 and Mid-100 recordings",
    recognises_lvx10, open_lvx10, nullptr,
};

}  // namespace risley::recordings
