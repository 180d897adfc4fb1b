// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "io/test_folder.hpp"

namespace risley::fuzz {

/// A file in memory that can be opened by its path. One for SQLite has a name in a folder instead:
/// it follows links to where they lead, and a file in memory leads nowhere.
class MemoryFile {
 public:
  explicit MemoryFile(std::span<const std::uint8_t> bytes) {
    constexpr std::string_view kDatabase = "SQLite";
    if (bytes.size() >= kDatabase.size() &&
        std::equal(kDatabase.begin(), kDatabase.end(), bytes.begin())) {
      static const io::TestFolder folder;
      path_ = folder.file("input");
      descriptor_ = ::open(path_.c_str(), O_CREAT | O_WRONLY | O_TRUNC | O_CLOEXEC, 0600);
    } else {
      descriptor_ = ::memfd_create("risley-fuzz", MFD_CLOEXEC);
      path_ = "/proc/self/fd/" + std::to_string(descriptor_);
    }
    if (descriptor_ < 0) throw std::runtime_error("no file in memory");
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t written = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
      if (written <= 0) throw std::runtime_error("the file in memory cannot be written");
      done += static_cast<std::size_t>(written);
    }
  }
  ~MemoryFile() { ::close(descriptor_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int descriptor_ = -1;
};

}  // namespace risley::fuzz
