// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "fuzz/memory_file.hpp"

#include <cstdlib>
#include <filesystem>

namespace risley::fuzz {

MemoryFolder::MemoryFolder() : path_("/dev/shm/risley-fuzz-XXXXXX") {
  if (::mkdtemp(path_.data()) == nullptr) throw std::runtime_error("no folder in memory");
}

MemoryFolder::~MemoryFolder() {
  std::error_code code;
  std::filesystem::remove_all(path_, code);
}

}  // namespace risley::fuzz
