// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

namespace risley {

/// Base of all exceptions of the libraries. Libraries never print and never exit.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The caller passed an invalid value; the message names field, value, unit and range.
class InvalidArgument : public Error {
 public:
  using Error::Error;
};

/// A place in a file: a byte offset in binary files, a line (from 1) in text.
struct FilePlace {
  std::optional<std::uint64_t> byte_offset;
  std::optional<std::uint64_t> line;
};

/// A file is missing, damaged, of an unknown kind or cannot be written.
class FileError : public Error {
 public:
  /// @param problem  what was expected and what was found
  FileError(std::string path, FilePlace place, std::string problem);

  const std::string& path() const { return path_; }  ///< of the file, as given by the caller
  const FilePlace& place() const { return place_; }  ///< of the error, if known
  /// What was expected and what was found.
  const std::string& problem() const { return problem_; }

 private:
  std::string path_;
  FilePlace place_;
  std::string problem_;
};

/// The data give no result: too few data, no convergence, no valid shot. Exit status 1.
class EstimationError : public Error {
 public:
  using Error::Error;
};

}  // namespace risley
