// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/recordings/extrinsics.hpp"
#include "risley/recordings/observations.hpp"
#include "risley/recordings/source.hpp"

namespace risley::recordings {

/// Default number of rows per chunk: large enough to be fast, a few MB small.
inline constexpr std::size_t kDefaultChunkRows = 65536;

/// Reads one recording from start to end in pieces, so that memory does not grow with its length.
class Reader {
 public:
  virtual ~Reader() = default;
  /// Properties of the whole recording.
  const RecordingHeader& header() const { return header_; }
  /// Problems of the rows so far that did not end the reading.
  const std::vector<Warning>& warnings() const { return warnings_; }
  /// Number of new seconds of a PPS clock so far, over all devices; 0 for other clocks.
  std::uint64_t clock_wraps() const { return clock_wraps_; }

  /// Replaces the chunk by the next rows, about max_rows (packets stay complete).
  /// @return false when there is nothing more
  /// @throws FileError at damage in the body, after all valid rows before it were returned; from
  /// open_recording() also at a time further than kLongestTimeSpan_ns from the first, and
  /// InvalidArgument for max_rows = 0
  virtual bool read(Chunk& chunk, std::size_t max_rows = kDefaultChunkRows) = 0;

  /// As read(), for an analysis of the valid rows: damage is their end. A source that is held open
  /// stores it (Source::damage()), for callers that need all rows.
  bool read_sound(Chunk& chunk, std::size_t max_rows = kDefaultChunkRows);

  /// Part of the file already read, [0, 1].
  virtual double fraction_read() const = 0;

  /// Another reader of the same open file, at its beginning; none if the format opens one. Both
  /// belong to one thread.
  virtual std::unique_ptr<Reader> again() const { return nullptr; }

 protected:
  RecordingHeader header_;
  std::vector<Warning> warnings_;
  std::uint64_t clock_wraps_ = 0;

  /// Adds to warnings().
  template <class... Values>
  Warning& warn(WarningCode code, fmt::format_string<Values...> words, Values&&... values) {
    return risley::warn(warnings_, code, words, std::forward<Values>(values)...);
  }
};

/// Largest distance of a time from the first one: 146 years, half of the range of 64 bits, so that
/// the difference of any two times fits 64 bits.
inline constexpr std::int64_t kLongestTimeSpan_ns = (std::int64_t{1} << 62) - 1;

/// Time inserted for an unknown number of missing shots, s: too long to count the turns of a rotor.
inline constexpr double kUnknownGap = 10.0;

/// Place of a row whose position in its packet is unknown.
inline constexpr std::uint8_t kNoPlace = 255;

/// Places in their packets at which the shots of rows were fired; for formats whose packets may
/// lack points (RecordingHeader::packet_shots).
struct PacketPlaces {
  /// Of every row of the recording, counted from 0, or kNoPlace. The row then loses its direction.
  std::vector<std::uint8_t> of_row;
  double shot_rate = 0;  ///< within packets, Hz
  /// Emitter of places 0, 1, ..., one entry per emitter; not empty.
  std::vector<std::uint8_t> firing_order;
  /// Coordinates were truncated towards zero, not rounded: points are moved to the middle of their
  /// interval.
  bool cut_coordinates = false;
};

/// Settings for reading a recording.
struct ReadOptions {
  /// Sensor of a recording of several: serial number, topic, or place in
  /// RecordingHeader::devices, from 0. Only its rows, packets and inertial samples are read, and
  /// the header names only this sensor. Empty: all.
  std::string device = {};
  /// Shots of one device per second, Hz. Times are then counted: shot i is fired at i / shot_rate,
  /// whatever times the file holds. Rows of a further return belong to the shot before them.
  /// Packet headers and inertial samples, which have the file's times, are dropped.
  std::optional<double> shot_rate = {};
  /// Emitters of the sensor, which fire in turn: if times are counted and the file has no other
  /// beam than 0, shot i is of beam i modulo emitters. 0 or 1: beams are those of the file.
  int emitters = 0;
  /// If they fire in another order: emitter of shots 0, 1, ...; one entry per emitter.
  std::vector<std::uint8_t> firing_order = {};
  /// If times are counted: errors of the count, rows ascending. For recordings of one sensor.
  std::vector<ShotSlip> slips = {};
  /// Places of rows in their packets, for recordings of one sensor: the time of a row is that of
  /// its packet plus its place times their shot interval. Not together with shot_rate.
  std::optional<PacketPlaces> packet_places = {};
  /// Pose of the sensor in the frame of the recording: every row is transformed back into the
  /// sensor's frame, direction and range. Directions without a range are only rotated; a
  /// translation is not applied, with a warning. The same for a chunk with columns that have room
  /// for the rows from a row on. Rounding steps are transformed, too: along and across the beam
  /// they mix as the translation turns the line of sight, and across it the larger of the two steps
  /// is used. Packet headers are dropped, inertial samples stay unchanged, and the header no longer
  /// states a pose. A pose of zeros changes nothing.
  std::optional<Extrinsics> extrinsics = {};
};

/// Opens a recording of any known format, recognised by its content and not by its name: a file, or
/// a folder of ROS 2 whose metadata.yaml names the bags to read one after the other; or one in
/// memory. Times are checked first: rows of a file that are not in firing order are sorted by time,
/// times that restart with every message are counted, rounded ones are snapped to their common even
/// grid of shots, with a warning.
/// @param progress cancels opening, and reading if a chunk may take long; its flag must outlive the
/// reader
/// @throws FileError when it is missing, empty, of no known format, or its header is damaged;
///         InvalidArgument when device names none or several, shot_rate is not a finite number
///         above 0, emitters are not 0 to 255 or not as many as the firing order has, slips do not
///         ascend, places come with a shot rate, without a firing order or for a recording that has
///         none, extrinsics are not finite, or when they are given for a recording of several
///         sensors
std::unique_ptr<Reader> open_recording(const Source& source, const ReadOptions& options = {},
                                       const Progress& progress = {});

/// Whether a folder holds one recording and not any number of them: a bag of ROS 2, even if its
/// metadata.yaml is missing.
bool is_recording_folder(const std::string& path);

/// The sensors of a recording in words, each with its number: "0: Livox Avia, serial ..."
std::string devices_words(const RecordingHeader& header);

/// @param name  of the recording
/// @throws InvalidArgument for a recording of several sensors, with their list and how to choose
/// one
void require_one_device(const RecordingHeader& header, const std::string& name);

/// A recording without times was used where times are needed.
class MissingTimes : public InvalidArgument {
 public:
  using InvalidArgument::InvalidArgument;
};

/// @throws MissingTimes unless the recording has times of single shots
void require_times(const RecordingHeader& header);

/// A whole recording in memory.
struct Recording {
  RecordingHeader header;
  Chunk data;
  std::vector<Warning> warnings;
};

/// Reads a whole recording into memory. @throws as open_recording
Recording load_recording(const Source& source, const Progress& progress = {},
                         const ReadOptions& options = {});

}  // namespace risley::recordings
