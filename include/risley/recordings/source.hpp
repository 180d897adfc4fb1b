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

/// Where a recording is: a file, or a folder of ROS 2, by its path, or columns in memory.
///
/// A file is opened anew by each that reads it, unless somebody holds it open for a while: see
/// held_open().
class Source {
 public:
  Source() = default;
  // A path is a source wherever one is expected.
  Source(std::string path);                   // NOLINT(google-explicit-constructor)
  Source(const char* path);                   // NOLINT(google-explicit-constructor)
  Source(const std::filesystem::path& path);  // NOLINT(google-explicit-constructor)

  /// @param recording  must not change while it is read
  /// @param name       for messages and reports, such as "recording in memory"
  /// @throws InvalidArgument when there is none, it has no device or a row of another one, its
  ///         packets, if any, own more or fewer rows, columns differ in length, or as
  ///         require_angles()
  Source(std::shared_ptr<const Recording> recording, std::string name);

  /// The path, or the name of columns in memory.
  const std::string& name() const { return name_; }
  /// Neither a path nor columns.
  bool empty() const { return name_.empty() && !recording_; }
  /// Columns in memory; none where it is a path.
  const std::shared_ptr<const Recording>& recording() const { return recording_; }
  /// Whether two are the same file, folder or columns.
  bool is_same_as(const Source& other) const;
  /// The same source for one job: its copies open the file once, at first, and all read that,
  /// whatever has its path by then. What they decode first, a second of the fastest sensor, is
  /// kept for the next one of them, until one reads on behind it. A Progress given with one of the
  /// copies must outlive all of them.
  Source held_open() const;
  /// What keeps a recording that is held open from being read to its end, once somebody met it.
  std::optional<FileError> damage() const;
  /// One of its files to be read: the one that is held open, where it is that. @throws FileError
  io::InputFile open_file(const std::string& path) const;

  /// What copies share; for readers alone.
  std::shared_ptr<SharedInput> shared() const;

 private:
  std::string name_;
  std::shared_ptr<const Recording> recording_;
  std::shared_ptr<SharedInput> shared_;  ///< where it is held open
};

/// The files of which a recording consists: its own, or metadata.yaml and the bags that it names
/// where it is a folder of ROS 2, each with what SQLite keeps beside a database. Of what is no
/// recording the path itself, of columns in memory none.
std::vector<std::string> recording_files(const Source& source);

}  // namespace risley::recordings
