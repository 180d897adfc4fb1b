// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/recordings/reader.hpp"

#include "recordings/formats/las_header.hpp"

namespace risley::recordings::las {

/// Fields of a point record used by recordings, as stored.
struct Point {
  std::array<std::int32_t, 3> steps{};  ///< of the scale
  std::uint16_t intensity = 0;
  std::uint8_t return_number = 0, number_of_returns = 0;
  std::uint8_t tag = 0, beam = 0;
  double gps_time = 0;  ///< 0 in formats without one
};

/// The points of one file in order.
class PointSource {
 public:
  virtual ~PointSource() = default;

  /// Fills in the next points, as many as are valid.
  /// @return their number, 0 at the end
  /// @throws FileError at damage, after all points before it were returned
  virtual std::size_t read(std::span<Point> points) = 0;

  /// Position of the GPS time of a point, counted from 0.
  virtual FilePlace gps_time_place(std::uint64_t point) const = 0;

  virtual double fraction_read() const = 0;
};

/// Points stored one after another. @param warnings  receives points not counted in the header
std::unique_ptr<PointSource> open_points(io::BlockInput input, const PublicHeader& header,
                                         std::vector<Warning>& warnings);

/// Points that LASzip compressed.
/// @throws FileError also when this build has no LASzip, with the remedy
std::unique_ptr<PointSource> open_compressed_points(io::BlockInput input,
                                                    const PublicHeader& header,
                                                    std::vector<Warning>& warnings);

}  // namespace risley::recordings::las
