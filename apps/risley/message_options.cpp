// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "message_options.hpp"

#include <fmt/format.h>

#include "risley/core/setting.hpp"

namespace risley::app {

void add_topic_options(CLI::App& verb, bags::LidarTopicOptions& options, const std::string& topic,
                       const std::string& where) {
  verb.add_option("--topic", options.topic,
                  fmt::format("Topic of the points {} (default: {})", where, topic))
      ->type_name("NAME");
  verb.add_option("--frame-id", options.frame_id, fmt::format("Frame of the points {}", where))
      ->type_name("NAME")
      ->capture_default_str();
  verb.add_option("--frame-rate-hz", options.frame_rate,
                  fmt::format("Messages of points per second {}, Hz", where))
      ->capture_default_str();
}

void add_message_options(CLI::App& verb, MessageWishes& wishes, const std::string& usual) {
  add_topic_options(verb, wishes.options, usual == "points" ? "/risley/points" : "/livox/lidar",
                    "in bags");
  verb.add_option(
          "--message", wishes.message,
          fmt::format("Messages of points in bags: 'points', PointCloud2 with the fields of "
                      "livox_ros_driver2; 'custom', CustomMsg of the driver of the sensor's "
                      "generation; 'custom2', of livox_ros_driver2 (default: {})",
                      usual))
      ->check(CLI::IsMember({"points", "custom", "custom2"}));
}

bags::LidarTopicOptions message_options(const MessageWishes& wishes) {
  bags::LidarTopicOptions options = wishes.options;
  require_between(kSetting.frame_rate, options.frame_rate, bags::kSlowestFrames,
                  bags::kFastestFrames);
  if (wishes.message == "points") options.message = bags::WrittenMessage::cloud;
  if (wishes.message == "custom") options.message = bags::WrittenMessage::custom_driver;
  if (wishes.message == "custom2") options.message = bags::WrittenMessage::custom_driver2;
  return options;
}

}  // namespace risley::app
