// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/output_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <unistd.h>

#include "risley/core/error.hpp"

namespace risley::io {
namespace fs = std::filesystem;

OutputFile::OutputFile(std::string path)
    : path_(std::move(path)), temporary_path_(fmt::format("{}.part-{}", path_, ::getpid())) {
  if (fs::is_directory(path_)) throw FileError(path_, {}, "is a folder, expected a file name");
  // Found out now rather than after an hour of work.
  std::ofstream probe(temporary_path_, std::ios::binary);
  if (!probe)
    throw FileError(path_, {}, fmt::format("cannot be written: {}", std::strerror(errno)));
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : path_(std::move(other.path_)), temporary_path_(std::move(other.temporary_path_)) {
  other.temporary_path_.clear();
}

OutputFile::~OutputFile() {
  if (temporary_path_.empty()) return;
  std::error_code ignored;
  fs::remove(temporary_path_, ignored);
}

void OutputFile::commit() {
  std::error_code code;
  fs::rename(temporary_path_, path_, code);
  if (code) throw FileError(path_, {}, fmt::format("cannot be written: {}", code.message()));
  temporary_path_.clear();
}

}  // namespace risley::io
