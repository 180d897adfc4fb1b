// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/foxglove_server.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <exception>
#include <list>
#include <map>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "risley/io/little_endian.hpp"
#include "risley/wire/event_server.hpp"

#include "wire/listening_socket.hpp"

namespace risley::wire {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using nlohmann::json;

constexpr std::array<std::string_view, 2> kSubprotocols{"foxglove.sdk.v1", "foxglove.websocket.v1"};
/// The only foreign page allowed to connect.
constexpr std::string_view kFoxglovePage = "https://app.foxglove.dev";
constexpr std::chrono::seconds kForRequest(10);
constexpr std::size_t kMostRequestBytes = 8192;
constexpr std::uint8_t kMessageData = 1;                // opcode
constexpr std::size_t kMessageHead = 1 + 4 + 8;         // opcode, subscription, time
constexpr std::chrono::seconds kForNextRest(1);         // at the end, for each queued message
constexpr std::chrono::seconds kForWholeRest(5);        // and for all of them
constexpr std::chrono::milliseconds kAfterFailure(50);  // before the next connection is accepted

/// Bytes that several viewers get.
using SharedBytes = std::shared_ptr<const std::vector<std::uint8_t>>;

std::string_view view_of(beast::string_view text) { return {text.data(), text.size()}; }

/// The name of a host in "http://localhost:8080" or "https://[::1]".
std::string_view host_of(std::string_view origin) {
  const std::size_t scheme = origin.find("://");
  if (scheme == std::string_view::npos) return {};
  std::string_view host = origin.substr(scheme + 3);
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

/// Whether an origin may connect: a page of this machine, a program that is not a browser, or
/// Foxglove's.
bool may_look(std::string_view origin, const Endpoint& local) {
  if (origin == kFoxglovePage) return true;
  if (!origin.starts_with("http://") && !origin.starts_with("https://")) {
    return origin.find("://") != std::string_view::npos;  // any page can have "null"
  }
  const std::string_view host = host_of(origin);
  const std::optional<Address> address = address_from(host);
  constexpr std::uint8_t kLoopbackNet = 127;
  return host == "localhost" || host == "[::1]" ||
         (address && (address->bytes[0] == kLoopbackNet || *address == local.address));
}

/// The first supported protocol offered by a viewer; empty if none is supported.
std::string_view chosen_subprotocol(std::string_view offered) {
  for (const std::string_view ours : kSubprotocols) {
    for (std::string_view rest = offered; !rest.empty();) {
      const std::size_t comma = std::min(rest.find(','), rest.size());
      std::string_view one = rest.substr(0, comma);
      while (one.starts_with(' ')) one.remove_prefix(1);
      while (one.ends_with(' ')) one.remove_suffix(1);
      if (one == ours) return ours;
      rest.remove_prefix(std::min(comma + 1, rest.size()));
    }
  }
  return {};
}

SharedBytes bytes_of(const json& message) {
  const std::string text = message.dump(-1, ' ', false, json::error_handler_t::replace);
  return std::make_shared<const std::vector<std::uint8_t>>(text.begin(), text.end());
}

}  // namespace

/// Everything except the interface's calls runs on one thread.
class FoxgloveServer::Server {
 public:
  Server(const Endpoint& local, const std::string& name)
      : local_(local),
        acceptor_(io_, tcp::v4(), listening_socket(local_).release()),
        hosts_(host_names(local_)),
        info_(bytes_of({{"op", "serverInfo"},
                        {"name", name},
                        {"capabilities", json::array()},
                        {"supportedEncodings", json::array()},
                        {"metadata", json::object()},
                        {"sessionId", fmt::format("{}", begin_of_session())}})) {
    accept();
    thread_ = std::thread([this] { run(); });
  }

  ~Server() { close(); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  const Endpoint& local() const { return local_; }

  std::uint32_t add(const FoxgloveChannel& channel);
  void send(std::uint32_t channel, std::uint64_t time_ns, std::span<const std::uint8_t> message);
  void close();
  FoxgloveCounts counts() const { return {connected_, connections_, refused_, sent_, dropped_}; }

 private:
  class Viewer;

  static std::int64_t begin_of_session() {
    return std::chrono::system_clock::now().time_since_epoch().count();
  }

  void run() {
    for (bool over = false; !over;) {
      try {
        io_.run();
        over = true;
      } catch (const std::exception&) {  // such as no memory for one viewer
      }
    }
  }

  void accept();
  void end();
  /// Ends when no viewer has taken a message for a while.
  void wait_for_rest() {
    timer_.expires_at(std::min(std::chrono::steady_clock::now() + kForNextRest, latest_end_));
    timer_.async_wait([this](error_code stopped) {
      if (!stopped) io_.stop();
    });
  }
  void forget(const std::shared_ptr<Viewer>& viewer) {
    viewers_.remove(viewer);
    if (ending_ && viewers_.empty()) io_.stop();
  }

  Endpoint local_;
  asio::io_context io_{1};
  tcp::acceptor acceptor_;
  asio::steady_timer timer_{io_};
  std::chrono::steady_clock::time_point latest_end_;
  std::vector<std::string> hosts_;
  SharedBytes info_;
  std::vector<json> advertised_;
  std::list<std::shared_ptr<Viewer>> viewers_;
  bool ending_ = false;
  std::atomic<std::uint32_t> channels_{0};
  std::atomic<std::size_t> connected_{0}, subscriptions_{0};
  std::atomic<std::uint64_t> connections_{0}, refused_{0}, sent_{0}, dropped_{0};
  std::thread thread_;
};

/// One connection.
class FoxgloveServer::Server::Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  Viewer(Server& server, tcp::socket socket) : server_(server), stream_(std::move(socket)) {}

  void begin() {
    request_.emplace();
    request_->header_limit(kMostRequestBytes);
    beast::get_lowest_layer(stream_).expires_after(kForRequest);
    http::async_read_header(stream_.next_layer(), buffer_, *request_,
                            [self = shared()](error_code error, std::size_t) {
                              if (error) return self->refused();
                              self->answer();
                            });
  }

  /// A text, which is never dropped.
  void tell(SharedBytes text) {
    if (open_) put({{}, 0, std::move(text)});
  }

  void send(std::uint32_t channel, std::uint64_t time_ns, const SharedBytes& bytes) {
    for (const auto& [subscription, wanted] : subscriptions_) {
      if (wanted != channel) continue;
      Waiting message{{}, kMessageHead, bytes};
      message.head[0] = kMessageData;
      io::store<std::uint32_t>(&message.head[1], subscription);
      io::store<std::uint64_t>(&message.head[5], time_ns);
      put(std::move(message));
    }
  }

  /// Closes the connection once all queued data are sent.
  void end() {
    ending_ = true;
    if (!open_) return close();
    if (waiting_.empty()) say_farewell();
  }

  /// Messages that wait to be sent.
  std::uint64_t waiting_messages() const {
    return static_cast<std::uint64_t>(
        std::ranges::count_if(waiting_, [](const Waiting& one) { return one.is_message(); }));
  }

 private:
  struct Waiting {
    std::array<std::uint8_t, kMessageHead> head{};
    std::size_t head_bytes = 0;  ///< 0: a text
    SharedBytes bytes;

    bool is_message() const { return head_bytes > 0; }
  };

  std::shared_ptr<Viewer> shared() { return this->shared_from_this(); }

  /// Accepts or rejects the request.
  void answer() {
    const auto& request = request_->get();
    const auto field = [&](http::field name) { return view_of(request[name]); };
    const std::string_view subprotocol =
        chosen_subprotocol(field(http::field::sec_websocket_protocol));
    const bool is_called =
        std::ranges::find(server_.hosts_, field(http::field::host)) != server_.hosts_.end();
    const bool has_origin = request.count(http::field::origin) > 0;
    if (!is_called || (has_origin && !may_look(field(http::field::origin), server_.local_))) {
      return refuse(http::status::forbidden, "Host or Origin is not allowed\n");
    }
    if (!websocket::is_upgrade(request) || subprotocol.empty()) {
      return refuse(http::status::bad_request,
                    "expected a WebSocket with the subprotocol foxglove.sdk.v1 or "
                    "foxglove.websocket.v1\n");
    }
    beast::get_lowest_layer(stream_).expires_never();
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = kForRequest;
    timeout.idle_timeout = std::chrono::seconds(kLongestSilence);
    timeout.keep_alive_pings = true;
    stream_.set_option(timeout);
    stream_.set_option(websocket::stream_base::decorator(
        [protocol = std::string(subprotocol)](websocket::response_type& response) {
          response.set(http::field::sec_websocket_protocol, protocol);
        }));
    stream_.read_message_max(kMostReceived);
    stream_.auto_fragment(false);
    error_code ignored;
    beast::get_lowest_layer(stream_).socket().set_option(tcp::no_delay(true), ignored);
    stream_.async_accept(request, [self = shared()](error_code error) {
      if (error) return self->refused();
      self->opened();
    });
  }

  void refuse(http::status status, const char* words) {
    refusal_.emplace(status, request_->get().version());
    refusal_->set(http::field::content_type, "text/plain; charset=utf-8");
    refusal_->keep_alive(false);
    refusal_->body() = words;
    refusal_->prepare_payload();
    http::async_write(stream_.next_layer(), *refusal_,
                      [self = shared()](error_code, std::size_t) { self->refused(); });
  }

  void refused() {
    ++server_.refused_;
    close();
  }

  void opened() {
    request_.reset();
    buffer_.clear();  // of what came too early
    open_ = true;
    ++server_.connected_;
    ++server_.connections_;
    tell(server_.info_);
    if (!server_.advertised_.empty()) {
      tell(bytes_of({{"op", "advertise"}, {"channels", server_.advertised_}}));
    }
    if (ending_) return end();
    read();
  }

  void read() {
    stream_.async_read(buffer_, [self = shared()](error_code error, std::size_t) {
      if (error) return self->close();
      self->take();
      self->read();
    });
  }

  /// A viewer's messages: subscriptions, and others that need no answer.
  void take() {
    const std::string text = beast::buffers_to_string(buffer_.data());
    buffer_.consume(buffer_.size());
    if (!stream_.got_text()) return;
    const json said = json::parse(text, nullptr, false);
    if (!said.is_object()) return;
    const json op = said.value("op", json());
    const auto list = [&said](const char* name) { return said.value(name, json::array()); };
    if (op == "subscribe") {
      for (const json& one : list("subscriptions")) {
        const std::optional<std::uint32_t> id = number(one, "id"),
                                           channel = number(one, "channelId");
        if (id && channel && subscriptions_.size() < kMostSubscriptions &&
            subscriptions_.try_emplace(*id, *channel).second) {
          ++server_.subscriptions_;
        }
      }
    } else if (op == "unsubscribe") {
      for (const json& id : list("subscriptionIds")) {
        if (!id.is_number_unsigned()) continue;
        server_.subscriptions_ -= subscriptions_.erase(id.get<std::uint32_t>());
      }
    }
  }

  static std::optional<std::uint32_t> number(const json& object, const char* name) {
    if (!object.is_object()) return std::nullopt;
    const auto at = object.find(name);
    if (at == object.end() || !at->is_number_unsigned()) return std::nullopt;
    return at->get<std::uint32_t>();
  }

  void put(Waiting next) {
    const std::size_t bytes = next.bytes->size();
    if (next.is_message()) {
      // The first one may be in transit.
      for (auto one = waiting_.begin(); waiting_bytes_ + bytes > kMostWaiting;) {
        one = std::find_if(one, waiting_.end(), [&](const Waiting& older) {
          return older.is_message() && &older != &waiting_.front();
        });
        if (one == waiting_.end()) break;
        waiting_bytes_ -= one->bytes->size();
        one = waiting_.erase(one);
        ++server_.dropped_;
      }
      if (waiting_bytes_ + bytes > kMostWaiting && !waiting_.empty()) {
        ++server_.dropped_;
        return;
      }
    }
    waiting_bytes_ += bytes;
    waiting_.push_back(std::move(next));
    if (waiting_.size() == 1) write();
  }

  void write() {
    const Waiting& first = waiting_.front();
    stream_.binary(first.is_message());
    const std::array<asio::const_buffer, 2> parts{
        asio::buffer(first.head.data(), first.head_bytes),
        asio::buffer(first.bytes->data(), first.bytes->size())};
    stream_.async_write(parts, [self = shared()](error_code error, std::size_t) {
      if (error) return self->close();
      self->written();
    });
  }

  void written() {
    if (waiting_.front().is_message()) ++server_.sent_;
    waiting_bytes_ -= waiting_.front().bytes->size();
    waiting_.pop_front();
    if (ending_) server_.wait_for_rest();
    if (!waiting_.empty()) return write();
    if (ending_) say_farewell();
  }

  void say_farewell() {
    stream_.async_close(websocket::close_code::going_away,
                        [self = shared()](error_code) { self->close(); });
  }

  void close() {
    if (std::exchange(closed_, true)) return;
    if (std::exchange(open_, false)) --server_.connected_;
    server_.subscriptions_ -= subscriptions_.size();
    subscriptions_.clear();
    beast::get_lowest_layer(stream_).close();
    server_.forget(shared());
  }

  Server& server_;
  websocket::stream<beast::tcp_stream, false> stream_;  // nothing is compressed
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> request_;
  std::optional<http::response<http::string_body>> refusal_;
  bool open_ = false, closed_ = false, ending_ = false;
  std::map<std::uint32_t, std::uint32_t> subscriptions_;  // channels, by subscription
  std::list<Waiting> waiting_;  // the first one is being sent and must not move
  std::size_t waiting_bytes_ = 0;
};

std::uint32_t FoxgloveServer::Server::add(const FoxgloveChannel& channel) {
  const std::uint32_t number = ++channels_;
  const json advertised = {{"id", number},
                           {"topic", channel.topic},
                           {"encoding", channel.encoding},
                           {"schemaName", channel.schema_name},
                           {"schemaEncoding", channel.schema_encoding},
                           {"schema", channel.schema}};
  asio::post(io_, [this, advertised] {
    advertised_.push_back(advertised);
    const SharedBytes text =
        bytes_of({{"op", "advertise"}, {"channels", json::array({advertised})}});
    for (const auto& viewer : viewers_) viewer->tell(text);
  });
  return number;
}

void FoxgloveServer::Server::send(std::uint32_t channel, std::uint64_t time_ns,
                                  std::span<const std::uint8_t> message) {
  if (subscriptions_ == 0) return;  // no subscriber needs a copy
  const auto bytes =
      std::make_shared<const std::vector<std::uint8_t>>(message.begin(), message.end());
  asio::post(io_, [this, channel, time_ns, bytes] {
    for (const auto& viewer : viewers_) viewer->send(channel, time_ns, bytes);
  });
}

void FoxgloveServer::Server::accept() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted || ending_) return;
    if (error) {  // no descriptor is free
      timer_.expires_after(kAfterFailure);
      timer_.async_wait([this](error_code stopped) {
        if (!stopped) accept();
      });
      return;
    }
    if (viewers_.size() < kMostViewers) {
      viewers_.push_back(std::make_shared<Viewer>(*this, std::move(socket)));
      viewers_.back()->begin();
    } else {
      ++refused_;
    }
    accept();
  });
}

void FoxgloveServer::Server::end() {
  ending_ = true;
  error_code ignored;
  acceptor_.close(ignored);
  latest_end_ = std::chrono::steady_clock::now() + kForWholeRest;
  wait_for_rest();
  const auto viewers = viewers_;
  for (const auto& viewer : viewers) viewer->end();
  if (viewers_.empty()) io_.stop();
}

void FoxgloveServer::Server::close() {
  if (!thread_.joinable()) return;
  asio::post(io_, [this] { end(); });
  thread_.join();
  for (const auto& viewer : viewers_) dropped_ += viewer->waiting_messages();
}

FoxgloveServer::FoxgloveServer(const Endpoint& local, const std::string& name)
    : server_(std::make_unique<Server>(local, name)) {}
FoxgloveServer::~FoxgloveServer() = default;

const Endpoint& FoxgloveServer::local() const { return server_->local(); }
std::uint32_t FoxgloveServer::add(const FoxgloveChannel& channel) { return server_->add(channel); }
void FoxgloveServer::send(std::uint32_t channel, std::uint64_t time_ns,
                          std::span<const std::uint8_t> message) {
  server_->send(channel, time_ns, message);
}
void FoxgloveServer::close() { server_->close(); }
FoxgloveCounts FoxgloveServer::counts() const { return server_->counts(); }

}  // namespace risley::wire
