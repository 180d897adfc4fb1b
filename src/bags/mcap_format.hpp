// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What readers and writers of MCAP share, see https://mcap.dev/spec.
#pragma once

#include <cstdint>
#include <string_view>

namespace risley::bags {

/// At the beginning and at the end of a file.
inline constexpr std::string_view kMcapMagic{"\x89MCAP0\r\n", 8};
inline constexpr std::uint64_t kMcapRecordHead = 9;    ///< bytes: type and length
inline constexpr std::uint64_t kMcapMessageHead = 22;  ///< bytes in front of a message's own

/// Types of records.
enum McapOp : std::uint8_t {
  kHeaderOp = 1,
  kFooterOp = 2,
  kSchemaOp = 3,
  kChannelOp = 4,
  kMessageOp = 5,
  kChunkOp = 6,
  kMessageIndexOp = 7,
  kChunkIndexOp = 8,
  kAttachmentOp = 9,
  kStatisticsOp = 11,
  kMetadataOp = 12,
  kSummaryOffsetOp = 14,
  kDataEndOp = 15,
  kLastKnownOp = 15,
};

}  // namespace risley::bags
