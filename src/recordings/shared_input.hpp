// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "risley/io/block_file.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {

struct TimesJudgement;  // judged_times.cpp

/// The first rows of a recording, and the state after them.
struct FirstRows {
  RecordingHeader header;
  std::vector<Warning> warnings;
  std::vector<std::shared_ptr<const Chunk>> chunks;
  std::size_t rows = 0;
  bool are_decoded = false;  ///< in chunks of kDefaultChunkRows, and not columns in memory
  std::uint64_t clock_wraps = 0;
  double fraction = 1;  ///< of their file
  bool ended = true;    ///< there are no more undamaged ones
};

/// Data shared by the copies of a Source: a file that is opened once and its first rows, which are
/// decoded and judged once. Reading beyond them drops them, and later requests are decoded again
/// from the open file. For any number of threads.
class SharedInput : public std::enable_shared_from_this<SharedInput> {
 public:
  explicit SharedInput(std::string path) : path_(std::move(path)) {}
  SharedInput(const std::shared_ptr<const Recording>& recording, std::string name);

  const std::string& path() const { return path_; }
  /// The open file. @throws FileError; for a folder, too
  io::InputFile file();
  /// All rows as in the file.
  std::unique_ptr<Reader> read(const Progress& progress);
  /// Reason why a pass over the rows ended before all were read.
  std::optional<FileError> damage() const {
    const std::lock_guard lock(damaging_);
    return damage_;
  }
  /// Judgement of the times of a device's first rows.
  /// @param judge  called if they have not been judged yet
  template <class Judge>
  std::shared_ptr<const TimesJudgement> judgement(const std::string& device, bool counted,
                                                  Judge&& judge) {
    const std::lock_guard lock(judging_);
    auto& known = judgements_[{device, counted}];
    if (!known) known = judge();
    return known;
  }

 private:
  friend class SharedReader;
  void keep(const FileError& damage) {
    const std::lock_guard lock(damaging_);
    damage_.emplace(damage);
  }
  std::unique_ptr<Reader> open(const Progress& progress);
  std::shared_ptr<const FirstRows> first_rows(const Progress& progress);
  std::unique_ptr<Reader> behind(const FirstRows& first, const Progress& progress);

  std::string path_;
  std::mutex mutex_, opening_, judging_;
  mutable std::mutex damaging_;
  std::optional<FileError> damage_;  ///< of the file; the same for every pass
  std::optional<io::InputFile> file_;
  std::shared_ptr<const FirstRows> first_;
  std::unique_ptr<Reader> rest_;   ///< after the first rows, until a reader goes beyond them
  std::unique_ptr<Reader> again_;  ///< for the next one, if the format has one
  std::map<std::pair<std::string, bool>, std::shared_ptr<const TimesJudgement>> judgements_;
};

}  // namespace risley::recordings
