// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/cloud_times.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "risley/bags/bag.hpp"
#include "risley/core/saturating.hpp"
#include "risley/core/text.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/io/seconds.hpp"

#include "recordings/formats/format.hpp"

namespace risley::recordings {
namespace {

using bags::BadMessage;

constexpr std::array<std::string_view, 4> kTimeNames{"time", "t", "timestamp", "offset_time"};
constexpr std::int64_t kFarthest_ns = 10'000'000'000;
constexpr std::uint8_t kInt32 = 5, kUint32 = bags::kUint32Field, kFloat32 = bags::kFloat32Field,
                       kFloat64 = bags::kFloat64Field;

template <class T>
double value_at(const std::uint8_t* bytes) {
  return static_cast<double>(io::load<T>(bytes));
}

template <class T>
double swapped_value_at(const std::uint8_t* bytes) {
  std::array<std::uint8_t, sizeof(T)> swapped;
  std::reverse_copy(bytes, bytes + sizeof(T), swapped.begin());
  return value_at<T>(swapped.data());
}

/// How a datatype of a PointField is read.
struct Datatype {
  std::size_t bytes = 0;  ///< 0 for an unknown one
  double (*value)(const std::uint8_t* bytes) = nullptr;
};

template <class T>
Datatype datatype(bool big_endian) {
  return {sizeof(T), big_endian ? swapped_value_at<T> : value_at<T>};
}

Datatype datatype_of(std::uint8_t code, bool big_endian) {
  switch (code) {
    case 1:
      return datatype<std::int8_t>(big_endian);
    case 2:
      return datatype<std::uint8_t>(big_endian);
    case 3:
      return datatype<std::int16_t>(big_endian);
    case 4:
      return datatype<std::uint16_t>(big_endian);
    case kInt32:
      return datatype<std::int32_t>(big_endian);
    case kUint32:
      return datatype<std::uint32_t>(big_endian);
    case kFloat32:
      return datatype<float>(big_endian);
    case kFloat64:
      return datatype<double>(big_endian);
    default:
      return {};
  }
}

/// Possible meanings of a datatype's numbers as times.
std::vector<TimeReading> readings_of(std::uint8_t datatype) {
  switch (datatype) {
    case kInt32:
    case kUint32:
      return {TimeReading::nanoseconds_after};
    case kFloat32:
      return {TimeReading::seconds_after};
    case kFloat64:
      return {TimeReading::seconds_after, TimeReading::seconds, TimeReading::nanoseconds};
    default:
      return {};
  }
}

/// Width of the step between numbers of that size, ns, at least 1.
double step_of(const CloudTime& time, double largest) {
  const double per_unit =
      time.reading == TimeReading::seconds_after || time.reading == TimeReading::seconds ? 1e9
                                                                                         : 1.0;
  double step = 0;
  if (time.datatype == kFloat32) {
    const auto number = static_cast<float>(largest);
    step = std::nextafter(number, std::numeric_limits<float>::infinity()) - number;
  } else if (time.datatype == kFloat64) {
    step = std::nextafter(largest, std::numeric_limits<double>::infinity()) - largest;
  }
  return std::max(step * per_unit, 1.0);
}

}  // namespace

std::uint8_t CloudField::byte(const std::uint8_t* point) const {
  if (value == nullptr) return 0;
  const double number = (*this)(point);
  if (!(number > 0.0)) return 0;
  return static_cast<std::uint8_t>(std::lround(std::min(number, 255.0)));
}

CloudField find_field(const PointCloud2& cloud, std::initializer_list<std::string_view> names) {
  const auto is_meant = [&](const bags::PointFieldEntry& field) {
    return std::find(names.begin(), names.end(), lower_case(field.name)) != names.end();
  };
  const auto field = std::find_if(cloud.fields.begin(), cloud.fields.end(), is_meant);
  if (field == cloud.fields.end()) return {};
  const Datatype type = datatype_of(field->datatype, cloud.big_endian);
  if (type.bytes == 0) {
    throw BadMessage{fmt::format("expected a datatype in [1, 8] for the field {}, found {}",
                                 field->name, field->datatype)};
  }
  if (std::uint64_t{field->offset} + type.bytes > cloud.point_step) {
    throw BadMessage{fmt::format("the field {} takes bytes {} to {}, but a point has only {} bytes",
                                 field->name, field->offset,
                                 std::uint64_t{field->offset} + type.bytes - 1, cloud.point_step)};
  }
  return {field->offset, field->datatype, type.value};
}

CloudField required_field(const PointCloud2& cloud, std::string_view name) {
  const CloudField field = find_field(cloud, {name});
  if (field) return field;
  std::string names;
  for (const bags::PointFieldEntry& other : cloud.fields) {
    names += (names.empty() ? "" : ", ") + other.name;
  }
  throw BadMessage{fmt::format("expected the fields x, y and z in the point cloud, found {}",
                               names.empty() ? "none" : names)};
}

std::optional<std::int64_t> offset_of(TimeReading reading, double value, std::int64_t stamp_ns) {
  constexpr double kLatest_ns = 9.2e18;
  std::optional<std::int64_t> offset_ns;
  switch (reading) {
    case TimeReading::nanoseconds_after:
    case TimeReading::nanoseconds:
      if (std::abs(value) < kLatest_ns) offset_ns = std::llround(value);
      break;
    case TimeReading::seconds_after:
    case TimeReading::seconds:
      offset_ns = io::nanoseconds_from_seconds(value);
      break;
  }
  if (!offset_ns) return std::nullopt;
  if (reading == TimeReading::seconds || reading == TimeReading::nanoseconds) {
    offset_ns = saturating_difference(*offset_ns, stamp_ns);
  }
  if (*offset_ns < -kFarthest_ns || *offset_ns > kFarthest_ns) return std::nullopt;
  return offset_ns;
}

CloudField time_field(const CloudTime& time, const PointCloud2& cloud) {
  const CloudField field = find_field(cloud, {time.field});
  if (field && field.datatype == time.datatype) return field;
  throw BadMessage{fmt::format(
      "expected the times of the points in the field {} of datatype {}, as in earlier messages, "
      "found {}",
      time.field, time.datatype,
      field ? fmt::format("datatype {}", field.datatype) : std::string("no such field"))};
}

void fail_time(const CloudTime& time, std::size_t point, double value) {
  throw BadMessage{
      fmt::format("point {} has {} = {}, allowed at most {} s from the time stamp of its message",
                  point + 1, time.field, value, kFarthest_ns / 1'000'000'000)};
}

void CloudTimeSearch::add(const PointCloud2& cloud, std::int64_t stamp_ns) {
  if (cloud.width == 0 || cloud.height == 0) return;
  ++messages_;
  for (const std::string_view name : kTimeNames) {
    CloudField field;
    try {
      field = find_field(cloud, {name});
    } catch (const BadMessage& bad) {  // of a field that is not needed
      other_type_ = bad.what();
    }
    if (!field) continue;
    const std::vector<TimeReading> readings = readings_of(field.datatype);
    if (readings.empty()) {
      other_type_ =
          fmt::format("its field {} is of datatype {}, expected 5 to 8", name, field.datatype);
    }
    for (const TimeReading reading : readings) {
      const auto is_same = [&](const Candidate& other) {
        return other.time.field == name && other.time.datatype == field.datatype &&
               other.time.reading == reading;
      };
      auto known = std::find_if(candidates_.begin(), candidates_.end(), is_same);
      if (known == candidates_.end()) {
        if (messages_ > 1) continue;  // messages before it are without
        candidates_.push_back({{std::string(name), field.datatype, reading}});
        known = candidates_.end() - 1;
      }
      add(field, cloud, stamp_ns, *known);
    }
  }
}

void CloudTimeSearch::add(const CloudField& field, const PointCloud2& cloud, std::int64_t stamp_ns,
                          Candidate& candidate) const {
  ++candidate.messages;
  std::optional<double> last;
  for_each_point(cloud, [&](const std::uint8_t* bytes) {
    const double value = field(bytes);
    ++candidate.points;
    if (last != value) ++candidate.times;
    last = value;
    candidate.largest = std::max(candidate.largest, std::abs(value));
    const auto offset_ns = offset_of(candidate.time.reading, value, stamp_ns);
    if (!offset_ns) candidate.far_ns.reset();
    if (candidate.far_ns && offset_ns) {
      candidate.far_ns = std::max(*candidate.far_ns, std::abs(*offset_ns));
    }
  });
}

bool CloudTimeSearch::shares_times(const Candidate& candidate) const {
  return candidate.points >= kShotsOfOneTime * candidate.times;
}

std::optional<CloudTime> CloudTimeSearch::found() const {
  const Candidate* best = nullptr;
  double best_step = 0;
  for (const Candidate& candidate : candidates_) {
    if (candidate.messages < messages_ || !candidate.far_ns || shares_times(candidate)) continue;
    const double step = step_of(candidate.time, candidate.largest);
    const bool better = best == nullptr ||
                        (candidate.time.field == best->time.field ? candidate.far_ns < best->far_ns
                                                                  : step < best_step);
    if (!better) continue;
    best = &candidate;
    best_step = step;
  }
  if (best == nullptr) return std::nullopt;
  CloudTime time = best->time;
  time.step_ns = best_step;
  return time;
}

std::string CloudTimeSearch::problem() const {
  if (candidates_.empty()) return other_type_;
  const Candidate& first = candidates_.front();
  const std::string& field = first.time.field;
  if (first.messages < messages_) return fmt::format("only some messages have a field {}", field);
  if (shares_times(first)) {
    return fmt::format("in their field {}, {} points share one time", field,
                       first.points / first.times);
  }
  return fmt::format("the numbers in their field {} are more than {} s from the time stamps", field,
                     kFarthest_ns / 1'000'000'000);
}

}  // namespace risley::recordings
