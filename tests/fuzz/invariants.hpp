// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "risley/recordings/reader.hpp"

// What must hold of everything that is read, whatever the bytes were.
namespace risley::fuzz {

/// Ends the program where an invariant does not hold, as the fuzzer and the replay expect it.
inline void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "INVARIANT BROKEN: %s\n", what);
  std::abort();
}

/// Rows that a file of one byte may have: one in plain formats, more where repetition is packed.
inline constexpr std::uint64_t kPlainRows = 1, kPackedRows = 1100, kZstdRows = 32'768;

inline void require_sound(const recordings::RecordingHeader& header) {
  require(!header.devices.empty() && header.devices.size() <= 256, "1 to 256 devices");
  require(std::isfinite(header.counted_rate) && header.counted_rate >= 0, "a finite shot rate");
  require(header.returns_per_shot >= 1, "at least one return per shot");
}

inline void require_sound(const recordings::Observations& rows,
                          const recordings::RecordingHeader& header) {
  recordings::require_columns(rows);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    require(rows.device[i] < header.devices.size(), "devices of rows stand in the table");
    require(rows.return_number[i] >= 1, "returns count from 1");
    require(rows.valid[i] <= 1, "valid is 0 or 1");
    if (header.has_range) {
      require(std::isfinite(rows.range[i]) && rows.range[i] >= 0,
              "ranges are finite and not negative");
    }
    require(rows.azimuth_resolution[i] >= 0 && rows.zenith_resolution[i] >= 0 &&
                rows.range_resolution[i] >= 0,
            "rounding steps are not negative");
    if (rows.valid[i] == 0) continue;
    require(std::abs(rows.azimuth[i]) <= std::numbers::pi + 1e-9, "azimuths within a turn");
    require(rows.zenith[i] >= 0 && rows.zenith[i] <= std::numbers::pi + 1e-9,
            "zenith angles of half a turn");
  }
}

inline void require_sound(const recordings::Chunk& chunk,
                          const recordings::RecordingHeader& header) {
  require_sound(chunk.observations, header);
  std::uint64_t rows = 0;
  for (const recordings::Packet& packet : chunk.packets) rows += packet.rows;
  require(rows <= chunk.observations.size(), "packets have no more rows than the chunk");
  for (const recordings::ImuSample& sample : chunk.imu) {
    require(sample.device < header.devices.size(), "devices of samples stand in the table");
    for (const float value : sample.angular_velocity) require(std::isfinite(value), "finite rates");
    for (const float value : sample.acceleration_g) {
      require(std::isfinite(value), "finite accelerations");
    }
  }
  for (const std::size_t begin : chunk.packet_begins) {
    require(begin < chunk.observations.size(), "packets begin at rows");
  }
}

}  // namespace risley::fuzz
