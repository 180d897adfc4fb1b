// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>

#include "risley/recordings/reader.hpp"

namespace risley::recordings {

/// Reads a recording that is in memory, packets whole, as its file would be read.
class MemoryReader final : public Reader {
 public:
  explicit MemoryReader(std::shared_ptr<const Recording> recording);

  bool read(Chunk& chunk, std::size_t max_rows) override;
  double fraction_read() const override;

 private:
  std::size_t rows_of_whole_packets(std::size_t max_rows) const;

  std::shared_ptr<const Recording> recording_;
  std::size_t row_ = 0, packet_ = 0, sample_ = 0, begin_ = 0;  ///< the next of each
};

}  // namespace risley::recordings
