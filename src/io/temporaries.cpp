// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/temporaries.hpp"

#include <filesystem>
#include <mutex>
#include <set>
#include <system_error>

namespace risley::io {
namespace {

struct Temporaries {
  std::mutex mutex;
  std::multiset<std::string> paths;
};

/// Never destroyed: threads may still write while the process ends.
Temporaries& temporaries() {
  static auto& all = *new Temporaries;
  return all;
}

}  // namespace

void note_temporary(const std::string& path) {
  Temporaries& all = temporaries();
  const std::scoped_lock lock(all.mutex);
  all.paths.insert(std::filesystem::absolute(path).string());
}

void forget_temporary(const std::string& path) {
  Temporaries& all = temporaries();
  const std::scoped_lock lock(all.mutex);
  const auto found = all.paths.find(std::filesystem::absolute(path).string());
  if (found != all.paths.end()) all.paths.erase(found);
}

void remove_temporaries() {
  Temporaries& all = temporaries();
  all.mutex.lock();  // for good
  for (const std::string& path : all.paths) {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
}

}  // namespace risley::io
