// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Runs every target over its inputs in a corpus, as the fuzzers left it.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "fuzz/targets.hpp"

namespace fs = std::filesystem;

int main(int count, char** arguments) {
  if (count < 2) {
    std::fprintf(stderr, "usage: risley_fuzz_replay CORPUS [TARGET]\n");
    return 2;
  }
  int failures = 0;
  for (const risley::fuzz::Target& target : risley::fuzz::all_targets()) {
    if (count > 2 && target.name != arguments[2]) continue;
    const fs::path folder = fs::path(arguments[1]) / target.name;
    std::vector<fs::path> files;
    std::error_code code;
    for (const auto& entry : fs::directory_iterator(folder, code)) files.push_back(entry.path());
    if (files.empty()) {
      std::printf("%s: no inputs in %s\n", std::string(target.name).c_str(), folder.c_str());
      ++failures;
      continue;
    }
    std::sort(files.begin(), files.end());
    const auto begin = std::chrono::steady_clock::now();
    for (const fs::path& file : files) {
      std::ifstream stream(file, std::ios::binary);
      const std::vector<char> bytes(std::istreambuf_iterator<char>(stream), {});
      // A broken invariant ends the program: the last name printed is that of its input.
      std::printf("%s\n", file.c_str());
      std::fflush(stdout);
      try {
        target.run({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
      } catch (const std::exception& error) {
        std::printf("%s: %s\n", file.c_str(), error.what());
        ++failures;
      }
    }
    const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
    std::printf("%s: %zu inputs, %.2f s\n", std::string(target.name).c_str(), files.size(),
                time.count());
  }
  return failures == 0 ? 0 : 1;
}
