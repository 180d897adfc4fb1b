// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "risley/io/block_file.hpp"

namespace risley::io {

struct FileTarget;

/// An output that grows for long and cannot be made again. As OutputFile it gets its name, and
/// replaces a file of that name and keeps its mode, when it is whole; but until then it has a name
/// that everybody can find, and stays whatever happens. A thread of its own writes, so that a disk
/// that pauses does not hold up the caller.
class GrowingFile {
 public:
  /// What its name ends with until commit().
  static constexpr const char* kUnfinished = ".unfinished";
  /// Bytes that may wait for the disk: half a second of three sensors at ten times their speed.
  static constexpr std::size_t kMostWaiting = std::size_t{32} << 20U;

  /// @throws FileError as OutputFile; for what is no regular file; where there is an unfinished
  ///         file of that name, which is never written over
  explicit GrowingFile(const std::string& path);
  /// Writes what waits.
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  const std::string& path() const { return path_; }  ///< that commit() gives the file
  /// Its name until commit(): path(), or what a symbolic link of that name leads to, with
  /// kUnfinished behind. Empty afterwards.
  const std::string& unfinished_path() const { return unfinished_path_; }
  std::uint64_t size() const { return size_; }  ///< bytes appended so far

  /// Appends bytes, all or none, soon; waits while more than kMostWaiting wait already.
  /// @return an empty vector that has room, as soon as others were written: appending again need
  ///         not ask the system for memory
  /// @throws FileError when the disk refused something that was appended before: the file ends
  ///         there
  std::vector<std::uint8_t> append(std::vector<std::uint8_t> bytes);
  /// Waits until the file has all bytes. @throws FileError as append()
  void settle();
  /// Puts the bytes on the disk and gives the file its name. @throws FileError
  void commit();
  /// Removes the file. @throws nothing
  void discard();

 private:
  GrowingFile(const std::string& path, const FileTarget& target);
  void write_what_comes();
  void write(const std::vector<std::uint8_t>& bytes);
  void hand_to_disk();
  void end_thread();

  std::string path_, target_, unfinished_path_;
  FileDescriptor file_;
  std::uint64_t size_ = 0;

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::vector<std::uint8_t>> waiting_;  ///< the first one is being written
  std::size_t waiting_bytes_ = 0;
  std::vector<std::uint8_t> spare_;
  std::exception_ptr failure_;
  bool ending_ = false;
  /// Of the thread: bytes in the file, of which so many went toward the disk and are there.
  std::uint64_t written_ = 0, begun_ = 0, on_disk_ = 0;
  std::thread thread_;
};

}  // namespace risley::io
