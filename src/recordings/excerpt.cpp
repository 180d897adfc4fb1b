// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/recordings/excerpt.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/require.hpp"
#include "risley/core/text.hpp"
#include "risley/recordings/writer.hpp"

#include "recordings/formats/format.hpp"

namespace risley::recordings {
namespace {

/// A stretch begins and ends at one of this many parts of its length.
constexpr std::int64_t kParts = 16;
/// Packets late by less are not a reset of the clock.
constexpr double kLate_ns = 10e6;
/// Angles derived from coordinates are rounded to this part of their resolution.
constexpr double kAnglePart = 0.25;
constexpr const char* kEnding = ".nc";

/// Consecutive rows of one device, counted among its own.
struct Stretch {
  std::uint8_t device = 0;
  std::uint64_t first_row = 0, rows = 0;
  std::uint64_t valid = 0;  ///< shots with a direction
};

/// Finds the stretch of one device that has most shots with a direction.
class StretchSearch {
 public:
  /// @param part_ns  a kParts-th of the length, in the unit of the times
  /// @param late_ns  after a larger step back times restart
  StretchSearch(std::uint8_t device, double part_ns, double late_ns, std::uint64_t most_shots)
      : part_ns_(part_ns), late_ns_(late_ns), most_shots_(most_shots) {
    best_.device = device;
  }

  void add(const Observations& rows, std::size_t row) {
    const std::int64_t time = rows.time_ns[row];
    const bool begun = rows_ > 0;
    const bool same_shot = begun && time == last_time_ && rows.return_number[row] > last_return_;
    last_return_ = rows.return_number[row];
    if (!same_shot) {
      // Doubles, because times of damaged files may lie too far apart for any integer.
      const double step = begun ? static_cast<double>(time) - static_cast<double>(last_time_) : 0;
      if (!begun || step < -late_ns_) restart(time);
      begin_shot(time);
      if (rows.valid[row] != 0) ++parts_.back().valid;
      last_time_ = time;
    }
    ++parts_.back().rows;
    ++rows_;
  }

  /// Of all rows so far.
  Stretch best() {
    consider();
    return best_;
  }

 private:
  struct Part {
    double number = 0;  ///< since the last reset
    std::uint64_t first_row = 0, rows = 0, shots = 0, valid = 0;
  };

  void restart(std::int64_t time) {
    consider();
    parts_.clear();
    shots_ = 0;
    origin_ = time;
  }

  void begin_shot(std::int64_t time) {
    double number =
        std::floor((static_cast<double>(time) - static_cast<double>(origin_)) / part_ns_);
    if (!parts_.empty()) number = std::max(number, parts_.back().number);
    const bool full = shots_ == most_shots_;
    if (full || parts_.empty() || number > parts_.back().number) {
      consider();
      if (full && !parts_.empty()) drop_front();
      while (!parts_.empty() && number - parts_.front().number >= kParts) drop_front();
      if (parts_.empty() || number > parts_.back().number) {
        parts_.push_back({number, rows_, 0, 0, 0});
      }
    }
    ++parts_.back().shots;
    ++shots_;
  }

  void drop_front() {
    shots_ -= parts_.front().shots;
    parts_.pop_front();
  }

  void consider() {
    Stretch found;
    for (const Part& part : parts_) {
      found.rows += part.rows;
      found.valid += part.valid;
    }
    if (found.valid <= best_.valid) return;
    best_ = {best_.device, parts_.front().first_row, found.rows, found.valid};
  }

  double part_ns_, late_ns_;
  std::uint64_t most_shots_;
  std::deque<Part> parts_;   ///< at most kParts of one time
  std::uint64_t shots_ = 0;  ///< of these
  std::int64_t origin_ = 0, last_time_ = 0;
  std::uint8_t last_return_ = 0;
  std::uint64_t rows_ = 0;
  Stretch best_;
};

/// The nearest power of two; 0 stays.
float power_of_two(float value) {
  return value > 0.0F ? std::exp2(std::round(std::log2(value))) : 0.0F;
}

/// The nearest multiple of a power of two within [low, high].
double rounded(double angle, double step, double low, double high) {
  return step > 0.0 ? std::clamp(std::round(angle / step) * step, low, high) : angle;
}

/// Whether the angles of a row were derived from coordinates in whole steps, whatever the header
/// says of the others.
bool is_cartesian(const Observations& rows, std::size_t row) {
  constexpr double kSame = 1e-5;
  const double step = rows.range_resolution[row], range = rows.range[row];
  if (!(range > 0.0) || !(step > 0.0)) return false;
  return std::abs(range * rows.zenith_resolution[row] - step) < kSame * step;
}

class ExcerptWriter {
 public:
  ExcerptWriter(const std::string& path, const RecordingHeader& source, const Stretch& stretch,
                const ExcerptOptions& options)
      : stretch_(stretch), cartesian_(source.cartesian) {
    excerpt_.path = path;
    excerpt_.has_times = source.has_times;
    excerpt_.has_ranges = options.ranges && source.has_range;
    excerpt_.first_row = stretch.first_row;
    RecordingHeader header;
    header.devices.resize(1);
    if (stretch.device < source.devices.size()) {
      header.devices[0].type = source.devices[stretch.device].type;
    }
    excerpt_.device_type = header.devices[0].type;
    header.format = kNetcdfFormat.name;
    for (const Format* format : all_formats()) {  // any other text may identify a person
      if (format->name == source_format(source)) header.format = format->name;
    }
    header.has_times = source.has_times;
    header.has_range = excerpt_.has_ranges;
    header.has_intensity = false;
    header.cartesian = source.cartesian;
    header.returns_per_shot = source.returns_per_shot;
    writer_ = kNetcdfFormat.create(path, header, {});
  }

  /// Copies the rows that belong to the stretch. @return whether more follows
  bool take(const Observations& rows) {
    Observations& to = chunk_.observations;
    to.clear();
    for (std::size_t row = 0; row < rows.size() && rows_seen_ < end(); ++row) {
      if (rows.device[row] != stretch_.device) continue;
      if (rows_seen_++ >= stretch_.first_row) take_row(rows, row);
    }
    writer_->write(chunk_);
    return rows_seen_ < end();
  }

  Excerpt close() {
    writer_->close();
    if (excerpt_.has_times) excerpt_.duration = 1e-9 * static_cast<double>(last_time_);
    return std::move(excerpt_);
  }

 private:
  std::uint64_t end() const { return stretch_.first_row + stretch_.rows; }

  void take_row(const Observations& from, std::size_t row) {
    Observations& to = chunk_.observations;
    if (excerpt_.observations == 0) origin_ = from.time_ns[row];
    const std::int64_t time = from.time_ns[row] - origin_;
    const std::size_t i = to.size();
    to.resize(i + 1);
    to.time_ns[i] = time;
    to.azimuth[i] = from.azimuth[row];
    to.zenith[i] = from.zenith[row];
    to.azimuth_resolution[i] = from.azimuth_resolution[row];
    to.zenith_resolution[i] = from.zenith_resolution[row];
    to.range[i] = std::numeric_limits<double>::quiet_NaN();
    if (excerpt_.has_ranges) {
      to.range[i] = from.range[row];
      to.range_resolution[i] = from.range_resolution[row];
    } else if (cartesian_ || is_cartesian(from, row)) {
      round_row(to, i);
    }
    to.return_number[i] = from.return_number[row];
    to.tag[i] = from.tag[row];
    to.beam[i] = from.beam[row];
    to.valid[i] = from.valid[row];
    const bool same_shot =
        excerpt_.observations > 0 && time == last_time_ && from.return_number[row] > last_return_;
    if (!same_shot) ++excerpt_.shots;
    ++excerpt_.observations;
    if (from.valid[row] == 0) ++excerpt_.no_return;
    last_time_ = time;
    last_return_ = from.return_number[row];
  }

  void round_row(Observations& rows, std::size_t row) {
    rows.azimuth_resolution[row] = power_of_two(rows.azimuth_resolution[row]);
    rows.zenith_resolution[row] = power_of_two(rows.zenith_resolution[row]);
    rows.azimuth[row] = rounded(rows.azimuth[row], kAnglePart * rows.azimuth_resolution[row],
                                std::nextafter(-kPi, 0.0), kPi);
    rows.zenith[row] =
        rounded(rows.zenith[row], kAnglePart * rows.zenith_resolution[row], 0.0, kPi);
    excerpt_.rounded = true;
  }

  Stretch stretch_;
  bool cartesian_;
  std::unique_ptr<Writer> writer_;
  Excerpt excerpt_;
  Chunk chunk_;
  std::uint64_t rows_seen_ = 0;  ///< of the device
  std::int64_t origin_ = 0, last_time_ = 0;
  std::uint8_t last_return_ = 0;
};

void check(const Source& recording, const std::string& path, const ExcerptOptions& options) {
  if (!lower_case(path).ends_with(kEnding)) {
    throw InvalidArgument(fmt::format(
        "{}: the name of an excerpt must end in {}: it is written in the lossless NetCDF format, "
        "because other formats drop shots without return or round directions",
        path, kEnding));
  }
  if (recording.is_same_as(path)) {
    throw InvalidArgument(
        fmt::format("{}: the excerpt would replace the recording; name another file", path));
  }
  require_above("ExcerptOptions::longest", options.longest, 0, "s");
  const auto require_shots = [](const char* name, std::uint64_t shots) {
    require_not_below(name, static_cast<double>(shots), 1);
  };
  require_shots("ExcerptOptions::most_shots", options.most_shots);
  require_shots("ExcerptOptions::most_shots_without_times", options.most_shots_without_times);
}

/// Searches all sound rows. @param damage  receives the reason if they end before the file
Stretch best_stretch(Reader& reader, const ExcerptOptions& options, const Progress& progress,
                     std::optional<FileError>& damage) {
  const bool has_times = reader.header().has_times;
  const double length =
      has_times ? 1e9 * options.longest : static_cast<double>(options.most_shots_without_times);
  const std::uint64_t most_shots =
      has_times ? options.most_shots
                : std::min(options.most_shots, options.most_shots_without_times);
  std::vector<StretchSearch> searches;
  Chunk chunk;
  try {
    while (reader.read(chunk)) {
      const Observations& rows = chunk.observations;
      for (std::size_t row = 0; row < rows.size(); ++row) {
        while (searches.size() <= rows.device[row]) {
          searches.emplace_back(static_cast<std::uint8_t>(searches.size()),
                                length / static_cast<double>(kParts), has_times ? kLate_ns : 0.0,
                                most_shots);
        }
        searches[rows.device[row]].add(rows, row);
      }
      progress.report(0.5 * reader.fraction_read());
    }
  } catch (const FileError& error) {
    damage.emplace(error);
  }
  Stretch best;
  for (StretchSearch& search : searches) {
    const Stretch stretch = search.best();
    if (stretch.valid > best.valid) best = stretch;
  }
  return best;
}

}  // namespace

ExcerptContents contents_of(const Excerpt& excerpt) {
  ExcerptContents contents;
  contents.holds = {excerpt.rounded ? "directions and their resolution, rounded" : "directions",
                    excerpt.has_times ? "times from 0" : "shot numbers from 0",
                    "shots without return in their places", "return numbers, tags and beams",
                    "the type of the sensor and the format of the recording"};
  contents.lacks = {"serial numbers",   "date and time of day", "file names",    "intensities",
                    "inertial samples", "extrinsics",           "packet headers"};
  auto& ranges = excerpt.has_ranges ? contents.holds : contents.lacks;
  ranges.insert(ranges.begin() + 1, "ranges");
  return contents;
}

Excerpt write_excerpt(const Source& recording, const std::string& path,
                      const ExcerptOptions& options, const ReadOptions& reading,
                      const Progress& progress) {
  check(recording, path, options);
  std::optional<FileError> damage;
  auto reader = open_recording(recording, reading, progress);
  const Stretch stretch = best_stretch(*reader, options, progress, damage);
  std::vector<Warning> warnings = reader->warnings();
  if (stretch.valid == 0) {
    if (damage) throw FileError(*damage);
    throw FileError(recording.name(), {},
                    "holds no shot with a direction, so there is nothing to share");
  }
  reader = open_recording(recording, reading, progress);
  ExcerptWriter writer(path, reader->header(), stretch, options);
  Chunk chunk;
  while (reader->read(chunk)) {
    progress.report(0.5 + 0.5 * reader->fraction_read());
    if (!writer.take(chunk.observations)) break;
  }
  Excerpt excerpt = writer.close();
  excerpt.warnings = std::move(warnings);
  excerpt.damage = std::move(damage);
  return excerpt;
}

}  // namespace risley::recordings
