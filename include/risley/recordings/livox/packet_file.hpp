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

/// An LVX 1.1 or LVX 2 file that grows while sensors run. What was measured cannot be measured
/// again, so unlike other outputs it is there from the beginning, under the name unfinished_path(),
/// and stays when the program or the machine dies: every frame is written whole, so that the file
/// can be read up to its last one. close() gives it its final name. Where the output is to be of
/// another format, it is made of this file afterwards, and discard() removes it.
class PacketFile {
 public:
  /// @param path     final name; a file of that name is replaced by close()
  /// @param devices   [1 to 255], the sensors whose packets will come
  /// @param numbered  they are of the second generation, and the file is LVX 2
  /// @throws FileError when the file cannot be made, or an unfinished one of that name is there;
  ///         InvalidArgument for devices that LVX cannot hold
  PacketFile(const std::string& path, const std::vector<Device>& devices, bool numbered = false);
  /// Without close() the unfinished file stays, unless it has no frame.
  ~PacketFile();
  PacketFile(const PacketFile&) = delete;
  PacketFile& operator=(const PacketFile&) = delete;

  /// Puts a packet into the present frame. Frames of LVX 2 begin by the times of packets.
  /// @param packet  header and records as PacketDecoder or decode_numbered_packet() takes them
  /// @throws FileError as end_frame()
  void add(std::uint8_t device_index, std::span<const std::uint8_t> packet);
  /// Ends the present frame of LVX 1.1, if it has packets, which then is written. @throws FileError
  /// when the disk refused a frame before; the file ends before that one
  void end_frame();
  /// Ends the present frame and waits until all are written. @throws FileError as end_frame()
  void settle();
  /// Writes the last frame and gives the file its final name. @throws FileError
  void close();
  /// Removes the file, whose packets stand elsewhere now.
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
