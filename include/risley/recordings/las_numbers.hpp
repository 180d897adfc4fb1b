// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "risley/core/gps_time.hpp"

/// The numbers of LAS files, shared by their reader and writer [ASPRS LAS 1.0
/// to 1.4-R15].
namespace risley::recordings::las {

/// Bytes of the public header of LAS 1.`minor`; a file's own may have more.
constexpr std::size_t header_bytes(int minor) {
  if (minor >= 4) return 375;
  return minor == 3 ? 235 : 227;
}

/// Bytes of a point record by point format, without extra bytes.
inline constexpr std::array<std::uint8_t, 11> kRecordBytes{20, 28, 26, 34, 57, 63,
                                                           30, 36, 38, 59, 67};

/// Whether a point format is one of LAS 1.4's own: wider return numbers, a scanner channel.
constexpr bool is_modern(int point_format) { return point_format >= 6; }

/// Byte of a point record with its GPS time; empty for the formats without one.
constexpr std::optional<std::size_t> gps_time_at(int point_format) {
  if (point_format == 0 || point_format == 2) return std::nullopt;
  return is_modern(point_format) ? 22 : 20;
}

/// Byte of the public header that holds the point format.
inline constexpr std::size_t kPointFormatAt = 104;
/// Bit of the point format by which LASzip marks a compressed file.
inline constexpr std::uint8_t kCompressionMark = 0x80;

inline constexpr std::size_t kRecordHeaderBytes = 54;  ///< of a variable length record
/// Bytes of the header of an extended variable length record.
inline constexpr std::size_t kExtendedRecordHeaderBytes = 60;
/// User of the record that describes extra bytes.
inline constexpr const char* kSpecificationUser = "LASF_Spec";
/// Number of the record that describes extra bytes.
inline constexpr std::uint16_t kExtraBytesNumber = 4;
inline constexpr std::size_t kDescriptorBytes = 192;  ///< of one description in it
/// Extra bytes in which clouds store fields that LAS lacks, each a uint8.
inline constexpr const char* kTagField = "Tag";
/// As kTagField, for the emitter that fired.
inline constexpr const char* kBeamField = "Beam";

/// Bit of the global encoding: GPS times are adjusted standard GPS time.
inline constexpr unsigned kAdjustedGpsTime = 1;
/// Intensities that sensors report from 0 to 255 are stored in 16 bits times this, as the
/// specification requires for a range of 256.
inline constexpr unsigned kIntensityFactor = 256;

inline constexpr std::int64_t kSecond = 1'000'000'000;  ///< ns
/// Seconds between 1970-01-01 and the origin of adjusted GPS time, 1e9 s after 1980-01-06.
inline constexpr std::int64_t kGpsOrigin = kGpsEpoch + kGpsAdjustment;

}  // namespace risley::recordings::las
