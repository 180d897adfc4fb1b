// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Messages of ROS 2 for tests of bags.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bags/written_bags.hpp"
#include "recordings/livox_points.hpp"

namespace risley::recordings::ros2_messages {

using namespace bags::written;
using namespace livox_points;

inline constexpr const char* kCustomType = "livox_ros_driver2/msg/CustomMsg";
inline constexpr const char* kCloudType = "sensor_msgs/msg/PointCloud2";
inline constexpr const char* kImuType = "sensor_msgs/msg/Imu";

inline std::string custom(std::uint64_t timebase, const std::vector<Point>& points,
                          std::int64_t claimed_more = 0, bool big_endian = false) {
  const auto count =
      static_cast<std::uint32_t>(static_cast<std::int64_t>(points.size()) + claimed_more);
  Cdr cdr(big_endian);
  cdr.header(timebase + 137).put<std::uint64_t>(timebase).put<std::uint32_t>(count);
  for (int i = 0; i < 4; ++i) cdr.put<std::uint8_t>(static_cast<std::uint8_t>(i));
  cdr.put<std::uint32_t>(count);
  for (const Point& p : points) {
    cdr.put<std::uint32_t>(p.offset_ns).put<float>(p.x).put<float>(p.y).put<float>(p.z);
    cdr.put<std::uint8_t>(p.intensity).put<std::uint8_t>(p.tag).put<std::uint8_t>(p.line);
  }
  return cdr.bytes();
}

/// As PCL's PointXYZI: with holes between the fields.
inline std::string cloud(std::uint64_t time_ns, std::uint32_t points,
                         std::uint32_t claimed_bytes = 0) {
  constexpr std::uint32_t kStep = 32;
  Cdr cdr;
  cdr.header(time_ns).put<std::uint32_t>(1).put<std::uint32_t>(points);
  const std::vector<Field> fields = {{"x", 0, 7}, {"y", 4, 7}, {"z", 8, 7}, {"intensity", 16, 7}};
  cdr.put<std::uint32_t>(static_cast<std::uint32_t>(fields.size()));
  for (const Field& field : fields) {
    cdr.text(field.name).put<std::uint32_t>(field.offset).put<std::uint8_t>(field.datatype);
    cdr.put<std::uint32_t>(1);
  }
  cdr.put<std::uint8_t>(0).put<std::uint32_t>(kStep).put<std::uint32_t>(kStep * points);
  std::string data;
  for (std::uint32_t i = 0; i < points; ++i) {
    const std::vector<float> values = {3.0F, 4.0F, 0.0F, 9e9F, static_cast<float>(i % 256) + 0.2F,
                                       9e9F, 9e9F, 9e9F};
    data.append(reinterpret_cast<const char*>(values.data()), kStep);
  }
  cdr.put<std::uint32_t>(claimed_bytes != 0 ? claimed_bytes : kStep * points).raw(data);
  return cdr.put<std::uint8_t>(1).bytes();
}

inline std::string imu(std::uint64_t time_ns) {
  Cdr cdr;
  cdr.header(time_ns);
  for (int i = 0; i < 13; ++i) cdr.put<double>(0.0);
  for (const double value : {0.25, -0.5, 0.125}) cdr.put<double>(value);
  for (int i = 0; i < 9; ++i) cdr.put<double>(-1.0);
  for (const double value : {0.0625, -0.03125, 1.0}) cdr.put<double>(value);
  for (int i = 0; i < 9; ++i) cdr.put<double>(-1.0);
  return cdr.bytes();
}

/// Lidar, inertial samples and others, six messages each.
inline Ros2BagFile small_ros2_bag() {
  Ros2BagFile bag;
  const std::size_t lidar = bag.topic(kTopic, kCustomType);
  const std::size_t inertia = bag.topic("/livox/imu", kImuType);
  const std::size_t other = bag.topic("/rosout", "rcl_interfaces/msg/Log");
  for (std::uint64_t i = 0; i < 6; ++i) {
    bag.add(other, "not looked at");
    bag.add(lidar, custom(kPowerOn + i * 200'000, shots(20)));
    bag.add(inertia, imu(kPowerOn + i * 200'000));
  }
  return bag;
}

}  // namespace risley::recordings::ros2_messages
