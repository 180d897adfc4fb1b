// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/udp_socket.hpp"

#include <gtest/gtest.h>

#include "refusal.hpp"

namespace risley::wire::socket_test {

const Address kHere{{127, 0, 0, 1}}, kThere{{127, 0, 0, 77}};

std::vector<std::pair<Endpoint, std::string>> received(UdpSocket& socket) {
  const UdpSocket* const all[] = {&socket};
  std::vector<std::pair<Endpoint, std::string>> list;
  wait_for(all, 200'000'000);
  socket.receive([&](const UdpSocket::Datagram& datagram) {
    EXPECT_GT(datagram.kernel_ns, 1'600'000'000'000'000'000);
    list.emplace_back(datagram.from, std::string(datagram.bytes.begin(), datagram.bytes.end()));
  });
  return list;
}

std::span<const std::uint8_t> bytes_of_text(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(UdpSocket, FromOneAddressToAnother) {
  UdpSocket here({kHere, 0});
  const UdpSocket there({kThere, 0});
  EXPECT_NE(here.local().port, 0);
  ASSERT_TRUE(there.send(here.local(), bytes_of_text("one")));
  ASSERT_TRUE(there.send(here.local(), bytes_of_text("two")));
  const auto list = received(here);
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0], std::pair(there.local(), std::string("one")));
  EXPECT_EQ(list[1].second, "two");
  EXPECT_TRUE(received(here).empty());
}

// Who is bound to an address hears what is sent to it, and not what is broadcast.
TEST(UdpSocket, Broadcasts) {
  UdpSocket everybody({kEverybody, 0}, 0, "lo");
  const std::uint16_t port = everybody.local().port;
  UdpSocket network({{{127, 255, 255, 255}}, port}, 0, "lo");
  UdpSocket here({kHere, port});
  const UdpSocket there({kThere, 0});
  ASSERT_TRUE(there.send({kEverybody, port}, bytes_of_text("all")));
  ASSERT_TRUE(there.send({{{127, 255, 255, 255}}, port}, bytes_of_text("net")));
  EXPECT_EQ(received(everybody).at(0), std::pair(there.local(), std::string("all")));
  EXPECT_EQ(received(network).at(0).second, "net");
  EXPECT_TRUE(received(here).empty());
}

TEST(UdpSocket, WhatTheKernelHasNoRoomForIsCounted) {
  UdpSocket here({kHere, 0}, 4096);
  EXPECT_GT(here.receive_buffer(), 0U);
  const UdpSocket there({kThere, 0});
  const std::string text(1300, 'x');
  constexpr std::size_t kCount = 1000;
  for (std::size_t i = 0; i < kCount; ++i) there.send(here.local(), bytes_of_text(text));
  std::size_t count = 0;
  for (std::size_t more = 1; more > 0;) count += more = received(here).size();
  there.send(here.local(), bytes_of_text("last"));  // reports what was dropped
  EXPECT_EQ(received(here).size(), 1U);
  EXPECT_GT(here.kernel_drops(), 0U);
  EXPECT_EQ(here.kernel_drops() + count, kCount);
}

TEST(UdpSocket, MessagesNameAddressAndRemedy) {
  const UdpSocket first({kHere, 0});
  const auto message = [](const Endpoint& local) {
    return refusal<NetworkError>([&] { const UdpSocket second(local); });
  };
  EXPECT_NE(message(first.local())
                .find(to_string(first.local()) + ": Address already in use: "
                                                 "another program"),
            std::string::npos);
  EXPECT_NE(message({{{192, 0, 2, 1}}, 0}).find("no interface of this machine"), std::string::npos);
}

TEST(UdpSocket, Interfaces) {
  const Interface here = interface_of("127.0.0.1");
  EXPECT_EQ(here.name, "lo");
  EXPECT_TRUE(here.is_loopback);
  EXPECT_EQ(here.broadcast, (Address{{127, 255, 255, 255}}));
  EXPECT_EQ(interface_of("127.0.0.77").address, kThere);
  EXPECT_THROW(interface_of("eth0"), InvalidArgument);
  EXPECT_THROW(interface_of("192.0.2.1"), InvalidArgument);
}

}  // namespace risley::wire::socket_test
