// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "risley/core/error.hpp"
#include "risley/recordings/extrinsics.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {

/// A reader that modifies the rows of another one.
class DecoratingReader : public Reader {
 public:
  bool read(Chunk& chunk, std::size_t max_rows) final;
  double fraction_read() const final { return inner_->fraction_read(); }

 protected:
  explicit DecoratingReader(std::unique_ptr<Reader> inner) : inner_(std::move(inner)) {}

  const Reader& inner() const { return *inner_; }

  /// Copies the inner reader's state; also the last step of a constructor.
  void take_over();

  /// Changes header, warnings and clock wraps, which were just copied.
  virtual void describe() = 0;

  /// Changes a chunk.
  /// @return reason to stop the reading: the chunk then has only the rows before it
  virtual std::optional<FileError> change(Chunk& chunk) = 0;

 private:
  std::unique_ptr<Reader> inner_;
  std::optional<FileError> failure_;
};

/// Findings from the first rows on a recording's times.
struct TimesJudgement;

/// Judges times before use, from the first rows of each device.
/// @param counted  the reader counts the shots
std::shared_ptr<const TimesJudgement> judge_times(Reader& reader, bool counted,
                                                  const Progress& progress);

/// Rows that are not in firing order are sorted by their times; times that restart with every
/// message are counted; constant times are none; rounded ones, also if shots share them, are put on
/// their common even grid. Each gives a warning. Correct times are left unchanged.
/// @param open  returns the rows from the first one on
std::unique_ptr<Reader> with_judged_times(const std::function<std::unique_ptr<Reader>()>& open,
                                          std::shared_ptr<const TimesJudgement> judgement);

/// Keeps only the rows of one sensor, see ReadOptions::device.
/// @param path  for errors
/// @throws InvalidArgument as open_recording()
std::unique_ptr<Reader> of_one_device(std::unique_ptr<Reader> reader, const std::string& path,
                                      const std::string& device);

/// Gives every row the time from counting its shot, see ReadOptions::shot_rate.
/// @param path  for errors
/// @throws InvalidArgument as open_recording()
std::unique_ptr<Reader> with_counted_times(std::unique_ptr<Reader> reader, const std::string& path,
                                           const ReadOptions& options);

/// Gives every row the time of its place in its packet, see ReadOptions::packet_places.
/// @throws InvalidArgument as open_recording()
std::unique_ptr<Reader> with_packet_places(std::unique_ptr<Reader> reader,
                                           const ReadOptions& options);

/// Turns every row back into the frame of its sensor, see ReadOptions::extrinsics.
/// @throws InvalidArgument when a number of the pose is not finite, or for several sensors
std::unique_ptr<Reader> in_sensor_frame(std::unique_ptr<Reader> reader, const Extrinsics& pose);

/// Rejects times further than kLongestTimeSpan_ns from the first one as damage, so that the
/// difference of two times always fits 64 bits in later readers.
/// @param path  for errors
std::unique_ptr<Reader> within_time_span(std::unique_ptr<Reader> reader, const std::string& path);

/// Warns where the first shots cannot be those of a sensor in its own frame, see plausibility.hpp.
std::unique_ptr<Reader> with_plausibility(std::unique_ptr<Reader> reader);

}  // namespace risley::recordings
