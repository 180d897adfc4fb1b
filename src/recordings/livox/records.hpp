// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The records of packets, which both generations of sensors share.
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings::livox {

/// Coordinate format of Cartesian records.
enum class Coordinates : std::uint8_t {
  millimetres,  ///< whole numbers of 32 bits
  metres,       ///< floats, in LVX 1.0
  centimetres,  ///< whole numbers of 16 bits, in data type 2 of the second generation
};

/// Writes the rows of records to columns that already have room for them.
/// @param bytes  [layout.bytes()]
/// @throws BadPacket for a return with angles beyond a turn, and a non-numeric coordinate
void put_records(const RecordLayout& layout, const std::uint8_t* bytes, Coordinates coordinates,
                 std::int64_t time_ns, const ShotGrid& grid, std::uint8_t device,
                 Observations& rows, std::size_t first_row);

}  // namespace risley::recordings::livox
