// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace risley::wire {

/// Domains of DDS that ROS 2 allows.
inline constexpr int kHighestDdsDomain = 232;

/// Publishes messages to ROS 2 over its DDS as they come, by Fast DDS. Subscribers of every
/// reliability match. The last messages are kept for slow subscribers; the sender never waits.
/// Thread-safe.
class DdsPublisher {
 public:
  /// Messages of a topic kept for subscribers that have not confirmed them.
  static constexpr int kKept = 50;

  /// @param domain      as ROS_DOMAIN_ID
  /// @param local_only  restrict to subscribers of this machine
  /// @throws InvalidArgument for a domain that does not exist, and if the library was built without
  /// Fast DDS
  /// @throws NetworkError
  DdsPublisher(int domain, bool local_only);
  ~DdsPublisher();  ///< gives subscribers two seconds for unconfirmed messages
  DdsPublisher(const DdsPublisher&) = delete;
  DdsPublisher& operator=(const DdsPublisher&) = delete;

  /// Adds a topic of ROS 2, or continues it.
  /// @param topic  "/risley/points", which is rt/risley/points in DDS
  /// @param type   "sensor_msgs/msg/PointCloud2"
  /// @return its number  @throws NetworkError
  std::size_t add(const std::string& topic, const std::string& type);
  /// @param message  as CDR, with its encapsulation header of four bytes
  /// @throws NetworkError
  void send(std::size_t topic, std::span<const std::uint8_t> message);

 private:
  class Participant;
  std::unique_ptr<Participant> participant_;
};

}  // namespace risley::wire
