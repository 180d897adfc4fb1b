// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The points of a sensor_msgs PointCloud2 and their times. No standard says how a cloud tells times
// of single points; drivers have a field `time`, `t`, `timestamp` or `offset_time` for that:
//
// - 32-bit integers are nanoseconds after the message's stamp;
// - 32-bit floats are seconds after the stamp;
// - 64-bit floats are seconds after the stamp, or seconds or nanoseconds since the origin that the
//   stamp has, too: what brings them closest to the stamps of the first messages.
//
// No time is further than ten seconds from its message's stamp. Of several fields the one with the
// finest step counts, of equal ones the first of the list above. A time that 32 points and more
// share is that of their packet or frame and is not used.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace risley::recordings {

/// A PointCloud2 up to its points.
struct CloudLayout {
  struct Field {
    std::string name;
    std::uint32_t offset = 0;  ///< from the start of a point
    std::uint8_t datatype = 0;
    std::uint32_t count = 1;
  };
  std::uint32_t height = 0, width = 0, point_step = 0, row_step = 0;
  bool big_endian = false;
  std::vector<Field> fields;
};

/// Number of points. @throws BadMessage when the layout does not fit itself or the data
std::size_t count_points(const CloudLayout& layout, std::span<const std::uint8_t> data);

/// Calls visit(bytes) for each point of a cloud that count_points() took.
template <class Visit>
void for_each_point(const CloudLayout& layout, std::span<const std::uint8_t> data, Visit&& visit) {
  if (layout.width == 0) return;
  for (std::size_t row = 0; row < layout.height; ++row) {
    const std::uint8_t* bytes = data.data() + row * layout.row_step;
    for (std::size_t column = 0; column < layout.width; ++column, bytes += layout.point_step) {
      visit(bytes);
    }
  }
}

/// A field of a cloud's points that is read; empty where a cloud has none.
struct CloudField {
  std::size_t offset = 0;
  std::uint8_t datatype = 0;
  double (*value)(const std::uint8_t* bytes) = nullptr;

  explicit operator bool() const { return value != nullptr; }
  double operator()(const std::uint8_t* point) const { return value(point + offset); }
  /// The nearest whole number of a byte; 0 where the field is missing or holds no number.
  std::uint8_t byte(const std::uint8_t* point) const;
};

/// The first field of one of these names, in any case. @throws BadMessage when it does not fit
CloudField find_field(const CloudLayout& layout, std::initializer_list<std::string_view> names);
/// @throws BadMessage also when there is none
CloudField required_field(const CloudLayout& layout, std::string_view name);

/// What the numbers of a field of times are.
enum class TimeReading : std::uint8_t { nanoseconds_after, seconds_after, seconds, nanoseconds };

/// The field by which the clouds of a topic tell the times of their points.
struct CloudTime {
  std::string field;
  std::uint8_t datatype = 0;
  TimeReading reading = TimeReading::nanoseconds_after;
  double step_ns = 1;  ///< between two numbers, at least 1
};

/// From a stamp to a point's time, ns; nothing beyond ten seconds, or where it is no number.
std::optional<std::int64_t> offset_of(TimeReading reading, double value, std::int64_t stamp_ns);

/// Calls visit(offset_ns) for each point of a cloud that count_points() took: its time after the
/// stamp. @throws BadMessage for clouds without the field and times that are too far
template <class Visit>
void for_each_time(const CloudTime& time, const CloudLayout& layout,
                   std::span<const std::uint8_t> data, std::int64_t stamp_ns, Visit&& visit);

/// Finds the field of times of a topic from its first messages.
class CloudTimeSearch {
 public:
  /// A message, which count_points() took. @param stamp_ns  of its header
  void add(const CloudLayout& layout, std::span<const std::uint8_t> data, std::int64_t stamp_ns);
  std::optional<CloudTime> found() const;
  /// Why a field that is there is not used, in words; empty where there is none.
  std::string problem() const;

 private:
  struct Candidate {
    CloudTime time;
    std::size_t messages = 0, points = 0, times = 0;
    double largest = 0;                     ///< number
    std::optional<std::int64_t> far_ns{0};  ///< from its stamp; nothing where one is too far
  };
  void add(const CloudField& field, const CloudLayout& layout, std::span<const std::uint8_t> data,
           std::int64_t stamp_ns, Candidate& candidate) const;
  bool shares_times(const Candidate& candidate) const;

  std::vector<Candidate> candidates_;  ///< in the order of the names
  std::string other_type_;             ///< a field that is no time by its datatype
  std::size_t messages_ = 0;           ///< with points
};

[[noreturn]] void fail_time(const CloudTime& time, std::size_t point, double value);
/// The field of a cloud. @throws BadMessage when it is not there, or of another datatype
CloudField time_field(const CloudTime& time, const CloudLayout& layout);

template <class Visit>
void for_each_time(const CloudTime& time, const CloudLayout& layout,
                   std::span<const std::uint8_t> data, std::int64_t stamp_ns, Visit&& visit) {
  if (layout.width == 0 || layout.height == 0) return;
  const CloudField field = time_field(time, layout);
  std::size_t point = 0;
  for_each_point(layout, data, [&](const std::uint8_t* bytes) {
    ++point;
    const double value = field(bytes);
    const auto offset_ns = offset_of(time.reading, value, stamp_ns);
    if (!offset_ns) fail_time(time, point, value);
    visit(*offset_ns);
  });
}

}  // namespace risley::recordings
