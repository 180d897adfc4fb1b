// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/foxglove_server.hpp"

#include <chrono>
#include <memory>
#include <numeric>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/little_endian.hpp"
#include "risley/wire/udp_socket.hpp"

#include "refusal.hpp"
#include "wire/connection.hpp"

namespace risley::wire {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

const FoxgloveChannel kPoints{"/points", "cdr", "sensor_msgs/msg/PointCloud2", "ros2msg",
                              "uint8[] data\n"};

/// A frame of a WebSocket.
struct WebFrame {
  int opcode = -1;  ///< -1: the other side has ended
  std::string payload;
};

/// A viewer of bytes.
class FoxgloveViewer {
 public:
  explicit FoxgloveViewer(const FoxgloveServer& server, const std::string& headers = {},
                          int receive_buffer = 0)
      : connection_(server.local(), receive_buffer) {
    connection_.send(request("Host: " + to_string(server.local()) + "\r\n" +
                             "Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n" + headers));
    reply_ = connection_.read("\r\n\r\n");
    const std::size_t end = std::min(reply_.find("\r\n\r\n"), reply_.size() - 4) + 4;
    rest_ = reply_.substr(end);
  }

  static std::string request(const std::string& headers) {
    return "GET / HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
           "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
           headers + "\r\n";
  }

  const std::string& reply() const { return reply_; }

  void say(const std::string& text, unsigned char opcode = 1) {
    std::string frame(1, static_cast<char>(0x80U | opcode));
    if (text.size() < 126) {
      frame += static_cast<char>(0x80U | text.size());
    } else {
      frame += static_cast<char>(0x80U | 127U);
      for (int shift = 56; shift >= 0; shift -= 8) {
        frame += static_cast<char>(text.size() >> static_cast<unsigned>(shift) & 255U);
      }
    }
    frame += std::string(4, '\0');  // a mask that changes nothing
    connection_.send(frame + text);
  }

  WebFrame next() {
    const std::string head = take(2);
    if (head.size() < 2) return {};
    std::size_t size = static_cast<unsigned char>(head[1]);
    const std::size_t further = size == 126 ? 2 : (size == 127 ? 8 : 0);
    if (further > 0) {
      size = 0;
      for (const char byte : take(further)) size = size << 8U | static_cast<unsigned char>(byte);
    }
    return {head[0] & 15, take(size)};
  }

  /// The next one but for empty messages.
  WebFrame next_filled() {
    constexpr std::size_t kHead = 13;
    WebFrame frame = next();
    while (frame.opcode == 2 && frame.payload.size() == kHead) frame = next();
    return frame;
  }

  /// What comes, up to a frame with a text in it.
  std::string read_until(const std::string& text) {
    std::string all;
    for (WebFrame one = next(); one.opcode >= 0; one = next()) {
      all += one.payload;
      if (one.payload.find(text) != std::string::npos) break;
    }
    return all;
  }

 private:
  std::string take(std::size_t count) {
    std::string bytes = rest_.substr(0, count);
    rest_.erase(0, bytes.size());
    if (bytes.size() < count) bytes += connection_.read_bytes(count - bytes.size());
    return bytes;
  }

  Connection connection_;
  std::string reply_, rest_;
};

std::string subscription(int id, int channel) {
  return fmt::format(R"({{"op":"subscribe","subscriptions":[{{"id":{},"channelId":{}}}]}})", id,
                     channel);
}

class FoxgloveServerTest : public ::testing::Test {
 protected:
  FoxgloveServerTest()
      : server_(std::make_unique<FoxgloveServer>(Endpoint{kLoopback, 0}, "a test")) {}

  /// Sends empty messages until a viewer has received one, and so is subscribed.
  void wait_for_subscription(FoxgloveViewer& viewer, std::uint32_t channel) {
    const std::uint64_t before = server_->counts().sent_messages;
    for (int i = 0; i < 500 && server_->counts().sent_messages == before; ++i) {
      server_->send(channel, 0, {});
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    viewer.say("", 9);  // answered behind all of these
    while (viewer.next().opcode == 2) {
    }
  }

  std::unique_ptr<FoxgloveServer> server_;
};

TEST_F(FoxgloveServerTest, AViewerLearnsOfChannelsAndGetsMessages) {
  const std::uint32_t channel = server_->add(kPoints);
  FoxgloveViewer viewer(*server_);
  EXPECT_THAT(viewer.reply(), StartsWith("HTTP/1.1 101 "));
  EXPECT_THAT(viewer.reply(), HasSubstr("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo="));
  EXPECT_THAT(viewer.reply(), HasSubstr("Sec-WebSocket-Protocol: foxglove.websocket.v1"));
  WebFrame frame = viewer.next();
  EXPECT_EQ(frame.opcode, 1);
  EXPECT_THAT(frame.payload, HasSubstr("\"op\":\"serverInfo\""));
  EXPECT_THAT(frame.payload, HasSubstr("\"name\":\"a test\""));
  frame = viewer.next();
  EXPECT_THAT(frame.payload, HasSubstr("\"op\":\"advertise\""));
  EXPECT_THAT(frame.payload, HasSubstr(fmt::format("\"id\":{}", channel)));
  EXPECT_THAT(frame.payload, HasSubstr("\"schemaName\":\"sensor_msgs/msg/PointCloud2\""));
  EXPECT_THAT(frame.payload, HasSubstr(R"("schema":"uint8[] data\n")"));
  const std::uint32_t later = server_->add({"/other", "cdr", "x", "ros2msg", ""});
  EXPECT_THAT(viewer.next().payload, HasSubstr(fmt::format("\"id\":{}", later)));

  viewer.say(subscription(77, static_cast<int>(channel)));
  wait_for_subscription(viewer, channel);
  std::vector<std::uint8_t> message(200'000);
  std::iota(message.begin(), message.end(), std::uint8_t{0});
  server_->send(later, 5, message);  // a channel without subscribers
  server_->send(channel, 1'234'567'890'123'456'789, message);
  frame = viewer.next_filled();
  EXPECT_EQ(frame.opcode, 2);
  ASSERT_EQ(frame.payload.size(), 13 + message.size());
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(frame.payload.data());
  EXPECT_EQ(bytes[0], 1);
  EXPECT_EQ(io::load<std::uint32_t>(bytes + 1), 77U);
  EXPECT_EQ(io::load<std::uint64_t>(bytes + 5), 1'234'567'890'123'456'789U);
  EXPECT_TRUE(std::equal(message.begin(), message.end(), bytes + 13));

  viewer.say(R"({"op":"unsubscribe","subscriptionIds":[77]})");
  viewer.say("", 9);
  EXPECT_EQ(viewer.next().opcode, 10);
  server_->send(channel, 6, message);
  viewer.say("", 9);
  EXPECT_EQ(viewer.next().opcode, 10);
  server_.reset();
  EXPECT_EQ(viewer.next().opcode, 8);  // a farewell
}

TEST_F(FoxgloveServerTest, StrangersAreRefused) {
  const std::string own = "Host: " + to_string(server_->local()) + "\r\n";
  const std::string protocol = "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n";
  const auto ask = [&](const std::string& bytes) {
    Connection connection(server_->local());
    connection.send(bytes);
    return connection.read("\r\n\r\n", 3000);
  };
  const auto request = [](const std::string& headers) { return FoxgloveViewer::request(headers); };
  EXPECT_THAT(ask(request(own + protocol)), StartsWith("HTTP/1.1 101 "));
  for (const char* origin : {"http://localhost:8080", "http://127.0.0.1", "https://[::1]:8080",
                             "file://", "https://app.foxglove.dev"}) {
    EXPECT_THAT(ask(request(own + protocol + "Origin: " + origin + "\r\n")),
                StartsWith("HTTP/1.1 101 "))
        << origin;
  }
  for (const char* origin : {"http://example.org", "null", "https://localhost.example.org", "",
                             "https://app.foxglove.dev.example.org", "http://", "https://[::2]"}) {
    const std::string reply = ask(request(own + protocol + "Origin: " + origin + "\r\n"));
    EXPECT_THAT(reply, StartsWith("HTTP/1.1 403 ")) << origin;
  }
  EXPECT_THAT(ask(request(protocol + "Host: example.org\r\n")), StartsWith("HTTP/1.1 403 "));
  EXPECT_THAT(ask(request(own)), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(ask(request(own + "Sec-WebSocket-Protocol: chat\r\n")), StartsWith("HTTP/1.1 400 "));
  EXPECT_THAT(ask("GET / HTTP/1.1\r\n" + own + protocol + "\r\n"), StartsWith("HTTP/1.1 400 "));
  EXPECT_EQ(ask("nonsense\r\n\r\n"), "");
  EXPECT_EQ(ask(request(own + "X-Huge: " + std::string(20'000, 'x') + "\r\n")), "");
  EXPECT_GE(server_->counts().refused, 13U);
  EXPECT_EQ(server_->counts().connections, 6U);
}

TEST_F(FoxgloveServerTest, NonsenseHarmsNobody) {
  const std::uint32_t channel = server_->add(kPoints);
  FoxgloveViewer viewer(*server_);
  viewer.read_until("advertise");
  for (const char* text :
       {"", "{", "[]", "null", "7", "{}", R"({"op":7})", R"({"op":"subscribe"})",
        R"({"op":"subscribe","subscriptions":7})", R"({"op":"subscribe","subscriptions":[7,{}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":"1"}]})",
        R"({"op":"unsubscribe","subscriptionIds":{"a":1}})",
        R"({"op":"unsubscribe","subscriptionIds":[9,-1,null]})"}) {
    viewer.say(text);
  }
  viewer.say("\x01\x02", 2);
  for (int id = 0; id < 1000; ++id) viewer.say(subscription(id, 99));
  viewer.say(subscription(5, static_cast<int>(channel)));  // a number that is taken
  viewer.say("", 9);
  EXPECT_EQ(viewer.next().opcode, 10);
  viewer.say(std::string(2 * FoxgloveServer::kMostReceived, ' '));
  EXPECT_EQ(viewer.next().opcode, 8);
  FoxgloveViewer another(*server_);
  EXPECT_THAT(another.read_until("advertise"), HasSubstr("serverInfo"));
}

/// What a slow viewer misses, others get.
TEST_F(FoxgloveServerTest, AViewerThatNeverReadsHoldsNobodyUp) {
  const std::uint32_t channel = server_->add(kPoints);
  FoxgloveViewer quick(*server_), slow(*server_, {}, 4096);
  quick.read_until("advertise");
  slow.read_until("advertise");
  quick.say(subscription(1, static_cast<int>(channel)));
  slow.say(subscription(2, static_cast<int>(channel)));
  wait_for_subscription(quick, channel);
  wait_for_subscription(slow, channel);
  const std::vector<std::uint8_t> message(1'000'000);
  constexpr int kMessages = 100;
  int got = 0;
  for (int i = 0; i < kMessages; ++i) {
    server_->send(channel, static_cast<std::uint64_t>(i) + 1, message);
    const WebFrame frame = quick.next_filled();
    if (frame.opcode == 2 && static_cast<unsigned char>(frame.payload[5]) == i + 1) ++got;
  }
  EXPECT_EQ(got, kMessages);
  const FoxgloveCounts counts = server_->counts();
  EXPECT_EQ(counts.viewers, 2U);
  EXPECT_GT(counts.dropped_messages, 50U);
  EXPECT_LT(counts.dropped_messages, static_cast<std::uint64_t>(kMessages));
}

TEST_F(FoxgloveServerTest, TheEndCountsWhatAViewerDidNotTake) {
  const std::uint32_t channel = server_->add(kPoints);
  FoxgloveViewer quick(*server_), slow(*server_, {}, 4096);
  for (FoxgloveViewer* viewer : {&quick, &slow}) {
    viewer->read_until("advertise");
    viewer->say(subscription(1, static_cast<int>(channel)));
    wait_for_subscription(*viewer, channel);
  }
  quick.say("", 9);
  while (quick.next().opcode == 2) {  // what the other one has waited for
  }
  const std::vector<std::uint8_t> message(1'000'000);
  constexpr int kMessages = 20;
  for (int i = 0; i < kMessages; ++i) server_->send(channel, 1, message);
  std::thread reader([&] {
    for (int i = 0; i < kMessages; ++i) EXPECT_EQ(quick.next().payload.size(), 13 + message.size());
    EXPECT_EQ(quick.next().opcode, 8);
  });
  server_->close();
  reader.join();
  // Buffers of the kernel hold the others.
  EXPECT_GT(server_->counts().dropped_messages, 10U);
  EXPECT_LE(server_->counts().dropped_messages, static_cast<std::uint64_t>(kMessages));
}

TEST_F(FoxgloveServerTest, ConnectionsAreBoundedAndComeAgain) {
  for (int round = 0; round < 3; ++round) {
    std::vector<std::unique_ptr<FoxgloveViewer>> many;
    std::size_t open = 0;
    for (std::size_t i = 0; i < FoxgloveServer::kMostViewers + 5; ++i) {
      many.push_back(std::make_unique<FoxgloveViewer>(*server_));
      if (many.back()->reply().starts_with("HTTP/1.1 101 ")) ++open;
    }
    EXPECT_EQ(open, FoxgloveServer::kMostViewers);
    many.clear();
    for (int i = 0; i < 500 && server_->counts().viewers > 0; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    EXPECT_EQ(server_->counts().viewers, 0U);
  }
}

TEST_F(FoxgloveServerTest, APortThatIsTakenIsRefused) {
  EXPECT_THAT(refusal<NetworkError>([&] { FoxgloveServer other(server_->local(), ""); }),
              HasSubstr("another program uses this port"));
  EXPECT_THROW(FoxgloveServer(Endpoint{Address{}, 0}, ""), InvalidArgument);
}

}  // namespace
}  // namespace risley::wire
