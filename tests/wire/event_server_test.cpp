// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/event_server.hpp"

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/wire/udp_socket.hpp"

#include "refusal.hpp"
#include "wire/connection.hpp"

namespace risley::wire {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

class EventServerTest : public ::testing::Test {
 protected:
  EventServerTest()
      : server_(std::make_unique<EventServer>(
            Endpoint{kLoopback, 0},
            std::vector<ServedText>{{"/", "text/html; charset=utf-8", "<p>page</p>"}})) {}

  std::string host() const { return to_string(server_->local()); }
  static std::string request(const std::string& first, const std::string& headers) {
    return first + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n";
  }
  std::string ask(const std::string& bytes) const {
    Connection connection(server_->local());
    connection.send(bytes);
    return connection.read(kNever, 3000);
  }
  /// A connection that has got what stands for the present.
  std::unique_ptr<Connection> listener(int receive_buffer = 0) const {
    auto connection = std::make_unique<Connection>(server_->local(), receive_buffer);
    connection->send("GET /events HTTP/1.1\r\nHost: " + host() + "\r\n\r\n");
    return connection;
  }
  void wait_for_listeners(std::size_t count) const {
    for (int i = 0; i < 500 && server_->counts().listeners != count; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ASSERT_EQ(server_->counts().listeners, count);
  }

  std::unique_ptr<EventServer> server_;
};

TEST_F(EventServerTest, ThePageComesWithAPolicy) {
  for (const std::string& name : {host(), fmt::format("localhost:{}", server_->local().port)}) {
    const std::string reply = ask(request("GET /", "Host: " + name + "\r\n"));
    EXPECT_THAT(reply, StartsWith("HTTP/1.1 200 "));
    EXPECT_THAT(reply, HasSubstr("Content-Security-Policy: default-src 'none'; script-src 'self'"));
    EXPECT_THAT(reply, HasSubstr("X-Content-Type-Options: nosniff"));
    EXPECT_THAT(reply, Not(HasSubstr("Access-Control")));
    EXPECT_THAT(reply, HasSubstr("<p>page</p>"));
  }
}

TEST(HostNames, AreThoseThatBrowsersUse) {
  const Address loopback{{127, 0, 0, 1}}, other{{192, 168, 1, 5}};
  EXPECT_THAT(host_names({loopback, 8080}),
              ::testing::ElementsAre("127.0.0.1:8080", "localhost:8080"));
  EXPECT_THAT(host_names({loopback, 80}),
              ::testing::ElementsAre("127.0.0.1:80", "127.0.0.1", "localhost:80", "localhost"));
  EXPECT_THAT(host_names({other, 80}), ::testing::ElementsAre("192.168.1.5:80", "192.168.1.5"));
}

TEST_F(EventServerTest, OnlyItsOwnHostAndOriginAreAnswered) {
  const std::string forbidden = "HTTP/1.1 403 ", bad = "HTTP/1.1 400 ";
  EXPECT_THAT(ask(request("GET /", "Host: example.org\r\n")), StartsWith(forbidden));
  EXPECT_THAT(ask(request("GET /events", "Host: example.org\r\n")), StartsWith(forbidden));
  EXPECT_THAT(ask(request("GET /", "Host: 127.0.0.1\r\n")), StartsWith(forbidden));
  EXPECT_THAT(ask(request("GET /", "Host: " + host() + "\r\nHost: example.org\r\n")),
              ::testing::AnyOf(StartsWith(forbidden), StartsWith(bad)));
  EXPECT_THAT(ask(request("GET /", "")), ::testing::AnyOf(StartsWith(forbidden), StartsWith(bad)));
  const std::string own = "Host: " + host() + "\r\n";
  EXPECT_THAT(ask(request("GET /", own + "Origin: http://example.org\r\n")), StartsWith(forbidden));
  EXPECT_THAT(ask(request("GET /", own + "Origin: null\r\n")), StartsWith(forbidden));
  EXPECT_THAT(ask(request("GET /", own + "Origin: http://" + host() + "\r\n")),
              StartsWith("HTTP/1.1 200 "));
  EXPECT_GE(server_->counts().refused, 5U);
}

TEST_F(EventServerTest, NothingButGetIsAllowed) {
  const std::string own = "Host: " + host() + "\r\n";
  for (const char* method : {"POST", "PUT", "DELETE", "HEAD", "OPTIONS", "STOP"}) {
    EXPECT_THAT(ask(request(std::string(method) + " /", own + "Content-Length: 0\r\n")),
                StartsWith("HTTP/1.1 405 "))
        << method;
  }
  EXPECT_THAT(ask(request("GET /other", own)), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(ask(request("GET /../../etc/passwd", own)), StartsWith("HTTP/1.1 404 "));
}

TEST_F(EventServerTest, HugeHeadersAreRefused) {
  const std::string huge(3 * EventServer::kMostHeaderBytes, 'a');
  const std::string own = "Host: " + host() + "\r\n";
  EXPECT_THAT(ask(request("GET /", own + "X-Huge: " + huge + "\r\n")),
              Not(StartsWith("HTTP/1.1 200 ")));
  EXPECT_THAT(ask(request("GET /" + huge, own)), Not(StartsWith("HTTP/1.1 200 ")));
  EXPECT_THAT(ask(request("GET /", own)), StartsWith("HTTP/1.1 200 "));
}

TEST_F(EventServerTest, EventsComeInTheirOrderAndTheLastOneToLatecomers) {
  auto early = listener();
  wait_for_listeners(1);
  server_->send("{\"n\":1}");
  EXPECT_THAT(early->read("data: {\"n\":1}\n\n"), HasSubstr("data: {\"n\":1}\n\n"));
  server_->send("{\"n\":2}");
  EXPECT_THAT(early->read("\n\n"), HasSubstr("data: {\"n\":2}\n\n"));
  auto late = listener();
  const std::string text = late->read("data: {\"n\":2}\n\n");
  EXPECT_THAT(text, HasSubstr("Content-Type: text/event-stream"));
  EXPECT_THAT(text, HasSubstr("data: {\"n\":2}\n\n"));
  EXPECT_THAT(text, Not(HasSubstr("{\"n\":1}")));
  server_->send("{\"over\":true}");
  server_.reset();
  EXPECT_THAT(early->read(kNever, 1000), HasSubstr("over"));
  EXPECT_TRUE(early->ended());
}

TEST_F(EventServerTest, ASlowBrowserHoldsNobodyUp) {
  auto slow = listener(4096), quick = listener();
  wait_for_listeners(2);
  const std::string event(100'000, 'x');
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 300; ++i) server_->send(event);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(2));
  EXPECT_GT(server_->counts().dropped_events, 100U);
  server_->send("last");
  EXPECT_THAT(quick->read("data: last\n\n"), HasSubstr("data: last\n\n"));
}

TEST_F(EventServerTest, ABrowserThatGoesIsForgotten) {
  auto gone = listener(), stays = listener();
  wait_for_listeners(2);
  gone.reset();
  for (int i = 0; i < 500 && server_->counts().listeners > 1; ++i) {
    server_->send("{}");
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(server_->counts().listeners, 1U);
}

TEST_F(EventServerTest, AThousandConnectionsLeaveItAlive) {
  auto first = listener();
  wait_for_listeners(1);
  {
    std::vector<std::unique_ptr<Connection>> many;
    for (int i = 0; i < 1000; ++i) many.push_back(std::make_unique<Connection>(server_->local()));
    server_->send("still here");
    EXPECT_THAT(first->read("still here"), HasSubstr("still here"));
  }
  std::string reply;
  for (int i = 0; i < 200 && reply.empty(); ++i) {
    reply = ask(request("GET /", "Host: " + host() + "\r\n"));
    if (reply.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_THAT(reply, StartsWith("HTTP/1.1 200 "));
}

TEST_F(EventServerTest, APortThatIsTakenIsRefused) {
  EXPECT_THAT(refusal<NetworkError>([&] { EventServer other(server_->local(), {}); }),
              HasSubstr("another program uses this port"));
  EXPECT_THROW(EventServer(Endpoint{Address{}, 0}, {}), InvalidArgument);
}

TEST(ListeningEndpoint, ReadsAddressesAndPorts) {
  EXPECT_EQ(listening_endpoint("8421"), (Endpoint{kLoopback, 8421}));
  EXPECT_EQ(listening_endpoint("192.168.1.5:80"), (Endpoint{{{192, 168, 1, 5}}, 80}));
  for (const char* text : {"", ":", "x", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "1.2.3:4",
                           "8421 ", "-1", "[::1]:80"}) {
    EXPECT_THROW(listening_endpoint(text), InvalidArgument) << text;
  }
}

}  // namespace
}  // namespace risley::wire
