// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "risley/bags/bag_writer.hpp"
#include "risley/wire/foxglove_server.hpp"

namespace risley::jobs {

/// A bag that is read while it is written. Adding an existing topic continues it. Thread-safe.
class LiveBag : public bags::BagWriter {
 public:
  /// Gives readers some seconds for the messages they have not taken yet.
  void close() override {}
  /// Its address for readers, in words.
  virtual std::string place() const = 0;
  /// Data taken by its viewers so far, if it counts them.
  virtual std::optional<wire::FoxgloveCounts> viewers() const { return std::nullopt; }
};

/// @param destination  "foxglove:PORT" or "foxglove:ADDRESS:PORT", for Foxglove-compatible viewers
/// on this machine or at that address of it; "dds" or "dds:DOMAIN", for nodes of ROS 2 in the
/// domain of ROS_DOMAIN_ID (0 without it) or that one, only on this machine if ROS_LOCALHOST_ONLY
/// is 1
/// @throws InvalidArgument, NetworkError
std::unique_ptr<LiveBag> open_live_bag(const std::string& destination);

}  // namespace risley::jobs
