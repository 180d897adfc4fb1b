// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "risley/bags/bag.hpp"
#include "risley/bags/bag_writer.hpp"

namespace risley::bags {

inline constexpr std::string_view kRos1Signature = "#ROSBAG V2.0";
inline constexpr std::string_view kMcapSignature = "\x89MCAP";  ///< the version follows
inline constexpr const char* kMetadata = "metadata.yaml";       ///< of a folder of ROS 2

/// A type whose messages are known.
struct KnownType {
  MessageKind kind;
  std::string_view ros1_name, md5, ros2_name;
};
/// A CustomMsg, which is in different packages in different drivers, has no names here.
inline constexpr std::array kKnownTypes{
    KnownType{MessageKind::points, "", "e4d6829bdfe657cb6c21a746c86b21a6", ""},
    KnownType{MessageKind::cloud, "sensor_msgs/PointCloud2", "1158d486dd51d683ce2f1be655c3c181",
              "sensor_msgs/msg/PointCloud2"},
    KnownType{MessageKind::imu, "sensor_msgs/Imu", "6a62c6daae103f4ff57a132d6f95cec2",
              "sensor_msgs/msg/Imu"},
    KnownType{MessageKind::odometry, "nav_msgs/Odometry", "cd5e73d190d741a2f92e81eda573aca7",
              "nav_msgs/msg/Odometry"},
    KnownType{MessageKind::pose, "geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5",
              "geometry_msgs/msg/PoseStamped"},
    KnownType{MessageKind::pose_with_covariance, "geometry_msgs/PoseWithCovarianceStamped",
              "953b798c0f514ff060a53a3498ce6246", "geometry_msgs/msg/PoseWithCovarianceStamped"},
    KnownType{MessageKind::transform, "geometry_msgs/TransformStamped",
              "b5764a33bfeb3588febc2682852579b0", "geometry_msgs/msg/TransformStamped"},
};

/// The kind of messages of a type of ROS 2.
std::optional<MessageKind> ros2_kind(std::string_view type);
/// A topic of ROS 1, where the md5 sum matters if the name alone would match.
/// @param md5  empty if it is not known: then the name decides
Topic ros1_topic(const std::string& name, const std::string& type, const std::string& md5);

std::unique_ptr<Bag> open_ros1_bag(const io::InputFile& file,
                                   const Progress& progress);    // ros1_bag.cpp
std::vector<Topic> list_ros1_topics(const io::InputFile& file);  // ros1_bag.cpp
std::unique_ptr<Bag> open_ros2_bag(const std::string& path,
                                   const Progress& progress);  // ros2_bag.cpp
std::unique_ptr<Bag> open_mcap_bag(const io::InputFile& file,
                                   const Progress& progress);  // mcap_bag.cpp
/// A folder of bags of one kind, as returned by files_of_bag_folder().
std::unique_ptr<Bag> open_bag_folder(const std::string& folder,
                                     const Progress& progress);       // bag_folder.cpp
std::unique_ptr<BagWriter> create_ros1_bag(const std::string& path);  // ros1_writer.cpp
std::unique_ptr<BagWriter> create_ros2_bag(const std::string& path);  // ros2_writer.cpp
std::unique_ptr<BagWriter> create_mcap_bag(const std::string& path);  // mcap_writer.cpp
/// The kind of a bag; nothing if it is not one.
std::optional<BagKind> bag_kind_of(const io::InputFile& file);  // bag.cpp

}  // namespace risley::bags
