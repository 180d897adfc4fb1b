// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/text_file.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"

namespace risley::io {
namespace fs = std::filesystem;

std::string read_text_file(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || fs::is_directory(path)) {
    throw FileError(path, {}, fs::exists(path) ? "cannot be read" : "no such file");
  }
  std::ostringstream text;
  text << stream.rdbuf();
  return std::move(text).str();
}

void write_text_file(const std::string& path, const std::string& text) {
  OutputFile output(path);
  std::ofstream stream(output.temporary_path(), std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream)
    throw FileError(path, {}, fmt::format("cannot be written: {}", std::strerror(errno)));
  output.commit();
}

}  // namespace risley::io
