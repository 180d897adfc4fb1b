// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/bags/lidar_topic.hpp"

#include "command.hpp"

namespace risley::app {

/// Options for writing bags, as typed.
struct MessageWishes {
  bags::LidarTopicOptions options;
  std::string message;  ///< points, custom or custom2; empty: not given
};

/// Declares --topic, --frame-id and --frame-rate-hz.
/// @param topic  used by default
/// @param where  the points are: "in bags"
void add_topic_options(CLI::App& verb, bags::LidarTopicOptions& options, const std::string& topic,
                       const std::string& where);

/// Declares these and --message.
/// @param usual  the verb's default message
void add_message_options(CLI::App& verb, MessageWishes& wishes, const std::string& usual);

/// @throws InvalidArgument naming the option
bags::LidarTopicOptions message_options(const MessageWishes& wishes);

}  // namespace risley::app
