// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the examples have in common: the command line, NAME [VALUE] [--folder FOLDER].
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include <risley/core/error.hpp>

struct Arguments {
  std::string value;             ///< empty where none was given
  std::filesystem::path folder;  ///< for the results, a new temporary one where none was given
};

inline Arguments read_arguments(int argc, char** argv) {
  Arguments found;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--folder" && i + 1 < argc) {
      found.folder = argv[++i];
    } else if (word.starts_with("--") || !found.value.empty()) {
      throw risley::InvalidArgument(
          fmt::format("what is \"{}\"? usage: {} [VALUE] [--folder FOLDER]", word, argv[0]));
    } else {
      found.value = word;
    }
  }
  if (found.folder.empty()) {
    std::string name = (std::filesystem::temp_directory_path() / "risley-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
      throw risley::FileError(name, {}, "cannot make a temporary folder");
    }
    found.folder = name;
  }
  std::filesystem::create_directories(found.folder);
  return found;
}

/// Runs an example and prints what went wrong. @return exit status
inline int run_example(int argc, char** argv, int (*example)(const Arguments&)) {
  try {
    return example(read_arguments(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "error: {}\n", error.what());
    return 1;
  }
}
