// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "risley/io/growing_file.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings::livox {

/// An LVX 1.1 or LVX 2 file that grows while sensors run. A measurement cannot be repeated, so
/// unlike other outputs the file exists from the beginning, under the name unfinished_path(), and
/// stays when the program or the machine dies: every frame is written completely, so that the file
/// can be read up to its last one. close() gives it its final name. If the output has another
/// format, it is made from this file afterwards, and discard() removes it.
class PacketFile {
 public:
  /// @param path     final name; a file of that name is replaced by close()
  /// @param devices  [1 to 255], the sensors whose packets will come
  /// @param numbered  they are of the second generation, and the file is LVX 2
  /// @throws FileError when the file cannot be created, or an unfinished one of that name exists;
  /// InvalidArgument for devices that LVX cannot hold
  PacketFile(const std::string& path, const std::vector<Device>& devices, bool numbered = false);
  /// Without close() the unfinished file stays, unless it has no frame.
  ~PacketFile();
  PacketFile(const PacketFile&) = delete;
  PacketFile& operator=(const PacketFile&) = delete;

  /// Puts a packet into the current frame. Frames of LVX 2 begin by the times of packets.
  /// @param packet  header and records as for PacketDecoder or decode_numbered_packet()
  /// @throws FileError as end_frame()
  void add(std::uint8_t device_index, std::span<const std::uint8_t> packet);
  /// Ends the current frame of LVX 1.1, if it has packets, and writes it. @throws FileError when an
  /// earlier frame could not be written; the file ends before that one
  void end_frame();
  /// Ends the current frame and waits until all are written. @throws FileError as end_frame()
  void settle();
  /// Writes the last frame and renames the file to its final name. @throws FileError
  void close();
  /// Removes the file; its packets are now stored elsewhere.
  void discard();

  const std::string& path() const { return file_.path(); }  ///< final name
  /// Name until close().
  const std::string& unfinished_path() const { return file_.unfinished_path(); }
  std::uint64_t frames() const { return frames_; }     ///< that are written
  std::uint64_t size() const { return file_.size(); }  ///< bytes of these and of the head

 private:
  struct Numbered;
  void write_frame();

  io::GrowingFile file_;
  std::unique_ptr<Numbered> numbered_;  // of LVX 2
  std::vector<std::uint8_t> frame_;
  std::uint64_t frames_ = 0;
  bool closed_ = false;
};

}  // namespace risley::recordings::livox
