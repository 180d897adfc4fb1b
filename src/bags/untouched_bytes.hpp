// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>

namespace risley::bags {

/// Zeroed memory that costs nothing until it is written to, however much a file requests.
class UntouchedBytes {
 public:
  UntouchedBytes() = default;
  explicit UntouchedBytes(std::size_t count)
      : bytes_(static_cast<std::uint8_t*>(std::calloc(count, 1))), size_(count) {
    if (bytes_ == nullptr && count > 0) throw std::bad_alloc();
  }

  bool empty() const { return size_ == 0; }
  std::uint8_t* data() { return bytes_.get(); }
  const std::uint8_t* data() const { return bytes_.get(); }
  /// Makes room for this many bytes; the content is lost if it has to grow.
  void make_room(std::size_t count) {
    if (count > size_) *this = UntouchedBytes(count);
  }

 private:
  struct Free {
    void operator()(std::uint8_t* bytes) const { std::free(bytes); }
  };
  std::unique_ptr<std::uint8_t, Free> bytes_;
  std::size_t size_ = 0;
};

}  // namespace risley::bags
