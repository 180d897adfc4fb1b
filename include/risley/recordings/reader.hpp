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

/// Rows per chunk unless the caller asks otherwise: large enough to be fast, a few MB small.
inline constexpr std::size_t kDefaultChunkRows = 65536;

/// Reads one recording from start to end in pieces, so that memory does not grow with its length.
class Reader {
 public:
  virtual ~Reader() = default;
  /// What is known of the whole recording.
  const RecordingHeader& header() const { return header_; }
  /// What is wrong with the rows so far and did not end the reading.
  const std::vector<Warning>& warnings() const { return warnings_; }
  /// How often a PPS clock began a new second so far, over all devices; 0 for other clocks.
  std::uint64_t clock_wraps() const { return clock_wraps_; }

  /// Replaces the chunk by the next rows, about max_rows (packets stay whole).
  /// @return false when there is nothing more
  /// @throws FileError at damage in the body, after every sound row before it was returned; from
  ///         open_recording() also at a time further than kLongestTimeSpan_ns from the first, and
  ///         InvalidArgument for max_rows = 0
  virtual bool read(Chunk& chunk, std::size_t max_rows = kDefaultChunkRows) = 0;

  /// As read(), to find something out about the sound rows: damage is their end. A source that is
  /// held open keeps it (Source::damage()), for whoever needs all rows.
  bool read_sound(Chunk& chunk, std::size_t max_rows = kDefaultChunkRows);

  /// Part of the file already read, [0, 1].
  virtual double fraction_read() const = 0;

  /// Another reader of the same open file, at its beginning; none where the format opens one. Both
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

/// No time of a recording is further from the first one: 146 years, half of what 64 bits hold, so
/// that the difference of any two times is a number of 64 bits.
inline constexpr std::int64_t kLongestTimeSpan_ns = (std::int64_t{1} << 62) - 1;

/// Time that is put where an unknown number of shots is missing, s: longer than anybody counts the
/// turns of a rotor over.
inline constexpr double kUnknownGap = 10.0;

/// Place of a row whose position in its packet is unknown.
inline constexpr std::uint8_t kNoPlace = 255;

/// Where in their packets the shots of rows were fired; of formats whose packets may lack points
/// (RecordingHeader::packet_shots).
struct PacketPlaces {
  /// Of every row of the recording, counted from 0, or kNoPlace. The row loses its direction then.
  std::vector<std::uint8_t> of_row;
  double shot_rate = 0;  ///< within packets, Hz
  /// Emitter of places 0, 1, ..., one entry per emitter; not empty.
  std::vector<std::uint8_t> firing_order;
  /// Coordinates were cut off towards zero, not rounded: points are moved to the middle of where
  /// they were.
  bool cut_coordinates = false;
};

/// How a recording is to be read.
struct ReadOptions {
  /// Sensor of a recording of several: serial number, topic, or place in
  /// RecordingHeader::devices, from 0. Only its rows, packets and inertial samples are read, and
  /// the header names it alone. Empty: all.
  std::string device = {};
  /// Shots of one device per second, Hz. Times are then counted: shot i is fired at i / shot_rate,
  /// whatever times the file holds. Rows of a further return belong to the shot before them.
  /// Packet headers and inertial samples, which have the file's times, are left out.
  std::optional<double> shot_rate = {};
  /// Emitters of the sensor, which fire in turn: where times are counted and the file has no other
  /// beam than 0, shot i is of beam i modulo emitters. 0 or 1: beams are those of the file.
  int emitters = 0;
  /// Where they fire in another order: emitter of shots 0, 1, ...; one entry per emitter.
  std::vector<std::uint8_t> firing_order = {};
  /// Where times are counted: what is wrong with the count, rows ascending. For recordings of one
  /// sensor.
  std::vector<ShotSlip> slips = {};
  /// Places of rows in their packets, for recordings of one sensor: the time of a row is that of
  /// its packet and its place further at their shot rate. Not together with shot_rate.
  std::optional<PacketPlaces> packet_places = {};
  /// Pose of the sensor in the frame that the recording stands in: every row is turned back into
  /// the sensor's frame, direction and range. Directions without a range are only turned, a
  /// translation is left out with a warning. Rows without a return keep their place, angles that
  /// they hold are turned; a point within its range's rounding of the sensor is such a row that
  /// was moved. Rounding steps go along: along and across the beam they mix as the
  /// translation turns the line of sight, and across it the larger of the two steps is taken.
  /// Packet headers are left out, inertial samples stay as they are, and the header states no pose
  /// any more. A pose of zeros changes nothing.
  std::optional<Extrinsics> extrinsics = {};
};

/// Opens a recording of any known format, recognised by its content and not by its name: a file, or
/// a folder of ROS 2 whose metadata.yaml names the bags that are read one after the other; or one
/// in memory. Times are judged before they are given: where rows of a file do not stand in the
/// order of firing they are sorted by time, times that begin anew with every message are counted,
/// rounded ones are put on the even grid of shots that they show, with a warning.
/// @param progress  cancels opening, and reading where a chunk may take long; its flag must outlive
///                  the reader
/// @throws FileError when it is missing, empty, of no known format, or its header is damaged;
///         InvalidArgument when device names none or several, shot_rate is not a finite number
///         above 0, emitters are not 0 to 255 or not as many as the firing order has, slips do not
///         ascend, places come with a shot rate, without a firing order or for a recording that has
///         none, extrinsics are not finite, or when they are given for a recording of several
///         sensors
std::unique_ptr<Reader> open_recording(const Source& source, const ReadOptions& options = {},
                                       const Progress& progress = {});

/// Whether a folder holds one recording and not any number of them: a bag of ROS 2, also where its
/// metadata.yaml is missing.
bool is_recording_folder(const std::string& path);

/// The sensors of a recording in words, each with its number: "0: Livox Avia, serial ..."
std::string devices_words(const RecordingHeader& header);

/// @param name  of the recording
/// @throws InvalidArgument for a recording of several sensors: which they are, and how to choose
void require_one_device(const RecordingHeader& header, const std::string& name);

/// A recording without times was given to something that needs them.
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
