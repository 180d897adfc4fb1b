// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What outputs that are made in one go and outputs that grow share: which file they replace, and
// how.
#pragma once

#include <cerrno>
#include <string>

#include <sys/types.h>

namespace risley::io {

/// What an output replaces.
struct FileTarget {
  std::string path;     ///< behind symbolic links
  bool copied = false;  ///< no regular file, or the name of an open one: bytes are copied into it
  mode_t mode = 0666;   ///< of the temporary, which only this process reads
};

/// @throws FileError that names a path and a system's error
[[noreturn]] void refuse(const std::string& path, int error);

/// Calls again what a signal interrupted.
template <class Call>
auto whole(const Call& call) {
  auto result = call();
  while (result < 0 && errno == EINTR) result = call();
  return result;
}

/// Follows links to what is replaced. @throws FileError; std::system_error
FileTarget find_target(const std::string& path);

/// Whether a name is that of an open file.
bool is_named(int file, const std::string& path);

/// Puts the bytes of a temporary on the disk and gives it the mode of what it replaces.
/// @param path  as messages call the output  @throws FileError
void sync_output(const FileTarget& target, const std::string& path, int temporary,
                 const std::string& temporary_path);

/// Gives a temporary its final name, for good. The name is cleared once it is gone.
/// @throws FileError
void replace_target(const FileTarget& target, const std::string& path, std::string& temporary_path);

}  // namespace risley::io
