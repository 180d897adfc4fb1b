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

/// A reader that changes what another one reads.
class DecoratingReader : public Reader {
 public:
  bool read(Chunk& chunk, std::size_t max_rows) final;
  double fraction_read() const final { return inner_->fraction_read(); }

 protected:
  explicit DecoratingReader(std::unique_ptr<Reader> inner) : inner_(std::move(inner)) {}

  const Reader& inner() const { return *inner_; }

  /// Takes over what the inner reader knows by now; also the last step of a constructor.
  void take_over();

  /// Changes header, warnings and clock wraps, which were just taken over.
  virtual void describe() = 0;

  /// Changes a chunk.
  /// @return what stops the reading: the chunk then has only what stood before it
  virtual std::optional<FileError> change(Chunk& chunk) = 0;

 private:
  std::unique_ptr<Reader> inner_;
  std::optional<FileError> failure_;
};

/// What the first rows say of a recording's times.
struct TimesJudgement;

/// Judges times before anybody trusts them, by the first rows of each device.
/// @param counted  whoever reads counts the shots
std::shared_ptr<const TimesJudgement> judge_times(Reader& reader, bool counted,
                                                  const Progress& progress);

/// Rows that do not stand in the order of firing are sorted by their times; times that begin anew
/// with every message are counted; times that are all the same are none; rounded ones, also where
/// shots share them, are put on the even grid that they show together. Each is told as a warning.
/// Sound times are left as they are.
/// @param open  gives the rows from the first one on
std::unique_ptr<Reader> with_judged_times(const std::function<std::unique_ptr<Reader>()>& open,
                                          std::shared_ptr<const TimesJudgement> judgement);

/// Leaves the rows of one sensor, see ReadOptions::device.
/// @param path  for errors
/// @throws InvalidArgument as open_recording()
std::unique_ptr<Reader> of_one_device(std::unique_ptr<Reader> reader, const std::string& path,
                                      const std::string& device);

/// Gives every row the time that counting its shot gives, see ReadOptions::shot_rate.
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

/// Refuses times further than kLongestTimeSpan_ns from the first one as damage, so that nobody
/// behind it has to fear that the difference of two times does not fit 64 bits.
/// @param path  for errors
std::unique_ptr<Reader> within_time_span(std::unique_ptr<Reader> reader, const std::string& path);

/// Warns where the first shots cannot be those of a sensor in its own frame, see plausibility.hpp.
std::unique_ptr<Reader> with_plausibility(std::unique_ptr<Reader> reader);

}  // namespace risley::recordings
