// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The points of a sensor_msgs PointCloud2 and their times. No standard defines the times of single
// points in a cloud; drivers use a field `time`, `t`, `timestamp` or `offset_time`:
//
// - 32-bit integers are nanoseconds after the message's stamp; - 32-bit floats are seconds after
// the stamp; - 64-bit floats are seconds after the stamp, or seconds or nanoseconds since the
// stamp's origin: whichever is closest to the stamps of the first messages.
//
// No time is further than ten seconds from its message's stamp. Of several fields the one with the
// finest step is used, of equal ones the first of the list above. A time shared by 32 or more
// points is that of their packet or frame and is not used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "risley/bags/messages.hpp"

namespace risley::recordings {

using bags::PointCloud2;

/// Calls visit(bytes) for each point of a cloud accepted by count_points().
template <class Visit>
void for_each_point(const PointCloud2& cloud, Visit&& visit) {
  if (cloud.width == 0) return;
  for (std::size_t row = 0; row < cloud.height; ++row) {
    const std::uint8_t* bytes = cloud.data.data() + row * cloud.row_step;
    for (std::size_t column = 0; column < cloud.width; ++column, bytes += cloud.point_step) {
      visit(bytes);
    }
  }
}

/// A field of a cloud's points to read; empty if a cloud has none.
struct CloudField {
  std::size_t offset = 0;
  std::uint8_t datatype = 0;
  double (*value)(const std::uint8_t* bytes) = nullptr;

  explicit operator bool() const { return value != nullptr; }
  double operator()(const std::uint8_t* point) const { return value(point + offset); }
  /// The nearest whole number of a byte; 0 if the field is missing or holds no number.
  std::uint8_t byte(const std::uint8_t* point) const;
};

/// The first field of one of these names, in any case. @throws BadMessage when it does not fit
CloudField find_field(const PointCloud2& cloud, std::initializer_list<std::string_view> names);
/// @throws BadMessage also when there is none
CloudField required_field(const PointCloud2& cloud, std::string_view name);

/// Meaning of the numbers in a field of times.
enum class TimeReading : std::uint8_t { nanoseconds_after, seconds_after, seconds, nanoseconds };

/// The field of a topic's clouds with the times of their points.
struct CloudTime {
  std::string field;
  std::uint8_t datatype = 0;
  TimeReading reading = TimeReading::nanoseconds_after;
  double step_ns = 1;  ///< between two numbers, at least 1
};

/// From a stamp to a point's time, ns; nothing beyond ten seconds, or if it is not a number.
std::optional<std::int64_t> offset_of(TimeReading reading, double value, std::int64_t stamp_ns);

/// Calls visit(offset_ns) for each point of a cloud accepted by count_points(): its time after the
/// stamp. @throws BadMessage for clouds without the field and times that are too far
template <class Visit>
void for_each_time(const CloudTime& time, const PointCloud2& cloud, std::int64_t stamp_ns,
                   Visit&& visit);

/// Finds the field of times of a topic from its first messages.
class CloudTimeSearch {
 public:
  /// A message, which count_points() took. @param stamp_ns  of its header
  void add(const PointCloud2& cloud, std::int64_t stamp_ns);
  std::optional<CloudTime> found() const;
  /// Reason why a field is not used, in words; empty if it is used.
  std::string problem() const;

 private:
  struct Candidate {
    CloudTime time;
    std::size_t messages = 0, points = 0, times = 0;
    double largest = 0;                     ///< number
    std::optional<std::int64_t> far_ns{0};  ///< from its stamp; nothing if one is too far
  };
  void add(const CloudField& field, const PointCloud2& cloud, std::int64_t stamp_ns,
           Candidate& candidate) const;
  bool shares_times(const Candidate& candidate) const;

  std::vector<Candidate> candidates_;  ///< in the order of the names
  std::string other_type_;             ///< a field whose datatype cannot be a time
  std::size_t messages_ = 0;           ///< with points
};

[[noreturn]] void fail_time(const CloudTime& time, std::size_t point, double value);
/// The field of a cloud. @throws BadMessage when it is not there, or of another datatype
CloudField time_field(const CloudTime& time, const PointCloud2& cloud);

template <class Visit>
void for_each_time(const CloudTime& time, const PointCloud2& cloud, std::int64_t stamp_ns,
                   Visit&& visit) {
  if (cloud.width == 0 || cloud.height == 0) return;
  const CloudField field = time_field(time, cloud);
  std::size_t point = 0;
  for_each_point(cloud, [&](const std::uint8_t* bytes) {
    ++point;
    const double value = field(bytes);
    const auto offset_ns = offset_of(time.reading, value, stamp_ns);
    if (!offset_ns) fail_time(time, point, value);
    visit(*offset_ns);
  });
}

}  // namespace risley::recordings
