// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "recordings/formats/byte_source.hpp"

namespace risley::recordings {

/// A file within a zip file.
struct ZipMember {
  std::string name;
  std::uint16_t method = 0;  ///< 0 stored, 8 deflated
  std::uint32_t crc = 0;
  std::uint64_t packed_bytes = 0, bytes = 0;
  std::uint64_t begin = 0;  ///< of its packed bytes in the file
};

/// Lists the members, also of files beyond 4 GiB.
/// @throws FileError when the directory is damaged, or a member is encrypted, packed by another
/// method, outside of the file, or larger than its packed bytes allow
std::vector<ZipMember> zip_members(const io::InputFile& file);

/// Opens a member at an offset. Its checksum is verified when all of it was read.
std::unique_ptr<ByteSource> open_member(const io::InputFile& file, const ZipMember& member,
                                        std::uint64_t offset = 0);

}  // namespace risley::recordings
