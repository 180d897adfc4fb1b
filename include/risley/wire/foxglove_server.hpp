// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "risley/wire/address.hpp"

namespace risley::wire {

/// Messages of one kind, as announced to viewers.
struct FoxgloveChannel {
  std::string topic;            ///< "/risley/points"
  std::string encoding;         ///< of messages: "cdr"
  std::string schema_name;      ///< "sensor_msgs/msg/PointCloud2"
  std::string schema_encoding;  ///< "ros2msg"
  std::string schema;           ///< definition of the messages
};

/// What a server has seen.
struct FoxgloveCounts {
  std::size_t viewers = 0;             ///< that are connected now
  std::uint64_t connections = 0;       ///< so far
  std::uint64_t refused = 0;           ///< connections that were refused
  std::uint64_t sent_messages = 0;     ///< to viewers, each counted
  std::uint64_t dropped_messages = 0;  ///< for slow viewers, each counted
};

/// Sends messages to Foxglove-compatible viewers as they come, by WebSocket (subprotocols
/// "foxglove.websocket.v1" and "foxglove.sdk.v1") on a separate thread. Viewers subscribe to
/// channels and can do nothing else. A viewer must address the server by its own address (or
/// localhost, if that is loopback), and a page must be of this machine or of Foxglove's own web
/// application. Connections and queues for slow viewers are bounded. Thread-safe.
class FoxgloveServer {
 public:
  static constexpr std::size_t kMostViewers = 16;  ///< others are closed at once
  /// Memory of one viewer's queue, bytes; only its own oldest messages are dropped.
  static constexpr std::size_t kMostWaiting = std::size_t{32} << 20U;
  /// Most bytes of a viewer's message.
  static constexpr std::size_t kMostReceived = std::size_t{64} << 10U;
  static constexpr std::size_t kMostSubscriptions = 256;  ///< of a viewer
  /// A viewer that receives and answers nothing for this long is disconnected, s.
  static constexpr int kLongestSilence = 30;

  /// @param local  an address of this machine, not 0.0.0.0; port 0: any free one
  /// @param name   of the server, for viewers
  /// @throws InvalidArgument, NetworkError
  FoxgloveServer(const Endpoint& local, const std::string& name);
  ~FoxgloveServer();  ///< as close()
  FoxgloveServer(const FoxgloveServer&) = delete;
  FoxgloveServer& operator=(const FoxgloveServer&) = delete;

  const Endpoint& local() const;  ///< with the port that it got
  /// Announces a channel to viewers, including later ones. @return its number
  std::uint32_t add(const FoxgloveChannel& channel);
  /// Sends a message to all subscribers of its channel. Never waits for the network.
  /// @param time_ns  of the message, since 1970
  void send(std::uint32_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> message);
  /// Ends the connections once the queued messages are sent: waits five seconds at most, and ends
  /// when no viewer has taken one for a second. The rest is counted as dropped. Nothing may be
  /// added or sent afterwards.
  void close();
  FoxgloveCounts counts() const;  ///< so far

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace risley::wire
