// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/ros2_message.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>
#include <fastcdr/exceptions/Exception.h>
#include <fmt/format.h>
#if __has_include(<fastcdr/config.h>)
#include <fastcdr/config.h>
#endif

namespace risley::recordings {
namespace {

/// A message in CDR, read from the front. The two major versions of Fast-CDR differ in names.
class CdrMessage {
 public:
  /// @throws BadMessage, or an exception of Fast-CDR as all its functions do
  explicit CdrMessage(std::span<const std::uint8_t> bytes)
      : bytes_(bytes),
        // Reading changes nothing, but the buffer is of bytes that could be written.
        buffer_(reinterpret_cast<char*>(const_cast<std::uint8_t*>(bytes.data())), bytes.size()),
#if defined(FASTCDR_VERSION_MAJOR) && FASTCDR_VERSION_MAJOR >= 2
        cdr_(buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN,
             eprosima::fastcdr::CdrVersion::DDS_CDR)
#else
        cdr_(buffer_, eprosima::fastcdr::Cdr::DEFAULT_ENDIAN, eprosima::fastcdr::Cdr::DDS_CDR)
#endif
  {
    constexpr std::size_t kEncapsulationBytes = 4;
    // Plain CDR, big- or little-endian.
    if (bytes.size() < kEncapsulationBytes || bytes[0] != 0 || bytes[1] > 1) {
      throw BadMessage{
          "expected a message that begins with 00 00 or 00 01, the marks of plain CDR"};
    }
    cdr_.read_encapsulation();
  }

  template <class T>
  T number() {
    T value{};
    cdr_ >> value;
    return value;
  }

  std::string text() {
    std::string value;
    cdr_ >> value;
    return value;
  }

  std::size_t left() const {
#if defined(FASTCDR_VERSION_MAJOR) && FASTCDR_VERSION_MAJOR >= 2
    return bytes_.size() - cdr_.get_serialized_data_length();
#else
    return bytes_.size() - cdr_.getSerializedDataLength();
#endif
  }

  /// Length of a sequence whose elements have at least so many bytes.
  std::uint32_t length(std::string_view what, std::size_t bytes_each) {
    const auto count = number<std::uint32_t>();
    require_room(what, count, bytes_each, left());
    return count;
  }

  std::span<const std::uint8_t> byte_sequence(std::string_view what) {
    const std::size_t count = length(what, 1);
    const auto bytes = bytes_.subspan(bytes_.size() - left(), count);
    cdr_.jump(count);
    return bytes;
  }

  void skip_doubles(int count) {
    for (int i = 0; i < count; ++i) number<double>();
  }

 private:
  std::span<const std::uint8_t> bytes_;
  eprosima::fastcdr::FastBuffer buffer_;
  eprosima::fastcdr::Cdr cdr_;
};

/// std_msgs/msg/Header: its stamp, not yet checked.
struct Ros2Stamp {
  std::int32_t seconds = 0;
  std::uint32_t nanoseconds = 0;
};

Ros2Stamp take_header(CdrMessage& cdr) {
  Ros2Stamp stamp;
  stamp.seconds = cdr.number<std::int32_t>();
  stamp.nanoseconds = cdr.number<std::uint32_t>();
  cdr.text();
  return stamp;
}

void decode_points(CdrMessage& cdr, BagMessage& message) {
  take_header(cdr);
  message.time_ns = message_time(cdr.number<std::uint64_t>());
  cdr.number<std::uint32_t>();  // number of points, also in front of them
  for (int i = 0; i < 4; ++i) cdr.number<std::uint8_t>();  // lidar number and reserve
  const std::uint32_t count = cdr.length("points", kCustomPointBytes);
  message.points.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    MessagePoint point;
    point.offset_ns = cdr.number<std::uint32_t>();
    point.x = cdr.number<float>();
    point.y = cdr.number<float>();
    point.z = cdr.number<float>();
    point.intensity = cdr.number<std::uint8_t>();
    point.tag = cdr.number<std::uint8_t>();
    point.line = cdr.number<std::uint8_t>();
    append_point(message, point);
  }
}

void decode_cloud_message(CdrMessage& cdr, BagMessage& message) {
  const Ros2Stamp stamp = take_header(cdr);
  message.time_ns = message_time(std::int64_t{stamp.seconds}, stamp.nanoseconds);
  CloudLayout layout;
  layout.height = cdr.number<std::uint32_t>();
  layout.width = cdr.number<std::uint32_t>();
  constexpr std::size_t kShortestField = 14;
  const std::uint32_t fields = cdr.length("fields", kShortestField);
  for (std::uint32_t i = 0; i < fields; ++i) {
    CloudLayout::Field field;
    field.name = cdr.text();
    field.offset = cdr.number<std::uint32_t>();
    field.datatype = cdr.number<std::uint8_t>();
    field.count = cdr.number<std::uint32_t>();
    layout.fields.push_back(std::move(field));
  }
  layout.big_endian = cdr.number<std::uint8_t>() != 0;
  layout.point_step = cdr.number<std::uint32_t>();
  layout.row_step = cdr.number<std::uint32_t>();
  decode_cloud(layout, cdr.byte_sequence("values of data"), message);
}

void decode_imu_message(CdrMessage& cdr, BagMessage& message) {
  constexpr int kOrientation = 13, kCovariance = 9;
  const Ros2Stamp stamp = take_header(cdr);
  message.time_ns = message_time(std::int64_t{stamp.seconds}, stamp.nanoseconds);
  cdr.skip_doubles(kOrientation);
  for (double& value : message.angular_velocity) value = cdr.number<double>();
  cdr.skip_doubles(kCovariance);
  for (double& value : message.acceleration) value = cdr.number<double>();
}

}  // namespace

void decode_ros2_message(MessageKind kind, std::span<const std::uint8_t> bytes,
                         BagMessage& message) {
  message.points.clear();
  message.has_intensity = true;
  try {
    CdrMessage cdr(bytes);
    switch (kind) {
      case MessageKind::points:
        return decode_points(cdr, message);
      case MessageKind::cloud:
        return decode_cloud_message(cdr, message);
      case MessageKind::imu:
        return decode_imu_message(cdr, message);
    }
  } catch (const eprosima::fastcdr::exception::Exception& error) {
    throw BadMessage{
        fmt::format("expected more than its {} bytes of CDR ({})", bytes.size(), error.what())};
  }
}

}  // namespace risley::recordings
