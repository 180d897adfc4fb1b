// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/memory_reader.hpp"

#include <algorithm>
#include <utility>

#include "risley/recordings/livox/packet.hpp"

namespace risley::recordings {

MemoryReader::MemoryReader(std::shared_ptr<const Recording> recording)
    : recording_(std::move(recording)) {
  header_ = recording_->header;
  warnings_ = recording_->warnings;
}

bool MemoryReader::read(Chunk& chunk, std::size_t max_rows) {
  chunk.clear();
  const Chunk& all = recording_->data;
  std::size_t rows = 0, samples = 0;
  if (!all.packets.empty()) {
    for (; packet_ < all.packets.size() && rows + samples < max_rows; ++packet_) {
      const Packet& packet = all.packets[packet_];
      chunk.packets.push_back(packet);
      rows += packet.rows;
      samples += packet.data_type == livox::kImuDataType ? 1 : 0;
    }
  } else {
    rows = rows_of_whole_packets(max_rows);
    samples = std::min(max_rows, all.imu.size() - sample_);
  }
  chunk.observations.append(all.observations, row_, row_ + rows);
  const auto sample = all.imu.begin() + static_cast<std::ptrdiff_t>(sample_);
  chunk.imu.assign(sample, sample + static_cast<std::ptrdiff_t>(samples));
  for (; begin_ < all.packet_begins.size() && all.packet_begins[begin_] < row_ + rows; ++begin_) {
    chunk.packet_begins.push_back(all.packet_begins[begin_] - row_);
  }
  row_ += rows;
  sample_ += samples;
  return rows > 0 || samples > 0 || !chunk.packets.empty();
}

/// Up to the last beginning of a packet within max_rows, or the first one behind.
std::size_t MemoryReader::rows_of_whole_packets(std::size_t max_rows) const {
  const Chunk& all = recording_->data;
  const std::size_t left = all.observations.size() - row_;
  if (left <= max_rows || all.packet_begins.empty()) return std::min(left, max_rows);
  auto end = std::upper_bound(all.packet_begins.begin(), all.packet_begins.end(), row_ + max_rows);
  if (end != all.packet_begins.begin() && *(end - 1) > row_) --end;
  return end == all.packet_begins.end() ? left : *end - row_;
}

double MemoryReader::fraction_read() const {
  const Chunk& all = recording_->data;
  const std::size_t total = all.observations.size() + all.imu.size();
  return total == 0 ? 1.0 : static_cast<double>(row_ + sample_) / static_cast<double>(total);
}

}  // namespace risley::recordings
