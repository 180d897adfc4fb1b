// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/bags/lidar_topic.hpp"
#include "risley/cloud/points.hpp"

namespace risley::cloud {

/// Writes one cloud in pieces, so that memory does not grow with its size. The file appears under
/// its name only at close(); a writer destroyed before leaves nothing.
class CloudWriter {
 public:
  virtual ~CloudWriter() = default;

  /// Appends points. @throws FileError when writing fails, InvalidArgument for columns that differ
  /// from the cloud's header, and when the format cannot hold a value (the message names the field,
  /// the point and the allowed range)
  virtual void write(const Points& points) = 0;

  /// Ends the current message, if a cloud is written in messages.
  /// @throws as write()
  virtual void end_message() {}

  /// Completes the file and renames it to its final name. @throws FileError
  virtual void close() = 0;
};

/// What a format leaves to choose.
struct CloudWriterOptions {
  std::string format;       ///< name of a CloudFormat; empty: by the file name's ending
  double las_scale = 1e-4;  ///< LAS stores coordinates as 32-bit multiples of this, m
  /// LAS stores GPS time if the recording's clock is UTC; otherwise, or when this is false, the
  /// recording's own seconds.
  bool gps_time = true;
  bags::LidarTopicOptions messages = {};  ///< of bags
  /// Creation date of LAS if the recording's clock does not give one.
  std::optional<std::chrono::sys_days> date = {};
};

/// Writes a cloud as messages into a bag, which the caller completes.
/// @param bag  must outlive the writer; an existing topic is continued
/// @param kind  of the bag, which determines the serialisation
/// @param options  of the messages; empty ones have their defaults
/// @throws InvalidArgument for a map, and as LidarTopic; FileError
std::unique_ptr<CloudWriter> write_cloud_into(bags::BagWriter& bag, bags::BagKind kind,
                                              const CloudHeader& header,
                                              const bags::LidarTopicOptions& options);

/// An output format of clouds.
struct CloudFormat {
  std::string name;    ///< "las-1.4"
  std::string ending;  ///< ".las"; the first format with an ending is its default
  std::string description;
};

/// All formats that this build can write.
const std::vector<CloudFormat>& cloud_formats();

/// The format of a file name. @param format  as CloudWriterOptions::format
/// @throws InvalidArgument for an unknown ending or format (the message lists the known ones)
const CloudFormat& find_cloud_format(const std::string& path, const std::string& format);

/// Creates a cloud file. @throws InvalidArgument as find_cloud_format, and for a number of prisms
/// or an invalid option; FileError
std::unique_ptr<CloudWriter> create_cloud(const std::string& path, const CloudHeader& header,
                                          const CloudWriterOptions& options = {});

}  // namespace risley::cloud
