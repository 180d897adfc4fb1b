// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/event_server.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cstring>
#include <deque>
#include <list>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <microhttpd.h>

#include "risley/core/error.hpp"
#include "risley/io/block_file.hpp"
#include "risley/wire/udp_socket.hpp"

#include "wire/listening_socket.hpp"

namespace risley::wire {
namespace {

constexpr unsigned kIdleSeconds = 10;  // for a request, and for a browser that accepts no bytes
constexpr std::size_t kStreamBlock = 4096;
constexpr const char* kEventsPath = "/events";
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// Values of one header.
struct HeaderValues {
  std::string_view name;
  std::vector<std::string> values;
};

std::vector<std::string> header_values(MHD_Connection* connection, std::string_view name) {
  HeaderValues wanted{name, {}};
  MHD_get_connection_values(
      connection, MHD_HEADER_KIND,
      [](void* to, MHD_ValueKind, const char* key, const char* value) {
        auto& found = *static_cast<HeaderValues*>(to);
        const std::string_view other(key);
        const bool same = std::equal(
            other.begin(), other.end(), found.name.begin(), found.name.end(),
            [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
        if (same) found.values.emplace_back(value == nullptr ? "" : value);
        return MHD_YES;
      },
      &wanted);
  return wanted.values;
}

void add_headers(MHD_Response* response, const char* type) {
  const std::pair<const char*, const char*> headers[] = {
      {"Content-Type", type},
      {"Content-Security-Policy", kPolicy},
      {"X-Content-Type-Options", "nosniff"},
      {"Referrer-Policy", "no-referrer"},
      {"Cross-Origin-Resource-Policy", "same-origin"},
      {"Cache-Control", "no-store"}};
  for (const auto& [name, value] : headers) MHD_add_response_header(response, name, value);
}

}  // namespace

std::vector<std::string> host_names(const Endpoint& local) {
  constexpr std::uint8_t kLoopback = 127;
  constexpr int kUsualPort = 80;  // which browsers leave out
  std::vector<std::string> names = {to_string(local.address)};
  if (local.address.bytes[0] == kLoopback) names.emplace_back("localhost");
  std::vector<std::string> hosts;
  for (const std::string& name : names) {
    hosts.push_back(fmt::format("{}:{}", name, local.port));
    if (local.port == kUsualPort) hosts.push_back(name);
  }
  return hosts;
}

class EventServer::Server {
 public:
  Server(const Endpoint& local, std::vector<ServedText> texts)
      : local_(local), texts_(std::move(texts)) {
    // A separate socket, because libmicrohttpd does not report why creating one failed.
    io::FileDescriptor socket = listening_socket(local_);
    daemon_ = MHD_start_daemon(
        MHD_USE_INTERNAL_POLLING_THREAD | MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME, local_.port,
        nullptr, nullptr, &Server::answer, this, MHD_OPTION_LISTEN_SOCKET, socket.release(),
        MHD_OPTION_CONNECTION_LIMIT, static_cast<unsigned>(kMostConnections),
        MHD_OPTION_CONNECTION_TIMEOUT, kIdleSeconds, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
        kMostHeaderBytes, MHD_OPTION_END);
    if (daemon_ == nullptr) {
      throw NetworkError(to_string(local_) +
                         ": libmicrohttpd could not start: end other programs, or watch no page");
    }
    const std::scoped_lock lock(mutex_);  // the caller already waits for this
    hosts_ = host_names(local_);
  }

  ~Server() {
    {
      const std::scoped_lock lock(mutex_);
      ending_ = true;
      for (Listener& one : listeners_) wake(one);
    }
    // Browsers that accept their bytes receive the final event.
    constexpr int kLooks = 30;
    constexpr std::chrono::milliseconds kBetween(10);
    for (int look = 0; look < kLooks && counts().listeners > 0; ++look) {
      std::this_thread::sleep_for(kBetween);
    }
    MHD_stop_daemon(daemon_);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  const Endpoint& local() const { return local_; }

  void send(std::string_view data) {
    const std::scoped_lock lock(mutex_);
    latest_ = fmt::format("data: {}\n\n", data);
    for (Listener& one : listeners_) {
      if (one.waiting.size() >= kMostWaiting) {
        one.waiting.pop_front();
        ++counts_.dropped_events;
      }
      one.waiting.push_back(latest_);
      wake(one);
    }
  }

  EventServerCounts counts() const {
    const std::scoped_lock lock(mutex_);
    EventServerCounts result = counts_;
    result.listeners = listeners_.size();
    return result;
  }

 private:
  /// A browser that gets events.
  struct Listener {
    Server* server = nullptr;
    MHD_Connection* connection = nullptr;
    std::deque<std::string> waiting;
    std::string current;  // of which `sent` bytes are sent
    std::size_t sent = 0;
    bool suspended = false;
    std::list<Listener>::iterator place;
  };

  static void wake(Listener& one) {
    if (std::exchange(one.suspended, false)) MHD_resume_connection(one.connection);
  }

  static MHD_Result answer(void* self, MHD_Connection* connection, const char* url,
                           const char* method, const char*, const char*, std::size_t*,
                           void** of_request) {
    auto& server = *static_cast<Server*>(self);
    if (std::string_view(method) != MHD_HTTP_METHOD_GET) {
      return server.refuse(connection, MHD_HTTP_METHOD_NOT_ALLOWED, "only GET is allowed\n");
    }
    static char seen;
    if (*of_request == nullptr) {  // the headers are there, a body might follow
      *of_request = &seen;
      return MHD_YES;
    }
    if (!server.is_for_us(connection)) {
      return server.refuse(connection, MHD_HTTP_FORBIDDEN,
                           "Host or Origin is not the address of this page\n");
    }
    const std::string_view path(url);
    if (path == kEventsPath) return server.listen(connection);
    for (const ServedText& text : server.texts_) {
      if (text.path == path) return queue(connection, MHD_HTTP_OK, text.body, text.type.c_str());
    }
    return server.refuse(connection, MHD_HTTP_NOT_FOUND, "there is no such page\n");
  }

  bool is_for_us(MHD_Connection* connection) const {
    const std::scoped_lock lock(mutex_);
    const auto hosts = header_values(connection, MHD_HTTP_HEADER_HOST);
    if (hosts.size() != 1 || std::ranges::find(hosts_, hosts[0]) == hosts_.end()) {
      return false;
    }
    const auto origins = header_values(connection, MHD_HTTP_HEADER_ORIGIN);
    return origins.empty() || (origins.size() == 1 && origins[0] == "http://" + hosts[0]);
  }

  MHD_Result refuse(MHD_Connection* connection, unsigned status, const char* words) {
    {
      const std::scoped_lock lock(mutex_);
      ++counts_.refused;
    }
    return queue(connection, status, words, "text/plain; charset=utf-8");
  }

  static MHD_Result queue(MHD_Connection* connection, unsigned status, std::string_view body,
                          const char* type) {
    MHD_Response* response = MHD_create_response_from_buffer(
        body.size(), const_cast<char*>(body.data()), MHD_RESPMEM_MUST_COPY);
    if (response == nullptr) return MHD_NO;
    add_headers(response, type);
    if (status == MHD_HTTP_METHOD_NOT_ALLOWED) MHD_add_response_header(response, "Allow", "GET");
    const MHD_Result result = MHD_queue_response(connection, status, response);
    MHD_destroy_response(response);
    return result;
  }

  MHD_Result listen(MHD_Connection* connection) {
    Listener* listener = nullptr;
    {
      const std::scoped_lock lock(mutex_);
      listener = &listeners_.emplace_front();
      listener->place = listeners_.begin();
      listener->server = this;
      listener->connection = connection;
      if (!latest_.empty()) listener->waiting.push_back(latest_);
    }
    MHD_Response* response = MHD_create_response_from_callback(
        MHD_SIZE_UNKNOWN, kStreamBlock, &Server::give, listener, &Server::forget);
    if (response == nullptr) {
      forget(listener);
      return MHD_NO;
    }
    add_headers(response, "text/event-stream");
    const MHD_Result result = MHD_queue_response(connection, MHD_HTTP_OK, response);
    MHD_destroy_response(response);
    return result;
  }

  /// Passes bytes of events to the server's thread, which waits if there are none.
  static ssize_t give(void* to, std::uint64_t, char* bytes, std::size_t most) {
    auto& listener = *static_cast<Listener*>(to);
    const std::scoped_lock lock(listener.server->mutex_);
    if (listener.sent == listener.current.size()) {
      if (listener.waiting.empty()) {
        if (listener.server->ending_) return MHD_CONTENT_READER_END_OF_STREAM;
        listener.suspended = true;
        MHD_suspend_connection(listener.connection);
        return 0;
      }
      listener.current = std::move(listener.waiting.front());
      listener.waiting.pop_front();
      listener.sent = 0;
    }
    const std::size_t count = std::min(most, listener.current.size() - listener.sent);
    std::memcpy(bytes, listener.current.data() + listener.sent, count);
    listener.sent += count;
    return static_cast<ssize_t>(count);
  }

  static void forget(void* whom) {
    auto* listener = static_cast<Listener*>(whom);
    Server& server = *listener->server;
    const std::scoped_lock lock(server.mutex_);
    server.listeners_.erase(listener->place);
  }

  Endpoint local_;
  std::vector<ServedText> texts_;
  mutable std::mutex mutex_;  // of all members below except the daemon
  std::vector<std::string> hosts_;
  std::list<Listener> listeners_;
  std::string latest_;
  bool ending_ = false;
  EventServerCounts counts_;
  MHD_Daemon* daemon_ = nullptr;
};

EventServer::EventServer(const Endpoint& local, std::vector<ServedText> texts)
    : server_(std::make_unique<Server>(local, std::move(texts))) {}
EventServer::~EventServer() = default;

const Endpoint& EventServer::local() const { return server_->local(); }
void EventServer::send(std::string_view data) { server_->send(data); }
EventServerCounts EventServer::counts() const { return server_->counts(); }

Endpoint listening_endpoint(std::string_view text) {
  constexpr Address kLoopback{{127, 0, 0, 1}};
  const std::size_t colon = text.rfind(':');
  const std::string_view port = colon == std::string_view::npos ? text : text.substr(colon + 1);
  const auto address = colon == std::string_view::npos ? std::optional<Address>(kLoopback)
                                                       : address_from(text.substr(0, colon));
  Endpoint endpoint;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), endpoint.port);
  if (!address || error != std::errc() || end != port.data() + port.size()) {
    throw InvalidArgument(
        fmt::format("'{}', expected a port (0: any that is free) or ADDRESS:PORT, such as "
                    "127.0.0.1:8421",
                    text));
  }
  endpoint.address = *address;
  return endpoint;
}

}  // namespace risley::wire
