// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "risley/recordings/observations.hpp"

namespace risley::recordings {

/// Writes one recording in pieces. The file appears under its name only at close(); a writer
/// destroyed before leaves nothing.
class Writer {
 public:
  virtual ~Writer() = default;

  /// Appends rows. @throws FileError when the disk refuses, InvalidArgument for columns of
  /// different lengths and when the format cannot hold a value (the message names the column, the
  /// row and the allowed range)
  void write(const Chunk& chunk) {
    require_columns(chunk.observations);
    append(chunk);
  }

  /// Completes the file and gives it its name. @throws FileError
  virtual void close() = 0;

  /// Rows given so far that the format has no place for and that were left out: those without a
  /// return in formats that only list points, further returns in a scan sequence.
  std::uint64_t left_out() const { return left_out_; }

 protected:
  /// Appends rows whose columns have one length.
  virtual void append(const Chunk& chunk) = 0;

  std::uint64_t left_out_ = 0;
};

/// A format that can be written, and how it is chosen by the end of a file name.
struct WritableFormat {
  std::string name;    ///< as RecordingHeader::format
  std::string ending;  ///< ".lvx"; the longest ending that fits wins
  std::string description;
};

/// All formats that can be written.
const std::vector<WritableFormat>& writable_formats();

/// Creates a recording in the format that the file name's ending asks for.
/// @param header  of the recording the rows come from; what the format cannot hold is dropped
/// @param format  name of a writable format that is to be written whatever the ending; empty asks
///                the ending
/// @throws InvalidArgument for an unknown ending or format (the message lists the known ones),
///         MissingTimes for a recording without times and a format that holds nothing else,
///         FileError
std::unique_ptr<Writer> create_recording(const std::string& path, const RecordingHeader& header,
                                         const std::string& format = {});

}  // namespace risley::recordings
