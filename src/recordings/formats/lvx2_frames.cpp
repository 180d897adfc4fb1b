// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/lvx2_frames.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/wire/address.hpp"

namespace risley::recordings {
namespace {

using io::store;

constexpr std::uint8_t kPackageLidarType = 8;  // what Viewer 2 writes

std::vector<LidarId> lidar_ids(const std::vector<Device>& devices) {
  std::set<LidarId> taken;
  std::vector<LidarId> ids;
  for (std::size_t row = 0; row < devices.size(); ++row) {
    const auto address = wire::address_from(devices[row].address);
    // Prefix of the Mid-360's factory addresses.
    LidarId id =
        address ? address->bytes : LidarId{192, 168, 1, static_cast<std::uint8_t>(100 + row)};
    for (int i = 0; i < 256 && taken.contains(id); ++i) ++id[3];
    taken.insert(id);
    ids.push_back(id);
  }
  return ids;
}

}  // namespace

Lvx2Head lvx2_head(const std::vector<Device>& devices) {
  constexpr std::size_t kMostDevices = 255;
  if (devices.empty() || devices.size() > kMostDevices) {
    throw InvalidArgument(
        fmt::format("number of devices = {}, allowed 1 to 255 in LVX", devices.size()));
  }
  const std::vector<LidarId> ids = lidar_ids(devices);
  std::vector<std::uint8_t> head(kLvx2TableAt + devices.size() * kLvx2DeviceBytes);
  std::copy(kLvxName.begin(), kLvxName.end(), head.begin());
  head[kLvxName.size()] = 2;
  store<std::uint32_t>(&head[20], kLvxMagicCode);
  store<std::uint32_t>(&head[kLvx2DurationAt], kLvx2FrameMs);
  head[kLvx2CountAt] = static_cast<std::uint8_t>(devices.size());
  std::uint8_t* bytes = &head[kLvx2TableAt];
  for (std::size_t row = 0; row < devices.size(); ++row, bytes += kLvx2DeviceBytes) {
    const Device& device = devices[row];
    if (device.serial.size() > kLvx2SerialBytes) {
      throw InvalidArgument(fmt::format("serial '{}' has {} characters, allowed at most 16",
                                        device.serial, device.serial.size()));
    }
    std::copy(device.serial.begin(), device.serial.end(), bytes);
    std::copy(ids[row].begin(), ids[row].end(), bytes + kIdAt);
    constexpr std::uint8_t kUsual = 247, kOfHap = 246;  // value in files of these sensors
    bytes[kLidarTypeAt] = device.type == kHap || device.type == kHapT1 ? kOfHap : kUsual;
    bytes[kDeviceTypeAt] = device.type;
    bytes[kEnableAt] = device.extrinsic_enabled ? 1 : 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      store<float>(bytes + kPoseAt + 4 * axis, device.roll_pitch_yaw_deg[axis]);
      store<float>(bytes + kPoseAt + 12 + 4 * axis, device.translation_m[axis]);
    }
  }
  return {std::move(head), ids};
}

void put_lvx2_package(const LidarId& id, const livox::NumberedHeader& header, std::size_t length,
                      std::uint8_t* bytes) {
  std::fill_n(bytes, kLvx2PackageBytes, std::uint8_t{0});
  std::copy(id.begin(), id.end(), bytes + kPackageIdAt);
  bytes[kPackageLidarTypeAt] = kPackageLidarType;
  bytes[kPackageTimeTypeAt] = header.time_type;
  store<std::uint64_t>(bytes + kPackageTimeAt, header.time_ns);
  store<std::uint16_t>(bytes + kPackageNumberAt, header.number);
  bytes[kPackageDataTypeAt] = header.data_type;
  store<std::uint32_t>(bytes + kPackageLengthAt, static_cast<std::uint32_t>(length));
  bytes[kPackageFrameAt] = header.frame;
}

bool Lvx2FrameCut::begins_frame(std::size_t device, std::int64_t time_ns) {
  constexpr std::int64_t kFrame_ns = std::int64_t{kLvx2FrameMs} * 1'000'000;
  const auto& begin = begins_ns_[device];
  const bool fits =
      any_ && (!begin || (time_ns >= *begin - kFrame_ns && time_ns < *begin + kFrame_ns));
  if (!fits) begins_ns_.assign(begins_ns_.size(), std::nullopt);
  any_ = true;
  if (!begins_ns_[device]) begins_ns_[device] = time_ns;
  return !fits;
}

}  // namespace risley::recordings
