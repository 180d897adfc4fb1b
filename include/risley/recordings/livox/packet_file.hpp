// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "risley/io/block_file.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings::livox {

/// An LVX 1.1 file that grows while sensors run. What was measured cannot be measured again, so
/// unlike other outputs it is there from the beginning, under the name unfinished_path(), and stays
/// when the program or the machine dies: every frame is written whole, so that the file can be read
/// up to its last one. close() gives it its final name.
class PacketFile {
 public:
  /// @param path     final name, which ends in .lvx; a file of that name is replaced by close()
  /// @param devices  [1 to 255], the sensors whose packets will come
  /// @throws FileError when the file cannot be made, or an unfinished one of that name is there;
  ///         InvalidArgument for another ending, and for devices that LVX cannot hold
  PacketFile(const std::string& path, const std::vector<Device>& devices);
  /// Without close() the unfinished file stays, unless it has no frame.
  ~PacketFile();
  PacketFile(const PacketFile&) = delete;
  PacketFile& operator=(const PacketFile&) = delete;

  /// Puts a packet into the present frame.
  /// @param packet  header and records as PacketDecoder takes them
  void add(std::uint8_t device_index, std::span<const std::uint8_t> packet);
  /// Writes the present frame, if it has packets. @throws FileError when the disk refuses; the file
  /// then ends with the frame before
  void end_frame();
  /// Writes the last frame and gives the file its final name. @throws FileError
  void close();

  const std::string& path() const { return path_; }  ///< final name
  /// Name until close().
  const std::string& unfinished_path() const { return unfinished_path_; }
  std::uint64_t frames() const { return frames_; }  ///< written so far
  std::uint64_t size() const { return size_; }      ///< bytes written so far

 private:
  void write(std::span<const std::uint8_t> bytes);

  std::string path_, unfinished_path_;
  io::FileDescriptor file_;
  std::vector<std::uint8_t> frame_;
  std::uint64_t frames_ = 0, size_ = 0;
  bool closed_ = false;
};

}  // namespace risley::recordings::livox
