// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace risley::recordings {

struct Recording;

/// Where a recording is: a file, or a folder of ROS 2, by its path, or columns in memory.
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

 private:
  std::string name_;
  std::shared_ptr<const Recording> recording_;
};

/// The files of which a recording consists: its own, or metadata.yaml and the bags that it names
/// where it is a folder of ROS 2, each with what SQLite keeps beside a database. Of what is no
/// recording the path itself, of columns in memory none.
std::vector<std::string> recording_files(const Source& source);

}  // namespace risley::recordings
