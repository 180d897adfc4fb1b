// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Where things stand in LVX 2, and what who writes it has to know: a writer of recordings, and one
// that grows while sensors run.
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

/// By which packages name their device: its IP address.
using LidarId = std::array<std::uint8_t, 4>;

inline constexpr std::size_t kLvx2DurationAt = kLvxPublicHeaderBytes, kLvx2CountAt = 28,
                             kLvx2TableAt = 29, kLvx2DeviceBytes = 63, kLvx2FrameHeaderBytes = 24;
// In an entry of the device table.
inline constexpr std::size_t kLvx2SerialBytes = 16, kIdAt = 32, kLidarTypeAt = 36,
                             kDeviceTypeAt = 37, kEnableAt = 38, kPoseAt = 39;
// In front of the points of a package.
inline constexpr std::size_t kLvx2PackageBytes = 27, kPackageIdAt = 1, kPackageLidarTypeAt = 5,
                             kPackageTimeTypeAt = 6, kPackageTimeAt = 7, kPackageNumberAt = 15,
                             kPackageDataTypeAt = 17, kPackageLengthAt = 18, kPackageFrameAt = 22;
/// Length of a frame.
inline constexpr std::uint32_t kLvx2FrameMs = 50;

/// What stands in front of the first frame, and the ids of the devices.
struct Lvx2Head {
  std::vector<std::uint8_t> bytes;
  std::vector<LidarId> ids;  ///< no two the same
};
/// @throws InvalidArgument for no device, more than 255 and serial numbers that are too long
Lvx2Head lvx2_head(const std::vector<Device>& devices);

/// @param length  bytes of the records  @param bytes  [kLvx2PackageBytes]
void put_lvx2_package(const LidarId& id, const livox::NumberedHeader& header, std::size_t length,
                      std::uint8_t* bytes);

/// Says where frames begin: they hold 50 ms by the clock of each device.
class Lvx2FrameCut {
 public:
  explicit Lvx2FrameCut(std::size_t devices) : begins_ns_(devices) {}
  /// Whether the next package begins a frame, as the first one does.
  bool begins_frame(std::size_t device, std::int64_t time_ns);

 private:
  std::vector<std::optional<std::int64_t>> begins_ns_;  // of the present frame, by device
  bool any_ = false;
};

}  // namespace risley::recordings
