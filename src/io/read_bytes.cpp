// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/read_bytes.hpp"

#include <cerrno>
#include <cstring>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "risley/core/error.hpp"

namespace risley::io {
namespace {

constexpr std::size_t kBytesAtOnce = std::size_t{1} << 18;

}  // namespace

void read_bytes(const InputFile& file, const std::function<void(std::span<const char>)>& take) {
  std::vector<char> buffer(kBytesAtOnce);
  std::uint64_t offset = 0;
  while (const std::size_t count = file.read(offset, buffer.data(), buffer.size())) {
    take({buffer.data(), count});
    offset += count;
  }
}

void read_bytes(const std::string& path, const std::function<void(std::span<const char>)>& take) {
  const auto refuse = [&path](int error) {
    throw FileError(path, {},
                    error == ENOENT   ? "no such file"
                    : error == EISDIR ? "is a folder, expected a file"
                                      : fmt::format("cannot be read: {}", std::strerror(error)));
  };
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) refuse(errno);
  std::vector<char> buffer(kBytesAtOnce);
  while (true) {
    const ssize_t count = ::read(file.get(), buffer.data(), buffer.size());
    if (count == 0) return;
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse(errno);
    take({buffer.data(), static_cast<std::size_t>(count)});
  }
}

}  // namespace risley::io
