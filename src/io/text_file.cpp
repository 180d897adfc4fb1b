// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/text_file.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/output_file.hpp"
#include "risley/io/read_bytes.hpp"

namespace risley::io {

std::string read_text_file(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 28;  // devices never end
  std::string text;
  read_bytes(path, [&](std::span<const char> bytes) {
    text.append(bytes.data(), bytes.size());
    if (text.size() <= kMostBytes) return;
    throw FileError(path, {kMostBytes, {}},
                    fmt::format("expected a text of at most {} bytes", kMostBytes));
  });
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
