// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// An output that appears under its final name only when it is whole: it is written under a
/// temporary name in the same folder and renamed by commit(). Without commit() the destructor
/// removes the temporary, so an interrupted run leaves no half file.
class OutputFile {
 public:
  /// @throws FileError when the folder does not exist or cannot be written
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  const std::string& path() const { return path_; }
  const std::string& temporary_path() const { return temporary_path_; }

  /// Gives the file its final name. @throws FileError
  void commit();

 private:
  std::string path_;
  std::string temporary_path_;
};

}  // namespace risley::io
