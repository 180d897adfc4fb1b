// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The layout of LVX 2, shared by the writer of recordings and the one for running sensors.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "risley/recordings/livox/numbered_packet.hpp"
#include "risley/recordings/observations.hpp"

#include "recordings/formats/lvx_reader.hpp"

namespace risley::recordings {

/// Packages name their device by it: its IP address.
using LidarId = std::array<std::uint8_t, 4>;

inline constexpr std::size_t kLvx2DurationAt = kLvxPublicHeaderBytes, kLvx2CountAt = 28,
                             kLvx2TableAt = 29, kLvx2DeviceBytes = 63, kLvx2FrameHeaderBytes = 24;
// In an entry of the device table.
inline constexpr std::size_t kLvx2SerialBytes = 16, kIdAt = 32, kLidarTypeAt = 36,
                             kDeviceTypeAt = 37, kEnableAt = 38, kPoseAt = 39;
// Before the points of a package.
inline constexpr std::size_t kLvx2PackageBytes = 27, kPackageIdAt = 1, kPackageLidarTypeAt = 5,
                             kPackageTimeTypeAt = 6, kPackageTimeAt = 7, kPackageNumberAt = 15,
                             kPackageDataTypeAt = 17, kPackageLengthAt = 18, kPackageFrameAt = 22;
/// Length of a frame.
inline constexpr std::uint32_t kLvx2FrameMs = 50;

/// The part before the first frame, and the ids of the devices.
struct Lvx2Head {
  std::vector<std::uint8_t> bytes;
  std::vector<LidarId> ids;  ///< no two the same
};
/// @throws InvalidArgument for no device, more than 255 and serial numbers that are too long
Lvx2Head lvx2_head(const std::vector<Device>& devices);

/// @param length  bytes of the records  @param bytes  [kLvx2PackageBytes]
void put_lvx2_package(const LidarId& id, const livox::NumberedHeader& header, std::size_t length,
                      std::uint8_t* bytes);

/// Determines where frames begin: they hold 50 ms by the clock of each device.
class Lvx2FrameCut {
 public:
  explicit Lvx2FrameCut(std::size_t devices) : begins_ns_(devices) {}
  /// Whether the next package begins a frame, as the first one does.
  bool begins_frame(std::size_t device, std::int64_t time_ns);

 private:
  std::vector<std::optional<std::int64_t>> begins_ns_;  // of the current frame, by device
  bool any_ = false;
};

}  // namespace risley::recordings
