// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "risley/wire/address.hpp"

namespace risley::wire {

/// A text that the server offers to browsers.
struct ServedText {
  std::string path;  ///< "/", "/page.js"
  std::string type;  ///< "text/html; charset=utf-8"
  std::string body;
};

/// What a server has seen.
struct EventServerCounts {
  std::uint64_t refused = 0;         ///< requests that were rejected
  std::uint64_t dropped_events = 0;  ///< events dropped for slow browsers
  std::size_t listeners = 0;         ///< browsers that get events now
};

/// Allowed Host values: the server's address with the port, localhost too if it is loopback, and
/// both without the port if that is the usual one.
std::vector<std::string> host_names(const Endpoint& local);

/// Shows a local page: some texts, and a stream of events ("server-sent events") at /events, by
/// HTTP on a separate thread. It answers only GET, and only if Host is its own address (or
/// localhost, if that is loopback) and Origin, if there is one, the page's. The page may load
/// nothing from elsewhere. Connections, headers and queues for slow browsers are bounded.
class EventServer {
 public:
  static constexpr std::size_t kMostConnections = 32;  ///< others are closed at once
  /// Memory of a connection: request and headers must fit.
  static constexpr std::size_t kMostHeaderBytes = 8192;
  /// Queued events of one browser; the oldest are dropped.
  static constexpr std::size_t kMostWaiting = 4;

  /// @param local  an address of this machine, not 0.0.0.0; port 0: any free one
  /// @throws InvalidArgument, NetworkError
  EventServer(const Endpoint& local, std::vector<ServedText> texts);
  ~EventServer();  ///< ends all connections
  EventServer(const EventServer&) = delete;
  EventServer& operator=(const EventServer&) = delete;

  const Endpoint& local() const;  ///< with the port that it got
  /// Sends an event to every browser, including those that connect before the next one. Never waits
  /// for the network. @param data  without line breaks
  void send(std::string_view data);
  EventServerCounts counts() const;  ///< so far

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

/// An address and a port to listen on: "127.0.0.1:8421"; a port without an address is on loopback.
/// @throws InvalidArgument
Endpoint listening_endpoint(std::string_view text);

}  // namespace risley::wire
