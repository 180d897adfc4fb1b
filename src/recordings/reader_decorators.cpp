// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/reader_decorators.hpp"

#include <utility>

#include "risley/core/require.hpp"

namespace risley::recordings {

void DecoratingReader::take_over() {
  header_ = inner_->header();
  warnings_ = inner_->warnings();
  clock_wraps_ = inner_->clock_wraps();
  describe();
}

bool DecoratingReader::read(Chunk& chunk, std::size_t max_rows) {
  require_at_least("max_rows", static_cast<long long>(max_rows), 1);
  if (failure_) throw FileError(*failure_);
  bool more = false;
  try {
    more = inner_->read(chunk, max_rows);
  } catch (const FileError&) {
    take_over();
    throw;
  }
  if (std::optional<FileError> failure = change(chunk)) failure_.emplace(*std::move(failure));
  take_over();
  if (failure_ && chunk.observations.size() == 0 && chunk.imu.empty()) throw FileError(*failure_);
  return more;
}

}  // namespace risley::recordings
