// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Common to outputs that are written in one go and outputs that grow: the file to replace, and how.
#pragma once

#include <cerrno>
#include <string>

#include <sys/types.h>

namespace risley::io {

/// What an output replaces.
struct FileTarget {
  std::string path;     ///< behind symbolic links
  bool copied = false;  ///< not a regular file, or the name of an open one: bytes are copied into
                        ///< it
  mode_t mode = 0666;   ///< of the temporary, which only this process reads
};

/// @throws FileError with a path and a system error
[[noreturn]] void refuse(const std::string& path, int error);

/// Calls again what a signal interrupted.
template <class Call>
auto whole(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

/// Follows links to the file to replace. @throws FileError; std::system_error
FileTarget find_target(const std::string& path);

/// Whether a name is that of an open file.
bool is_named(int file, const std::string& path);

/// Syncs the bytes of a temporary to disk and gives it the mode of the replaced file.
/// @param path  name of the output in messages @throws FileError
void sync_output(const FileTarget& target, const std::string& path, int temporary,
                 const std::string& temporary_path);

/// Renames a temporary to its final name. The name is cleared once it is gone.
/// @throws FileError
void replace_target(const FileTarget& target, const std::string& path, std::string& temporary_path);

}  // namespace risley::io
