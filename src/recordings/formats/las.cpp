// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// LAS and LAZ files as recordings: clouds whose points are in the frame of the sensor. Properties
// that a file does not state follow from its first points: how coarse its coordinates are, whether
// GPS times are those of single shots, and the factor of intensities.
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/seconds.hpp"

#include "recordings/formats/cartesian.hpp"
#include "recordings/formats/format.hpp"
#include "recordings/formats/las_points.hpp"
#include "recordings/formats/rounding.hpp"

namespace risley::recordings {
namespace las {
namespace {

constexpr std::size_t kPointsLookedAt = 8192;

/// Whether a point is a further return of the shot of the point before it.
bool is_further_return(const Point& point, const Point& before) {
  return point.return_number > 1 && point.return_number > before.return_number &&
         point.gps_time == before.gps_time;
}

class LasReader final : public Reader {
 public:
  LasReader(const io::InputFile& file, std::string_view format) : path_(file.path()) {
    io::BlockInput input(file);
    file_ = read_header(input, warnings_);
    source_ = file_.compressed ? open_compressed_points(std::move(input), file_, warnings_)
                               : open_points(std::move(input), file_, warnings_);
    header_.format = format;
    header_.cartesian = true;
    header_.devices.push_back(device());
    look_ahead();
    learn_step();
    learn_times();
    learn_intensity();
    for (const Point& point : ahead_) {
      const std::uint8_t returns = std::max(point.return_number, point.number_of_returns);
      header_.returns_per_shot = std::max<int>(header_.returns_per_shot, returns);
    }
  }

  bool read(Chunk& chunk, std::size_t max_rows) override {
    chunk.clear();
    Observations& rows = chunk.observations;
    rows.resize(std::min(max_rows, kDefaultChunkRows));
    std::size_t done = 0;
    try {
      for (; done < rows.size() && fill(); ++done) set_row(rows, done, ahead_[taken_++]);
    } catch (const FileError& error) {
      pending_.emplace(error);
      // Points after an invalid one are not used.
      ahead_.clear();
      taken_ = 0;
    }
    rows.resize(done);
    if (done == 0 && pending_) throw FileError(*pending_);
    return done > 0;
  }

  double fraction_read() const override { return source_->fraction_read(); }

 private:
  /// As in risley's own clouds: manufacturer and model, then the serial number.
  Device device() const {
    Device device;
    device.type = kUnknownDeviceType;
    for (const std::uint8_t type : std::array<std::uint8_t, 5>{1, 2, 3, 6, 7}) {
      const std::string name = device_type_name(type);
      if (!file_.system_identifier.starts_with(name)) continue;
      const std::string rest = file_.system_identifier.substr(name.size());
      if (!rest.empty() && !rest.starts_with(' ')) continue;
      device.type = type;
      if (file_.generating_software.starts_with("risley") && !rest.empty()) {
        device.serial = rest.substr(1);
      }
    }
    return device;
  }

  void look_ahead() {
    ahead_.resize(kPointsLookedAt);
    std::size_t count = 0;
    try {
      while (count < ahead_.size()) {
        const std::size_t more = source_->read(std::span(ahead_).subspan(count));
        if (more == 0) break;
        count += more;
      }
    } catch (const FileError& error) {
      pending_.emplace(error);
    }
    ahead_.resize(count);
  }

  /// Makes sure that there is a next point. @return false at the end @throws FileError
  bool fill() {
    if (taken_ < ahead_.size()) return true;
    if (pending_) throw FileError(*pending_);
    ahead_.resize(kPointsLookedAt);
    taken_ = 0;
    try {
      ahead_.resize(source_->read(ahead_));
    } catch (...) {
      ahead_.clear();
      throw;
    }
    return !ahead_.empty();
  }

  Vector3<double> position(const Point& point) const {
    const auto coordinate = [&](std::size_t axis) {
      return point.steps[axis] * file_.scale[axis] + file_.offset[axis];
    };
    const Vector3<double> position{coordinate(0), coordinate(1), coordinate(2)};
    // An offset that is not a multiple of the scale must not turn a null point into a direction.
    const bool null = std::abs(position.x) < 0.5 * file_.scale[0] &&
                      std::abs(position.y) < 0.5 * file_.scale[1] &&
                      std::abs(position.z) < 0.5 * file_.scale[2];
    return null ? Vector3<double>{} : position;
  }

  void learn_step() {
    std::array<double, 3> steps{};
    std::vector<std::int64_t> counts(ahead_.size());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::transform(ahead_.begin(), ahead_.end(), counts.begin(),
                     [axis](const Point& point) { return point.steps[axis]; });
      steps[axis] = file_.scale[axis] * static_cast<double>(common_power_of_ten(counts));
    }
    const auto [least, most] = std::minmax_element(steps.begin(), steps.end());
    step_ = *most;
    // Equal except for the rounding of decimal fractions.
    if (*most <= *least * (1 + 1e-9)) return;
    warn(kWarning.values_changed,
         "coordinates are multiples of {:g}, {:g} and {:g} m in x, y and z; {:g} m is used for all "
         "three",
         steps[0], steps[1], steps[2], step_);
  }

  /// Decides what GPS times are.
  void learn_times() {
    const bool adjusted = (file_.global_encoding & kAdjustedGpsTime) != 0;
    if (!gps_time_at(file_.point_format)) {
      header_.has_times = false;
      warn(kWarning.no_shot_times,
           "points of format {} have no times; they are taken to be in the order of firing",
           file_.point_format);
      return;
    }
    std::size_t shots = 0, times = 0;
    double first = 0, last = 0;
    for (std::size_t i = 0; i < ahead_.size(); ++i) {
      const double time = ahead_[i].gps_time;
      if (i > 0 && is_further_return(ahead_[i], ahead_[i - 1])) continue;
      ++shots;
      if (times == 0 || time != last) ++times;
      if (i == 0) first = time;
      last = time;
    }
    if ((times == 1 && shots > 1) || (times > 0 && shots / times >= kShotsOfOneTime)) {
      header_.has_times = false;
      header_.all_times_equal = times == 1;
      warn(kWarning.no_shot_times,
           "GPS times are not those of single shots: {} of the first {} shots {}; points are taken "
           "to be in the order of firing",
           times == 1 ? "all" : fmt::format("{} on average", shots / times), shots,
           times == 1 ? fmt::format("have {} s", first) : "share one");
      return;
    }
    if (times_fit(adjusted) && adjusted) header_.time_reference = TimeReference::utc;
  }

  /// Whether the times of the first points can be as stated in the header; suggests what they may
  /// be instead. Invalid times are kept unchanged, without an origin.
  bool times_fit(bool adjusted) {
    constexpr double kWeek = 604'800, kOther = 1e9;  // s
    const auto [first, last] =
        std::minmax_element(ahead_.begin(), ahead_.end(),
                            [](const Point& a, const Point& b) { return a.gps_time < b.gps_time; });
    if (first == ahead_.end()) return true;
    const double low = first->gps_time, high = last->gps_time;
    constexpr double kUnix = 1.55e9;  // GPS time reaches this in 2029
    const char* const counted_since = low >= kUnix ? "Unix time" : "GPS time that is not adjusted";
    std::string found;
    if (adjusted && low >= 0 && high <= kWeek) {
      found =
          "the header says that times are adjusted GPS time, which would be of September 2011; "
          "they look like seconds of the GPS week: clear bit 0 of the global encoding";
    } else if (adjusted && low >= kOther) {
      found = fmt::format(
          "the header says that times are adjusted GPS time, which would be of 2043 or later; they "
          "look like {}: subtract 1e9 s from GPS time, and write it so",
          counted_since);
    } else if (!adjusted && low > kWeek) {
      found = fmt::format(
          "the header says that times are seconds of the GPS week, of which there are 604800; they "
          "look like {}",
          low < kOther ? "adjusted GPS time: set bit 0 of the global encoding"
                       : fmt::format("{}: subtract 1e9 s from GPS time, and set bit 0 of the "
                                     "global encoding",
                                     counted_since));
    }
    if (found.empty()) return true;
    warn(kWarning.clock_unknown,
         "GPS times of {:.3f} to {:.3f} s do not fit the header: {}. They are read unchanged, "
         "without an origin",
         low, high, found);
    return false;
  }

  void learn_intensity() {
    unsigned greatest = 0;
    bool all_256 = true, all_257 = true;
    for (const Point& point : ahead_) {
      greatest = std::max<unsigned>(greatest, point.intensity);
      all_256 = all_256 && point.intensity % kIntensityFactor == 0;
      all_257 = all_257 && point.intensity % (kIntensityFactor + 1) == 0;
    }
    header_.has_intensity = greatest > 0;
    if (greatest <= UINT8_MAX) return;
    // 65535 / 255 is 257.
    intensity_divisor_ = all_257 && !all_256 ? kIntensityFactor + 1 : kIntensityFactor;
  }

  void set_row(Observations& rows, std::size_t row, const Point& point) {
    const bool further = row_ > 0 && is_further_return(point, last_);
    rows.time_ns[row] = header_.has_times ? time_ns(point) : next_shot_ - (further ? 1 : 0);
    if (!further) ++next_shot_;
    set_cartesian(rows, row, position(point), step_);
    rows.intensity[row] = intensity(point);
    rows.return_number[row] = std::max<std::uint8_t>(point.return_number, 1);
    rows.tag[row] = point.tag;
    rows.beam[row] = point.beam;
    rows.device[row] = 0;
    last_ = point;
    ++row_;
  }

  std::int64_t time_ns(const Point& point) const {
    const bool utc = header_.time_reference == TimeReference::utc;
    const auto time =
        utc ? utc_of_adjusted_gps(point.gps_time) : io::nanoseconds_from_seconds(point.gps_time);
    if (time) return *time;
    throw FileError(path_, source_->gps_time_place(row_),
                    fmt::format("expected a GPS time of point {} within +-{:g} s, found {}",
                                row_ + 1, utc ? 7e9 : 9.2e9, point.gps_time));
  }

  std::uint8_t intensity(const Point& point) {
    const unsigned value = point.intensity / intensity_divisor_;
    if (value <= UINT8_MAX) return static_cast<std::uint8_t>(value);
    if (!intensity_reported_) {
      intensity_reported_ = true;
      warn(kWarning.values_changed,
           "the intensity of point {} is {}, but none of the first {} points has more than 255; "
           "higher intensities are read as 255",
           row_ + 1, point.intensity, kPointsLookedAt);
    }
    return UINT8_MAX;
  }

  std::string path_;
  PublicHeader file_;
  std::unique_ptr<PointSource> source_;
  std::vector<Point> ahead_;  ///< read but not all returned yet
  std::size_t taken_ = 0;     ///< of these
  std::optional<FileError> pending_;
  double step_ = 0;  ///< m
  unsigned intensity_divisor_ = 1;
  bool intensity_reported_ = false;
  Point last_;
  std::uint64_t row_ = 0;
  std::int64_t next_shot_ = 0;
};

bool is_las(std::string_view head) { return head.starts_with("LASF"); }

bool is_compressed(std::string_view head) {
  return head.size() > kPointFormatAt &&
         (static_cast<unsigned char>(head[kPointFormatAt]) & kCompressionMark) != 0;
}

}  // namespace

}  // namespace las

const Format kLasFormat = {
    "las",
    "",
    "LAS 1.0 to 1.4: points in the frame of the sensor (read only)",
    [](std::string_view head) { return las::is_las(head) && !las::is_compressed(head); },
    [](const io::InputFile& file, const Progress&) -> std::unique_ptr<Reader> {
      return std::make_unique<las::LasReader>(file, "las");
    },
};

const Format kLazFormat = {
    "laz",
    "",
    "LAS compressed by LASzip: points in the frame of the sensor (read only)",
    [](std::string_view head) { return las::is_las(head) && las::is_compressed(head); },
    [](const io::InputFile& file, const Progress&) -> std::unique_ptr<Reader> {
      return std::make_unique<las::LasReader>(file, "laz");
    },
};

}  // namespace risley::recordings
