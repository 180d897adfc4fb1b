// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace risley::parallel {

/// Memory that parallel work reuses: no more of it than is in use at a time.
template <class T>
class Pool {
  struct GiveBack {
    Pool* pool;
    void operator()(T* item) const {
      const std::scoped_lock lock(pool->mutex_);
      pool->spare_.emplace_back(item);
    }
  };

 public:
  using Item = std::unique_ptr<T, GiveBack>;  ///< goes back by itself

  /// An unused one, as its last user left it, or a new one.
  Item take() {
    const std::scoped_lock lock(mutex_);
    if (spare_.empty()) {
      spare_.reserve(++made_);  // so that returning one needs no memory
      return Item(new T(), {this});
    }
    Item item(spare_.back().release(), {this});
    spare_.pop_back();
    return item;
  }

 private:
  std::mutex mutex_;
  std::size_t made_ = 0;
  std::vector<std::unique_ptr<T>> spare_;
};

}  // namespace risley::parallel
