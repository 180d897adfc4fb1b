// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"

namespace risley::recordings {

struct Recording;
class SharedInput;

/// Location of a recording: a file, or a folder of ROS 2, by its path, or columns in memory.
///
/// Each reader opens a file anew, unless it is held open for a while: see held_open().
class Source {
 public:
  Source() = default;
  // A path converts to a source.
  Source(std::string path);                   // NOLINT(google-explicit-constructor)
  Source(const char* path);                   // NOLINT(google-explicit-constructor)
  Source(const std::filesystem::path& path);  // NOLINT(google-explicit-constructor)

  /// @param recording  must not change while it is read
  /// @param name       for messages and reports, such as "recording in memory"
  /// @throws InvalidArgument if there is none, it has no device or a row of another one, its
  /// packets, if any, hold more or fewer rows, columns differ in length, or as require_angles()
  Source(std::shared_ptr<const Recording> recording, std::string name);

  /// The path, or the name of columns in memory.
  const std::string& name() const { return name_; }
  /// Neither a path nor columns.
  bool empty() const { return name_.empty() && !recording_; }
  /// Columns in memory; none for a path.
  const std::shared_ptr<const Recording>& recording() const { return recording_; }
  /// Whether two are the same file, folder or columns.
  bool is_same_as(const Source& other) const;
  /// The same source for one job: its copies open the file once, at first, and all read that one,
  /// whatever happens to its path. The rows that they decode first, a second of the fastest sensor,
  /// are kept for the next one of them, until one reads beyond. A Progress given with one of the
  /// copies must outlive all of them.
  Source held_open() const;
  /// Damage that prevents reading a held-open recording to its end, once detected.
  std::optional<FileError> damage() const;
  /// One of its files for reading: the one that is held open, if it is that. @throws FileError
  io::InputFile open_file(const std::string& path) const;

  /// Data shared by copies; for readers only.
  std::shared_ptr<SharedInput> shared() const;

 private:
  std::string name_;
  std::shared_ptr<const Recording> recording_;
  std::shared_ptr<SharedInput> shared_;  ///< where it is held open
};

/// The files of a recording: its own, or metadata.yaml and the bags that it names for a folder of
/// ROS 2, each with SQLite's files beside a database. For a path that is not a recording the path
/// itself, for columns in memory none.
std::vector<std::string> recording_files(const Source& source);

}  // namespace risley::recordings
