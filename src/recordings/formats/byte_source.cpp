// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/byte_source.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace risley::recordings {

std::uint64_t ByteSource::skip(std::uint64_t count) {
  std::array<std::uint8_t, 4096> bytes;
  std::uint64_t done = 0;
  while (done < count) {
    const auto wanted = std::min<std::uint64_t>(count - done, bytes.size());
    const std::size_t got = read(bytes.data(), static_cast<std::size_t>(wanted));
    done += got;
    if (got < wanted) break;
  }
  return done;
}

FileSource::FileSource(io::InputFile file, std::uint64_t begin, std::uint64_t end)
    : file_(std::move(file)),
      offset_(std::min(begin, file_.size())),
      end_(std::min(end, file_.size())) {}

std::size_t FileSource::read(std::uint8_t* bytes, std::size_t count) {
  std::size_t done = 0;
  while (done < count && offset_ < end_) {
    const auto piece = static_cast<std::size_t>(
        std::min<std::uint64_t>({count - done, end_ - offset_, io::BlockInput::kBlockBytes}));
    std::copy_n(file_.at(offset_, piece), piece, bytes + done);
    done += piece;
    offset_ += piece;
  }
  return done;
}

std::uint64_t FileSource::skip(std::uint64_t count) {
  count = std::min(count, offset_ < end_ ? end_ - offset_ : 0);
  offset_ += count;
  return count;
}

bool LzfSource::packed_byte(std::uint8_t& byte) {
  if (next_ == end_) {
    next_ = 0;
    end_ = packed_->read(block_.data(), block_.size());
    if (end_ == 0) return false;
  }
  byte = block_[next_++];
  return true;
}

/// Reads the type of the next run of bytes. @return false at the end or at damage
bool LzfSource::next_run() {
  constexpr std::uint8_t kFewestCopied = 2, kLongRun = 7, kLiteralRuns = 32;
  std::uint8_t control = 0;
  if (!problem_.empty() || !packed_byte(control)) return false;
  if (control < kLiteralRuns) {
    literals_ = control + std::size_t{1};
    return true;
  }
  std::uint8_t longer = 0, low = 0;
  const bool is_long = control >> 5 == kLongRun;
  if ((is_long && !packed_byte(longer)) || !packed_byte(low)) {
    problem_ = "the compressed data end in the middle of a run";
    return false;
  }
  copies_ = std::size_t{kFewestCopied} + (control >> 5) + longer;
  distance_ = (std::size_t{control} & 31U) * 256 + low + 1;
  if (distance_ > produced_) {
    problem_ =
        fmt::format("the compressed data refer to {} bytes back, but only {} bytes come before",
                    distance_, produced_);
    copies_ = 0;
    return false;
  }
  return true;
}

std::size_t LzfSource::read(std::uint8_t* bytes, std::size_t count) {
  std::size_t done = 0;
  while (done < count) {
    if (literals_ == 0 && copies_ == 0 && !next_run()) break;
    std::uint8_t byte = 0;
    if (literals_ > 0) {
      if (!packed_byte(byte)) {
        problem_ = "the compressed data end in the middle of a run";
        literals_ = 0;
        break;
      }
      --literals_;
    } else {
      byte = window_[(produced_ - distance_) % kWindow];
      --copies_;
    }
    window_[produced_++ % kWindow] = byte;
    bytes[done++] = byte;
  }
  return done;
}

}  // namespace risley::recordings
