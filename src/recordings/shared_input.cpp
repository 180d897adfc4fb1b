// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/shared_input.hpp"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/io/file_head.hpp"

#include "recordings/formats/format.hpp"
#include "recordings/formats/livox_messages.hpp"

namespace risley::recordings {
namespace {

/// Number of rows kept, a second of a Mid-40 and more; more without packets, because their times
/// must be judged first.
constexpr std::size_t kFirstRows = 1 << 17, kFirstRowsWithoutPackets = 1 << 18;

std::string known_formats() {
  std::string names;
  for (const Format* format : all_formats()) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", format->name);
  }
  return names;
}

/// The first bytes of an unknown file, as text if they are text.
std::string shown(std::string_view head) {
  constexpr std::size_t kShown = 16;
  head = head.substr(0, kShown);
  const bool is_text = std::all_of(head.begin(), head.end(), [](char c) {
    return std::isprint(static_cast<unsigned char>(c)) != 0;
  });
  if (is_text) return fmt::format("'{}'", head);
  std::string bytes;
  for (const char c : head) {
    bytes += fmt::format("{}{:02X}", bytes.empty() ? "" : " ", static_cast<unsigned char>(c));
  }
  return bytes;
}

}  // namespace

/// Reads first rows that were already decoded, or columns in memory, packets complete as a file
/// would be read, and continues after them.
class SharedReader final : public Reader {
 public:
  SharedReader(std::shared_ptr<SharedInput> input, const Progress& progress)
      : input_(std::move(input)), progress_(progress), first_(*input_->first_rows(progress)) {
    header_ = first_.header;
    warnings_ = first_.warnings;
    clock_wraps_ = first_.clock_wraps;
  }

  bool read(Chunk& chunk, std::size_t max_rows) override {
    progress_.check();
    if (input_.use_count() == 1) input_->first_.reset();  // this is the last reader
    // Only the format knows where smaller chunks may end.
    if (!rest_ && first_.are_decoded && given_ == 0 && max_rows < kDefaultChunkRows) {
      rest_ = input_->behind({}, progress_);
    }
    if (!rest_) {
      if (read_held(chunk, max_rows)) return true;
      if (first_.ended) {
        if (const auto damage = input_->damage()) throw FileError(*damage);
        return false;
      }
      rest_ = input_->behind(first_, progress_);
    }
    const auto take_over = [this] {
      header_ = rest_->header();
      warnings_ = rest_->warnings();
      clock_wraps_ = rest_->clock_wraps();
    };
    try {
      const bool more = rest_->read(chunk, max_rows);
      take_over();
      return more;
    } catch (const FileError& damage) {
      input_->keep(damage);
      take_over();
      throw;
    }
  }

  double fraction_read() const override {
    if (rest_) return rest_->fraction_read();
    if (first_.rows == 0) return first_.fraction;
    return first_.fraction * static_cast<double>(given_) / static_cast<double>(first_.rows);
  }

 private:
  /// The next rows of the current chunk. A decoder's own chunks are returned unchanged.
  bool read_held(Chunk& chunk, std::size_t max_rows) {
    chunk.clear();
    if (chunk_ == first_.chunks.size()) return false;
    const Chunk& all = *first_.chunks[chunk_];
    if (first_.are_decoded) {
      chunk = all;
      given_ += all.observations.size();
      first_.chunks[chunk_++].reset();
      return true;
    }
    std::size_t rows = 0, samples = 0;
    for (; packet_ < all.packets.size() && rows + samples < max_rows; ++packet_) {
      const Packet& packet = all.packets[packet_];
      chunk.packets.push_back(packet);
      rows += packet.rows;
      samples += packet.is_imu() ? 1 : 0;
    }
    if (all.packets.empty()) {
      rows = rows_of_whole_packets(all, max_rows);
      samples = std::min(max_rows, all.imu.size() - sample_);
    }
    chunk.observations.append(all.observations, row_, row_ + rows);
    const auto sample = all.imu.begin() + static_cast<std::ptrdiff_t>(sample_);
    chunk.imu.assign(sample, sample + static_cast<std::ptrdiff_t>(samples));
    const auto& begins = all.packet_begins;
    for (; begin_ < begins.size() && begins[begin_] < row_ + rows; ++begin_) {
      chunk.packet_begins.push_back(begins[begin_] - row_);
    }
    row_ += rows;
    sample_ += samples;
    given_ += rows;
    const bool some = rows > 0 || samples > 0 || !chunk.packets.empty();
    if (row_ == all.observations.size() && sample_ == all.imu.size() &&
        packet_ == all.packets.size()) {
      first_.chunks[chunk_++].reset();
      row_ = packet_ = sample_ = begin_ = 0;
    }
    return some || read_held(chunk, max_rows);
  }

  /// Up to the last beginning of a packet within max_rows, or the first one after it.
  std::size_t rows_of_whole_packets(const Chunk& all, std::size_t max_rows) const {
    const auto& begins = all.packet_begins;
    const std::size_t left = all.observations.size() - row_;
    if (left <= max_rows || begins.empty()) return std::min(left, max_rows);
    auto end = std::upper_bound(begins.begin(), begins.end(), row_ + max_rows);
    if (end != begins.begin() && *(end - 1) > row_) --end;
    return end == begins.end() ? left : *end - row_;
  }

  std::shared_ptr<SharedInput> input_;
  Progress progress_;
  FirstRows first_;
  std::size_t chunk_ = 0, row_ = 0, packet_ = 0, sample_ = 0, begin_ = 0;  ///< the next of each
  std::size_t given_ = 0;                                                  ///< rows
  std::unique_ptr<Reader> rest_;
};

SharedInput::SharedInput(const std::shared_ptr<const Recording>& recording, std::string name)
    : path_(std::move(name)) {
  FirstRows all{recording->header, recording->warnings, {{recording, &recording->data}}};
  all.rows = recording->data.observations.size();
  first_ = std::make_shared<const FirstRows>(std::move(all));
}

io::InputFile SharedInput::file() {
  const std::lock_guard lock(opening_);
  if (!file_) file_.emplace(path_, "a recording");
  return *file_;
}

std::unique_ptr<Reader> SharedInput::open(const Progress& progress) {
  if (again_) {
    std::unique_ptr<Reader> reader = std::move(again_);
    again_ = reader->again();
    return reader;
  }
  std::error_code code;
  if (std::filesystem::is_directory(path_, code)) {
    std::unique_ptr<bags::Bag> bag = bags::open_bag(path_, progress);
    const std::string_view name = bags::name_of(bag->kind());
    return std::make_unique<MessageReader>(std::move(bag), name);
  }
  const io::InputFile input = file();
  const std::string head = io::read_file_head(input, kHeadBytes);
  if (head.empty()) {
    throw FileError(path_, {0, {}},
                    fmt::format("is empty, expected a recording ({})", known_formats()));
  }
  for (const Format* format : all_formats()) {
    if (!format->recognises(head)) continue;
    std::unique_ptr<Reader> reader = format->open(input, progress);
    again_ = reader->again();
    return reader;
  }
  const auto other = io::stands_for_another(path_, head);
  throw FileError(path_, {0, {}},
                  other ? *other
                        : fmt::format("is of no known kind: expected {}; it begins with {}",
                                      known_formats(), shown(head)));
}

std::shared_ptr<const FirstRows> SharedInput::first_rows(const Progress& progress) {
  const std::lock_guard lock(mutex_);
  if (first_) return first_;
  rest_ = open(progress);
  FirstRows first;
  first.are_decoded = true;
  bool in_packets = false;
  try {
    while (first.rows < (in_packets ? kFirstRows : kFirstRowsWithoutPackets)) {
      auto chunk = std::make_shared<Chunk>();
      first.ended = !rest_->read(*chunk);
      if (first.ended) break;
      in_packets = in_packets || !chunk->packets.empty();
      first.rows += chunk->observations.size();
      first.chunks.push_back(std::move(chunk));
      progress.check();
    }
  } catch (const FileError& damage) {
    keep(damage);
    first.ended = true;
  }
  first.header = rest_->header();
  first.warnings = rest_->warnings();
  first.clock_wraps = rest_->clock_wraps();
  first.fraction = rest_->fraction_read();
  if (first.ended) rest_.reset();
  first_ = std::make_shared<const FirstRows>(std::move(first));
  return first_;
}

std::unique_ptr<Reader> SharedInput::behind(const FirstRows& first, const Progress& progress) {
  const std::lock_guard lock(mutex_);
  if (first.rows > 0) first_.reset();
  if (rest_ && first.rows > 0) return std::move(rest_);
  std::unique_ptr<Reader> reader = open(progress);
  Chunk chunk;
  for (std::size_t i = 0; i < first.chunks.size(); ++i) {
    reader->read(chunk);
    progress.check();
  }
  return reader;
}

std::unique_ptr<Reader> SharedInput::read(const Progress& progress) {
  return std::make_unique<SharedReader>(shared_from_this(), progress);
}

}  // namespace risley::recordings
