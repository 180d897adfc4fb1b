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

/// An output that grows for a long time and cannot be recreated. Like OutputFile it gets its name,
/// and replaces a file of that name and keeps its mode, when it is complete; but until then it has
/// a predictable name, and it is never removed. A separate thread writes, so that a slow disk does
/// not block the caller.
class GrowingFile {
 public:
  /// Suffix of its name until commit().
  static constexpr const char* kUnfinished = ".unfinished";
  /// Bytes that may wait for the disk: half a second of three sensors at ten times their speed.
  static constexpr std::size_t kMostWaiting = std::size_t{32} << 20U;

  /// @throws FileError as OutputFile; for a file that is not regular; if there is an unfinished
  /// file of that name, which is never overwritten
  explicit GrowingFile(const std::string& path);
  /// Writes what waits.
  ~GrowingFile();
  GrowingFile(const GrowingFile&) = delete;
  GrowingFile& operator=(const GrowingFile&) = delete;

  const std::string& path() const { return path_; }  ///< that commit() gives the file
  /// Its name until commit(): path(), or the target of a symbolic link of that name, followed by
  /// kUnfinished. Empty afterwards.
  const std::string& unfinished_path() const { return unfinished_path_; }
  std::uint64_t size() const { return size_; }  ///< bytes appended so far

  /// Appends bytes, all or none, soon; waits while more than kMostWaiting are pending.
  /// @return a vector with capacity from earlier writes, if there is one: appending again needs no
  /// new memory
  /// @throws FileError when an earlier write failed: the file ends there
  std::vector<std::uint8_t> append(std::vector<std::uint8_t> bytes);
  /// Waits until the file has all bytes. @throws FileError as append()
  void settle();
  /// Syncs the bytes to disk and renames the file. @throws FileError
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
  /// Of the thread: bytes in the file, those being synced, and those on disk.
  std::uint64_t written_ = 0, begun_ = 0, on_disk_ = 0;
  std::thread thread_;
};

}  // namespace risley::io
