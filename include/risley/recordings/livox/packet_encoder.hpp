// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "risley/recordings/livox/packet.hpp"
#include "risley/recordings/observations.hpp"

// The inverse of risley/recordings/livox/packet_decoder.hpp.
namespace risley::recordings::livox {

/// @param bytes  [kPacketHeaderBytes]
void encode_packet_header(const Packet& packet, std::uint8_t* bytes);

/// The timestamp type that has this origin of times.
std::uint8_t timestamp_type_of(TimeReference reference);

/// The eight timestamp bytes of a time, ns. GPS times (type 3) are rounded to whole us; PPS times
/// (type 4) keep only the part since the last whole second.
/// @throws InvalidArgument when the time is negative or, for GPS, outside the years 2000-2255
std::array<std::uint8_t, 8> encode_timestamp(std::uint8_t timestamp_type, std::int64_t time_ns);

/// Encodes one record from its layout.returns rows; times are not part of a record.
/// @param row_number  of the first row, for messages
/// @param bytes       [layout.bytes_per_record]
/// @throws InvalidArgument when the record cannot hold a value
void encode_record(const RecordLayout& layout, const Observations& observations,
                   std::size_t first_row, std::uint64_t row_number, std::uint8_t* bytes);

/// @param bytes  [24]
void encode_imu(const ImuSample& sample, std::uint8_t* bytes);

}  // namespace risley::recordings::livox
