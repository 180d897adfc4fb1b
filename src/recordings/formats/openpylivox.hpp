// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "risley/recordings/observations.hpp"

// Common part of the text and the binary captures of openpylivox. Both hold one sensor and only
// returns with a distance: its name, its clock's origin and shots without return are lost.
namespace risley::recordings {

inline constexpr std::string_view kOpenpylivoxCsvName = "openpylivox-csv";
inline constexpr std::string_view kOpenpylivoxBinName = "openpylivox-bin";

/// Type of the records in a file.
struct OpenpylivoxLayout {
  bool imu = false;       ///< inertial samples and no points
  int firmware_type = 1;  ///< 1 normal; 2 dual, 3 triple: Mid-40 firmware, one record per return
  int data_type = 1;      ///< 0 to 5 as in the sensor's packets

  bool cartesian() const { return data_type % 2 == 0; }
  bool tagged() const { return data_type >= 2; }
  bool paired() const { return data_type >= 4; }  ///< both returns of a shot in one record
  int returns_per_shot() const { return paired() ? 2 : firmware_type; }
};

/// Layout for rows of this recording: its own if it came from openpylivox, otherwise the one with
/// its coordinates, returns per shot and (not for the Mid-40) tags.
/// @throws InvalidArgument when it has no ranges or more returns than any layout can hold
OpenpylivoxLayout openpylivox_layout(const RecordingHeader& header);

/// Fills the header of a recording with this layout.
void describe_openpylivox(RecordingHeader& header, const OpenpylivoxLayout& layout);

/// Checks the rows being written to a file.
class OpenpylivoxRowFilter {
 public:
  /// Whether the row holds a return and must be written.
  /// @throws InvalidArgument when the range or angles are not numbers, or a second device appears
  bool accepts(const Observations& rows, std::size_t row);

 private:
  std::uint64_t rows_seen_ = 0;
  std::optional<std::uint8_t> device_;
};

}  // namespace risley::recordings
