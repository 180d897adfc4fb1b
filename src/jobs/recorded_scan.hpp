// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::jobs {

/// Timing of the shots of a sensor type; empty if that is not known.
/// @param device_type  Device::type
std::optional<recordings::livox::ShotGrid> grid_of_type(int device_type);
/// The supported types, for messages.
std::string emulated_types_text();

/// The shots of a recording on the time grid of a sensor, with its gaps, in a loop.
class RecordedScan {
 public:
  /// @param sensor_type  Device::type if the recording does not name one
  /// @throws FileError; InvalidArgument for a recording of several sensors, without times or
  /// ranges, and of a type unknown to Livox's protocol
  RecordedScan(std::string path, std::uint8_t sensor_type);

  const recordings::Device& device() const { return device_; }       ///< serial number and type
  const recordings::livox::ShotGrid& grid() const { return grid_; }  ///< of its shots

  /// The returns of the next shot of the grid; without a return if the recording has no shot.
  /// @param record  as many rows as the sensor sends returns @throws FileError
  void next(recordings::Observations& record);

 private:
  void open();
  /// Comes to the next row. @return whether there is one
  bool find_row();
  std::int64_t slot_of_row() const;

  std::string path_;
  recordings::Source source_;  ///< held open
  recordings::Device device_;
  recordings::livox::ShotGrid grid_;
  std::unique_ptr<recordings::Reader> reader_;
  recordings::Chunk chunk_;
  std::size_t row_ = 0;
  std::int64_t slot_ = 0;                 // of the next shot
  std::optional<std::int64_t> begin_ns_;  // time of slot 0
};

}  // namespace risley::jobs
