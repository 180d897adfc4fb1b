// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/recordings/las_numbers.hpp"

#include "cloud/formats/point_fields.hpp"

namespace risley::cloud::las {

/// Statistics of the points for the public header, gathered while they are packed.
struct Summary {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  std::uint64_t points = 0;
  std::array<std::uint64_t, 15> points_by_return{};
  /// Least and greatest X, Y and Z, in steps of the scale and not yet rounded.
  std::array<double, 3> low{kInfinity, kInfinity, kInfinity};
  std::array<double, 3> high{-kInfinity, -kInfinity, -kInfinity};
  std::int64_t first_time_ns = 0;  ///< of the first point
};

/// A variable length record.
struct VariableLengthRecord {
  std::string user;          ///< at most 16 characters
  std::uint16_t number = 0;  ///< record ID
  std::string description;   ///< at most 32 characters
  std::string data;          ///< at most 65535 bytes
};

/// The public header's numbers that depend on the points, as stored in the file.
struct HeaderNumbers {
  std::uint16_t creation_day = 0, creation_year = 0;  ///< 0 where unknown
  std::array<double, 3> low{}, high{};                ///< m; 0 without points
};

/// Header (las_header.cpp) and point records (las_records.cpp) of one LAS 1.4 file with point
/// format 6 [ASPRS LAS 1.4-R15].
///
/// - X, Y, Z: multiples of the scale from the frame's offset on. The bounding box is that of the
///   stored numbers.
/// - Intensity: the sensor's 0-255 times 256, which the specification asks of a range of 256.
/// - GPS time: adjusted standard GPS time (GPS seconds minus 1e9) where the recording's clock is
///   UTC, which counts no leap seconds; otherwise the recording's own seconds.
/// - Scan angle: 0. It is an angle about the flight direction and means nothing for beams that
///   prisms steer.
/// - Classification 0 (never classified), all flags, user data and scanner channel 0. File source
///   1; point source the strip of a flight, otherwise 1: the points are of this file.
/// - The trajectory's errors of a moving sensor: records of the user "risley", docs/files.md.
/// - Extra bytes: the other fields, first those of float32.
/// - File creation date: that of the first point in UTC, otherwise that of the options. It is never
/// today: the same points give the same bytes.
class Layout {
 public:
  /// @throws InvalidArgument for a scale that is not positive, and for more common factors or
  /// provenance than a variable length record has room for
  Layout(const CloudHeader& header, const CloudWriterOptions& options);

  double scale() const { return scale_; }
  const std::array<double, 3>& offset() const { return offset_; }
  std::size_t header_bytes() const { return recordings::las::header_bytes(4); }
  std::size_t base_record_bytes() const { return recordings::las::kRecordBytes[point_format()]; }
  std::size_t record_bytes() const { return base_record_bytes() + extra_.record_bytes(); }
  std::uint8_t point_format() const { return 6; }
  std::uint16_t global_encoding() const;
  const std::string& system_identifier() const { return system_identifier_; }
  const std::string& generating_software() const { return generating_software_; }
  const std::vector<VariableLengthRecord>& records() const { return records_; }

  HeaderNumbers numbers(const Summary& summary) const;
  /// Everything before the first point; its length does not depend on the points.
  std::vector<std::uint8_t> head(const Summary& summary) const;

  /// Points per call of pack: its output stays in the cache, and so do its columns.
  static constexpr std::size_t kBlock = 256;

  /// Packs the rows [first, first + rows), at most kBlock, into records one after another.
  /// Exceptions count points from 1 over the whole file.
  /// @throws InvalidArgument for a coordinate or a return that the format cannot hold; the summary
  /// is then invalid
  void pack(const Points& points, std::size_t first, std::size_t rows, std::uint8_t* out,
            Summary& summary);

 private:
  void pack_coordinates(const Points& points, std::size_t first, std::size_t rows,
                        Summary& summary);
  void pack_returns(const Points& points, std::size_t first, std::size_t rows, Summary& summary);
  void pack_times(const Points& points, std::size_t first, std::size_t rows);

  double scale_;
  std::array<double, 3> offset_;
  bool has_point_source_;
  bool utc_;                                   ///< times are UTC
  bool gps_time_;                              ///< and stored as GPS time
  std::optional<std::chrono::sys_days> date_;  ///< of other clocks
  std::string system_identifier_, generating_software_;
  std::vector<VariableLengthRecord> records_;
  RecordPacker extra_;  ///< bytes

  // Columns of one block.
  std::array<std::array<double, kBlock>, 3> coordinates_;  ///< see pack_coordinates
  std::array<double, kBlock> times_;                       ///< s
  std::array<std::uint32_t, kBlock> returns_;              ///< intensity and the bits after it
};

}  // namespace risley::cloud::las
