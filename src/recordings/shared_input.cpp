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
#include "recordings/memory_reader.hpp"

namespace risley::recordings {
namespace {

/// Rows that are read at once, a second of a Mid-40 and more, and how many of them are kept: where
/// times have to be judged first, as many as that takes.
constexpr std::size_t kFirstRows = 1 << 17, kMostFirstRows = 1 << 18;

std::string known_formats() {
  std::string names;
  for (const Format* format : all_formats()) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", format->name);
  }
  return names;
}

/// The first bytes of an unknown file, as text where they are text.
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

/// Reads first rows that others have decoded, and goes on behind them.
class SharedReader final : public Reader {
 public:
  SharedReader(std::shared_ptr<SharedInput> input, const Progress& progress)
      : input_(std::move(input)),
        progress_(progress),
        first_(input_->first_rows(progress)),
        memory_(std::make_unique<MemoryReader>(first_->recording)) {
    header_ = memory_->header();
    warnings_ = memory_->warnings();
    clock_wraps_ = first_->clock_wraps;
  }

  bool read(Chunk& chunk, std::size_t max_rows) override {
    if (!rest_) {
      if (memory_->read(chunk, max_rows)) return true;
      if (first_->failure) throw FileError(*first_->failure);
      if (first_->ended) return false;
      rest_ = input_->behind(*first_, progress_);
      memory_.reset();
      first_.reset();
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
    } catch (const FileError&) {
      take_over();
      throw;
    }
  }

  double fraction_read() const override {
    return rest_ ? rest_->fraction_read() : first_->fraction * memory_->fraction_read();
  }

 private:
  std::shared_ptr<SharedInput> input_;
  Progress progress_;
  std::shared_ptr<const FirstRows> first_;
  std::unique_ptr<MemoryReader> memory_;  ///< of the first rows
  std::unique_ptr<Reader> rest_;
};

SharedInput::SharedInput(std::shared_ptr<const Recording> recording, std::string name)
    : path_(std::move(name)),
      first_(std::make_shared<const FirstRows>(FirstRows{std::move(recording)})) {}

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
  const auto recording = std::make_shared<Recording>();
  FirstRows first;
  Chunk chunk;
  try {
    const Chunk& all = recording->data;
    while (all.observations.size() < (all.packets.empty() ? kMostFirstRows : kFirstRows)) {
      first.ended = !rest_->read(chunk, kFirstRows);
      if (first.ended) break;
      ++first.reads;
      recording->data.append(std::move(chunk));
      progress.check();
    }
  } catch (const FileError& error) {
    first.failure = error;
  }
  recording->header = rest_->header();
  recording->warnings = rest_->warnings();
  first.clock_wraps = rest_->clock_wraps();
  first.fraction = rest_->fraction_read();
  first.recording = recording;
  if (first.ended || first.failure) rest_.reset();
  first_ = std::make_shared<const FirstRows>(std::move(first));
  return first_;
}

std::unique_ptr<Reader> SharedInput::behind(const FirstRows& first, const Progress& progress) {
  const std::lock_guard lock(mutex_);
  first_.reset();
  if (rest_) return std::move(rest_);
  std::unique_ptr<Reader> reader = open(progress);
  Chunk chunk;
  for (std::size_t i = 0; i < first.reads; ++i) {
    reader->read(chunk, kFirstRows);
    progress.check();
  }
  return reader;
}

std::unique_ptr<Reader> SharedInput::read(const Progress& progress) {
  return std::make_unique<SharedReader>(shared_from_this(), progress);
}

}  // namespace risley::recordings
