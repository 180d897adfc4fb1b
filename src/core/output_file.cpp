// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/output_file.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include "risley/core/error.hpp"

namespace risley {
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

void write_text_file(const std::string& path, const std::string& text) {
  OutputFile output(path);
  std::ofstream stream(output.temporary_path(), std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream)
    throw FileError(path, {}, fmt::format("cannot be written: {}", std::strerror(errno)));
  output.commit();
}

std::string read_text_file(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || fs::is_directory(path)) {
    throw FileError(path, {}, fs::exists(path) ? "cannot be read" : "no such file");
  }
  std::ostringstream text;
  text << stream.rdbuf();
  return std::move(text).str();
}

std::string sha256_of_file(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw FileError(path, {}, "cannot be read");
  const std::unique_ptr<EVP_MD_CTX, void (*)(EVP_MD_CTX*)> context(EVP_MD_CTX_new(),
                                                                   EVP_MD_CTX_free);
  EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr);
  std::vector<char> buffer(1 << 20);
  while (stream.read(buffer.data(), static_cast<std::streamsize>(buffer.size())) ||
         stream.gcount() > 0) {
    EVP_DigestUpdate(context.get(), buffer.data(), static_cast<std::size_t>(stream.gcount()));
  }
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int length = 0;
  EVP_DigestFinal_ex(context.get(), digest, &length);
  std::string text;
  for (unsigned int i = 0; i < length; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

}  // namespace risley
