// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The messages of lidars: sensor_msgs PointCloud2 and Imu, and the CustomMsg of Livox's drivers.
// Each is described once, as a list of its fields with their names; decoders, encoders and the
// definitions that bags carry for other programs all go through that list.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "risley/bags/bag.hpp"
#include "risley/bags/message_fields.hpp"

namespace risley::bags {

/// What PointField::datatype says.
inline constexpr std::uint8_t kUint8Field = 2,  ///< unsigned, of 8 bits
    kUint32Field = 6,                           ///< unsigned, of 32 bits
    kFloat32Field = 7,                          ///< of 32 bits
    kFloat64Field = 8;                          ///< of 64 bits

/// A field of the points of a cloud.
struct PointFieldEntry {
  static constexpr std::string_view kType = "sensor_msgs/PointField";  ///< as ROS 1 calls it
  /// Constants of its definition.
  static constexpr std::string_view kConstants =
      "uint8 INT8=1\nuint8 UINT8=2\nuint8 INT16=3\nuint8 UINT16=4\n"
      "uint8 INT32=5\nuint8 UINT32=6\nuint8 FLOAT32=7\nuint8 FLOAT64=8\n";
  static constexpr std::size_t kLeastBytes = 13;  ///< in a message, without a name

  std::string name;
  std::uint32_t offset = 0;  ///< from the start of a point
  std::uint8_t datatype = 0;
  std::uint32_t count = 1;

  /// Calls io(name, field) for each field in turn.
  template <class Self, class Io>
  static void describe(Self& self, Io& io) {
    io("name", self.name);
    io("offset", self.offset);
    io("datatype", self.datatype);
    io("count", self.count);
  }
};

/// sensor_msgs PointCloud2.
struct PointCloud2 {
  static constexpr std::string_view kType = "sensor_msgs/PointCloud2";  ///< as ROS 1 calls it

  Header header;
  std::uint32_t height = 0, width = 0;
  std::vector<PointFieldEntry> fields;
  bool big_endian = false;
  std::uint32_t point_step = 0, row_step = 0;  ///< bytes
  std::span<const std::uint8_t> data;          ///< not owned
  bool is_dense = true;

  /// Calls io(name, field) for each field in turn.
  template <class Self, class Io>
  static void describe(Self& self, Io& io) {
    io("header", self.header);
    io("height", self.height);
    io("width", self.width);
    io("fields", self.fields);
    io("is_bigendian", self.big_endian);
    io("point_step", self.point_step);
    io("row_step", self.row_step);
    io("data", self.data);
    io("is_dense", self.is_dense);
  }
};

/// One point of a CustomMsg.
struct CustomPoint {
  static constexpr std::string_view kType = "CustomPoint";  ///< of its message's package
  static constexpr std::size_t kBytes = 19;                 ///< without padding

  std::uint32_t offset_time = 0;  ///< after the time base, ns
  float x = 0, y = 0, z = 0;      ///< m
  std::uint8_t reflectivity = 0, tag = 0, line = 0;

  /// Calls io(name, field) for each field in turn.
  template <class Self, class Io>
  static void describe(Self& self, Io& io) {
    io("offset_time", self.offset_time);
    io("x", self.x);
    io("y", self.y);
    io("z", self.z);
    io("reflectivity", self.reflectivity);
    io("tag", self.tag);
    io("line", self.line);
  }
};

/// The points of a CustomMsg in place: at equal distances.
struct CustomPoints {
  std::span<const std::uint8_t> bytes;  ///< from the first point to the end of the last
  std::size_t count = 0, stride = CustomPoint::kBytes;
  bool big_endian = false;

  CustomPoint operator[](std::size_t index) const;
};

/// CustomMsg, alike in all drivers.
struct CustomMessage {
  static constexpr std::string_view kType = "CustomMsg";  ///< as ROS 1 calls it

  Header header;
  std::uint64_t timebase = 0;  ///< ns
  std::uint32_t point_num = 0;
  std::uint8_t lidar_id = 0;
  std::array<std::uint8_t, 3> reserved{};
  CustomPoints points;

  /// Calls io(name, field) for each field in turn.
  template <class Self, class Io>
  static void describe(Self& self, Io& io) {
    io("header", self.header);
    io("timebase", self.timebase);
    io("point_num", self.point_num);
    io("lidar_id", self.lidar_id);
    io("rsvd", self.reserved);
    io("points", self.points);
  }
};

/// geometry_msgs Quaternion.
struct Quaternion {
  static constexpr std::string_view kType = "geometry_msgs/Quaternion";  ///< as ROS 1 calls it
  double x = 0, y = 0, z = 0, w = 0;

  /// Calls io(name, field) for each field in turn.
  template <class Self, class Io>
  static void describe(Self& self, Io& io) {
    io("x", self.x);
    io("y", self.y);
    io("z", self.z);
    io("w", self.w);
  }
};

/// geometry_msgs Vector3.
struct MessageVector {
  static constexpr std::string_view kType = "geometry_msgs/Vector3";  ///< as ROS 1 calls it
  double x = 0, y = 0, z = 0;

  /// Calls io(name, field) for each field in turn.
  template <class Self, class Io>
  static void describe(Self& self, Io& io) {
    io("x", self.x);
    io("y", self.y);
    io("z", self.z);
  }
};

/// sensor_msgs Imu.
struct ImuMessage {
  static constexpr std::string_view kType = "sensor_msgs/Imu";  ///< as ROS 1 calls it

  Header header;
  Quaternion orientation;
  std::array<double, 9> orientation_covariance{-1};  ///< which means that the message has no
                                                     ///< orientation
  MessageVector angular_velocity;                    ///< rad/s
  std::array<double, 9> angular_velocity_covariance{};
  MessageVector linear_acceleration;  ///< g from Livox's drivers, m/s^2 from others
  std::array<double, 9> linear_acceleration_covariance{};

  /// Calls io(name, field) for each field in turn.
  template <class Self, class Io>
  static void describe(Self& self, Io& io) {
    io("header", self.header);
    io("orientation", self.orientation);
    io("orientation_covariance", self.orientation_covariance);
    io("angular_velocity", self.angular_velocity);
    io("angular_velocity_covariance", self.angular_velocity_covariance);
    io("linear_acceleration", self.linear_acceleration);
    io("linear_acceleration_covariance", self.linear_acceleration_covariance);
  }
};

/// Decodes a PointCloud2, CustomMessage or ImuMessage; spans in it are of the given bytes.
/// @throws BadMessage when the bytes contradict the message's type
template <class Message>
void decode(Serialisation serialisation, std::span<const std::uint8_t> bytes, Message& message);

/// Encodes such a message into `bytes`, replacing its contents. The points of a CustomMsg must be
/// laid out as in Serialisation::ros1, and the stamps must fit their numbers.
template <class Message>
void encode(Serialisation serialisation, const Message& message, std::vector<std::uint8_t>& bytes);

/// The messages that are written here.
enum class WrittenMessage : std::uint8_t {
  cloud,           ///< PointCloud2
  custom_driver,   ///< CustomMsg of livox_ros_driver, in ROS 2 of livox_ros2_driver
  custom_driver2,  ///< CustomMsg of livox_ros_driver2
  imu,             ///< Imu
};

/// The CustomMsg of the driver for a sensor's generation; other messages are unchanged.
WrittenMessage of_generation(WrittenMessage message, bool second);

/// A topic of such messages, with the definition for other programs.
Topic topic_of(std::string name, WrittenMessage message, Serialisation serialisation);

/// Number of points of a cloud. @throws BadMessage when its numbers contradict each other or the
/// data
std::size_t count_points(const PointCloud2& cloud);

/// Location of the coordinates in the bytes of a message.
struct PointPlaces {
  std::size_t count = 0;
  std::size_t first = 0;                       ///< byte of the first point
  std::size_t stride = 0, row_stride = 0;      ///< bytes from one to the next, in a row and between
  std::size_t row_points = 0;                  ///< points of a row
  std::array<std::size_t, 3> coordinate{};     ///< bytes of x, y and z from the start of a point
  bool is_double = false, big_endian = false;  ///< how each is stored
  std::uint8_t lidar_id = 0;                   ///< of a CustomMsg

  /// Byte at which a point starts.
  std::size_t place(std::size_t point) const {
    return first + point / row_points * row_stride + point % row_points * stride;
  }
};

/// The points of a CustomMsg or of a PointCloud2. @throws BadMessage when their coordinates are not
/// floating-point numbers of one type, or not within the bytes
PointPlaces point_places(MessageKind kind, Serialisation serialisation,
                         std::span<const std::uint8_t> bytes);

/// Overwrites the coordinates of a point, m.
void store_point(const PointPlaces& places, std::size_t point, const std::array<double, 3>& xyz,
                 std::span<std::uint8_t> bytes);
/// The coordinates of a point as stored, m.
std::array<double, 3> load_point(const PointPlaces& places, std::size_t point,
                                 std::span<const std::uint8_t> bytes);

}  // namespace risley::bags
