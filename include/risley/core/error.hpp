// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

namespace risley {

/// Base of everything the libraries throw. Libraries never print and never exit.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller passed a value that makes no sense; the message names field, value, unit and range.
class InvalidArgument : public Error {
 public:
  using Error::Error;
};

/// Where in a file something stands: a byte offset in binary files, a line (from 1) in text.
struct FilePlace {
  std::optional<std::uint64_t> byte_offset;
  std::optional<std::uint64_t> line;
};

/// A file is missing, damaged, of no known kind or cannot be written.
class FileError : public Error {
 public:
  /// @param problem  what was expected and what was found
  FileError(std::string path, FilePlace place, std::string problem);

  const std::string& path() const { return path_; }  ///< of the file, as the caller gave it
  const FilePlace& place() const { return place_; }  ///< of what is wrong, if known
  /// What was expected and what was found.
  const std::string& problem() const { return problem_; }

 private:
  std::string path_;
  FilePlace place_;
  std::string problem_;
};

/// The numbers cannot answer: too few data, no convergence, no valid shot. Exit status 1.
class EstimationError : public Error {
 public:
  using Error::Error;
};

}  // namespace risley
