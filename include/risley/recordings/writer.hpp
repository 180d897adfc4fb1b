// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "risley/bags/lidar_topic.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings {

/// What formats leave to choose.
struct WriteOptions {
  bags::LidarTopicOptions messages;  ///< of bags
};

/// Writes one recording in pieces. The file appears under its name only at close(); a writer
/// destroyed before leaves nothing.
class Writer {
 public:
  virtual ~Writer() = default;

  /// Appends rows. @throws FileError when writing fails, InvalidArgument for columns of different
  /// lengths and when the format cannot hold a value (the message names the column, the row and the
  /// allowed range)
  void write(const Chunk& chunk) {
    require_columns(chunk.observations);
    append(chunk);
  }

  /// Completes the file and renames it to its final name. @throws FileError
  virtual void close() = 0;

  /// Rows so far that the format cannot hold and that were dropped: those without a return in
  /// formats that only list points, further returns in a scan sequence.
  std::uint64_t left_out() const { return left_out_; }

 protected:
  /// Appends rows whose columns have one length.
  virtual void append(const Chunk& chunk) = 0;

  std::uint64_t left_out_ = 0;
};

/// An output format, and the file name ending that selects it.
struct WritableFormat {
  std::string name;    ///< as RecordingHeader::format
  std::string ending;  ///< ".lvx"; the longest ending that fits wins
  std::string description;
};

/// All formats that can be written.
const std::vector<WritableFormat>& writable_formats();

/// Creates a recording in the format given by the file name's ending.
/// @param header of the recording the rows come from; parts that the format cannot hold are dropped
/// @param format  name of an output format, regardless of the ending; empty uses the ending
/// @param options  of the format
/// @throws InvalidArgument for an unknown ending or format (the message lists the known ones),
/// MissingTimes for a recording without times and a format that needs them, FileError
std::unique_ptr<Writer> create_recording(const std::string& path, const RecordingHeader& header,
                                         const std::string& format = {},
                                         const WriteOptions& options = {});

}  // namespace risley::recordings
