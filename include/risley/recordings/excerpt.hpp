// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "risley/core/error.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::recordings {

/// What an excerpt may hold.
struct ExcerptOptions {
  bool ranges = false;                 ///< ranges show the place
  double longest = 1.0;                ///< s
  std::uint64_t most_shots = 250'000;  ///< a second at the highest rate, 240 kHz, and some more
  /// Shots when the recording has no times: a second at the lowest rate.
  std::uint64_t most_shots_without_times = 100'000;
};

/// Contents of an excerpt.
struct Excerpt {
  std::string path;                ///< of its file
  std::uint64_t observations = 0;  ///< rows, those without return included
  std::uint64_t shots = 0;
  std::uint64_t no_return = 0;  ///< rows that are not valid
  std::uint8_t device_type = kMid40;
  bool has_times = true;
  bool has_ranges = false;
  /// Directions and resolutions that came from coordinates were rounded, see write_excerpt().
  bool rounded = false;
  double duration = 0;              ///< from the first to the last shot, s; 0 without times
  std::uint64_t first_row = 0;      ///< of the recording's rows of this device, from 0
  std::vector<Warning> warnings;    ///< of the recording
  std::optional<FileError> damage;  ///< of the recording, behind the rows searched
};

/// The same in words, for the sender.
struct ExcerptContents {
  std::vector<std::string> holds, lacks;
};

/// Contents and omissions of an excerpt, item by item.
ExcerptContents contents_of(const Excerpt& excerpt);

/// Writes a small and anonymous part of a recording in the lossless NetCDF form: the stretch of one
/// device, no longer than the options say and without a clock reset in it, that has most shots with
/// a direction. Reads the recording twice; memory does not grow with its length.
///
/// It holds, bit by bit, directions, resolutions, number of return, tag, beam and validity of every
/// row, shots without return in their places; times from 0 (shot numbers from 0 if the recording
/// has no times); the type of the sensor and the format of the rows. With ExcerptOptions::ranges it
/// also holds ranges and their resolution. It does not hold serial numbers, extrinsics, absolute
/// times, intensities, packet headers, inertial samples or details.
///
/// Coordinates in whole steps reveal their range: by the angular resolution, step / range, and by
/// the direction, which may belong to only one point in whole steps. Without ranges the resolutions
/// of such rows are rounded to the nearest power of two, and angles to a quarter of that, which
/// leaves the range known to a factor of two and adds a sixteenth to the variance of the rounding.
///
/// @param recording  of any known format
/// @param path  must end in ".nc"; appears when it is complete
/// @throws InvalidArgument for another ending, for an output that is the recording and for limits
///         that are not positive; FileError, also when there is no shot with a direction
Excerpt write_excerpt(const Source& recording, const std::string& path,
                      const ExcerptOptions& options = {}, const ReadOptions& reading = {},
                      const Progress& progress = {});

}  // namespace risley::recordings
