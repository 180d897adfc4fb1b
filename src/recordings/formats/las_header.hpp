// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/io/block_file.hpp"
#include "risley/recordings/las_numbers.hpp"
#include "risley/recordings/reader.hpp"

/// The beginning of LAS files [ASPRS LAS 1.0 to 1.4-R15].
namespace risley::recordings::las {

/// UTC since 1970, ns, of adjusted standard GPS time, s; empty when it does not fit 64 bits.
std::optional<std::int64_t> utc_of_adjusted_gps(double seconds);

/// Properties stated in a file before its first point.
struct PublicHeader {
  int minor_version = 2;  ///< of LAS 1
  std::uint16_t global_encoding = 0;
  std::string system_identifier, generating_software;
  std::uint64_t points_at = 0;   ///< byte of the first point record
  std::uint64_t points_end = 0;  ///< end of all possible points, at most the file's size
  int point_format = 0;
  bool compressed = false;                     ///< by LASzip; point_format is without its mark
  std::size_t record_bytes = 0;                ///< of a point, uncompressed
  std::uint64_t points = 0;                    ///< as the header counts them
  std::array<double, 3> scale{}, offset{};     ///< m
  std::optional<std::size_t> tag_at, beam_at;  ///< bytes of a point record
};

/// Reads and checks the public header and skips the variable length records. No memory is allocated
/// from sizes in a header.
/// @param warnings  receives anomalies that do not prevent reading the points
/// @throws FileError with the byte of an invalid value
PublicHeader read_header(io::BlockInput& input, std::vector<Warning>& warnings);

}  // namespace risley::recordings::las
