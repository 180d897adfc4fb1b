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

/// An open file, closed whatever happens.
class Descriptor {
 public:
  explicit Descriptor(const std::string& path)
      : value_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return value_; }

 private:
  int value_;
};

}  // namespace

void read_bytes(const std::string& path, const std::function<void(std::span<const char>)>& take) {
  const auto refuse = [&path](int error) {
    throw FileError(path, {},
                    error == ENOENT   ? "no such file"
                    : error == EISDIR ? "is a folder, expected a file"
                                      : fmt::format("cannot be read: {}", std::strerror(error)));
  };
  const Descriptor file(path);
  if (file.get() < 0) refuse(errno);
  std::vector<char> buffer(1 << 18);
  while (true) {
    const ssize_t count = ::read(file.get(), buffer.data(), buffer.size());
    if (count == 0) return;
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) refuse(errno);
    take({buffer.data(), static_cast<std::size_t>(count)});
  }
}

}  // namespace risley::io
