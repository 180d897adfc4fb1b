// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/text_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"

#include "io/read_bytes.hpp"

namespace risley::io {

std::string read_text_file(const std::string& path) {
  std::string text;
  read_bytes(path,
             [&text](std::span<const char> bytes) { text.append(bytes.data(), bytes.size()); });
  return text;
}

void write_text(const OutputFile& output, const std::string& text) {
  std::ofstream stream(output.temporary_path(), std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream) {
    throw FileError(output.path(), {}, fmt::format("cannot be written: {}", std::strerror(errno)));
  }
}

void write_text_file(const std::string& path, const std::string& text) {
  OutputFile output(path);
  write_text(output, text);
  output.commit();
}

}  // namespace risley::io
