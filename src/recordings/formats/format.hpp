// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "risley/io/block_file.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/recordings/writer.hpp"

namespace risley::recordings {

/// Bytes at the beginning of a file from which its format is recognised.
inline constexpr std::size_t kHeadBytes = 4096;

/// One recording format. Adding a format means one pair of files in this folder that defines one
/// of these, and one line in formats/registry.cpp.
struct Format {
  std::string_view name;         ///< RecordingHeader::format
  std::string_view ending;       ///< file name ending for writing; empty when it is read-only
  std::string_view description;  ///< one line for the help
  /// Whether a file that starts with these bytes (up to kHeadBytes) is of this format.
  bool (*recognises)(std::string_view head);
  /// @param progress  cancels long scans before the first row, and waiting for a library
  std::unique_ptr<Reader> (*open)(const io::InputFile& file, const Progress& progress);
  /// nullptr when the format is read-only.
  std::unique_ptr<Writer> (*create)(const std::string& path, const RecordingHeader& header,
                                    const WriteOptions& options) = nullptr;
  bool holds_shot_numbers = false;  ///< recordings without times can be written, too
};

/// Format::open and Format::create for classes that need only their arguments.
template <class Opened>
std::unique_ptr<Reader> open_with(const io::InputFile& file, const Progress&) {
  return std::make_unique<Opened>(file);
}
template <class Created>
std::unique_ptr<Writer> create_with(const std::string& path, const RecordingHeader& header,
                                    const WriteOptions&) {
  return std::make_unique<Created>(path, header);
}

extern const Format kLvx11Format;            // lvx11.cpp
extern const Format kLvx10Format;            // lvx10.cpp
extern const Format kLvx2Format;             // lvx2.cpp
extern const Format kScanSequenceCsvFormat;  // scan_sequence_csv.cpp
extern const Format kOpenpylivoxCsvFormat;   // openpylivox_csv.cpp
extern const Format kOpenpylivoxBinFormat;   // openpylivox_bin.cpp
extern const Format kViewerCsvFormat;        // viewer_csv.cpp
extern const Format kNetcdfFormat;           // netcdf.cpp
extern const Format kRos1BagFormat;          // bags.cpp
extern const Format kRos2BagFormat;          // bags.cpp
extern const Format kMcapFormat;             // bags.cpp
extern const Format kPcapFormat;             // pcap.cpp
extern const Format kLasFormat;              // las.cpp
extern const Format kLazFormat;              // las.cpp, laz.cpp
extern const Format kPcdFormat;              // pcd.cpp
extern const Format kPlyFormat;              // ply.cpp
extern const Format kNpyFormat;              // numpy.cpp
extern const Format kNpzFormat;              // numpy.cpp
extern const Format kNamedCsvFormat;         // named_csv.cpp

/// Mean number of shots that share a time if it is that of their packet or frame: packets hold 96
/// points and more.
inline constexpr std::size_t kShotsOfOneTime = 32;

/// Detail in which a NetCDF file stores the format from which its rows originally came.
inline constexpr const char* kSourceFormat = "source_format";

/// The format whose details the header has: its own, or the one it had before NetCDF.
inline std::string source_format(const RecordingHeader& header) {
  return header.detail(kSourceFormat, header.format);
}

/// All formats, in the order in which they are tried.
const std::vector<const Format*>& all_formats();

}  // namespace risley::recordings
