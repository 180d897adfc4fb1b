// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/io/output_file.hpp"

#include "cloud/formats/point_fields.hpp"

namespace risley::cloud {

/// A file written in order; the calls throw FileError with the system's message.
class SequentialFile {
 public:
  explicit SequentialFile(const std::string& path);

  void append(const void* bytes, std::size_t count);
  void append(std::string_view text) { append(text.data(), text.size()); }
  /// Overwrites the beginning of the file; only close() may follow.
  void overwrite_beginning(std::string_view text);
  /// Completes the file and renames it to its final name.
  void close();

 private:
  void check();

  io::OutputFile output_;
  std::ofstream stream_;  // after output_: closed before the temporary is removed
};

/// Packed records behind a text header with their number. The header is rewritten by close(), so
/// its length must not depend on the number of points.
class RecordFile final : public CloudWriter {
 public:
  using HeaderText = std::function<std::string(std::uint64_t points)>;

  RecordFile(const std::string& path, std::vector<PointField> fields, HeaderText header);

  void write(const Points& points) override;
  void close() override;

 private:
  RecordPacker packer_;
  HeaderText header_;
  SequentialFile file_;
  std::uint64_t points_ = 0;
  std::vector<std::uint8_t> records_;
};

/// Padding that keeps a header's length independent of the number of points in it: at least one
/// character.
std::string header_padding(std::uint64_t points, char fill);

/// Contents of a header's comments: the sensor, the frame, the fields with their units and the
/// provenance. Lines without line feeds and short enough for every reader.
std::vector<std::string> header_notes(const CloudHeader& header,
                                      const std::vector<PointField>& fields);

/// All fields under the names and with the types that PCL's own point types have: x, y, z and
/// intensity as float32, time as float64.
std::vector<PointField> pcl_fields(const CloudHeader& header);

}  // namespace risley::cloud
