// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Sends damaged and invented datagrams of the protocol to a socket of somebody else.
#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include "risley/io/little_endian.hpp"
#include "risley/wire/frame.hpp"

namespace {

using risley::wire::Frame;
using risley::wire::kFrameOverhead;
using Random = std::mt19937_64;
using Bytes = std::vector<std::uint8_t>;
namespace io = risley::io;

std::size_t up_to(Random& random, std::size_t most) { return random() % (most + 1); }

Bytes noise(Random& random, std::size_t length) {
  Bytes bytes(length);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

/// A whole frame of any kind, of commands that exist and that do not.
Bytes frame(Random& random) {
  const Bytes data = noise(random, up_to(random, random() % 8 == 0 ? 1000 : 40));
  Frame one;
  one.type = static_cast<risley::wire::FrameType>(up_to(random, 2));
  one.sequence = static_cast<std::uint16_t>(random());
  one.command = {static_cast<std::uint8_t>(up_to(random, 2)),
                 static_cast<std::uint8_t>(up_to(random, 14))};
  one.data = data;
  return risley::wire::encode_frame(one);
}

/// A data packet of any type, with the number of records that the type has.
Bytes packet(Random& random) {
  struct Type {
    std::uint8_t records, bytes;
  };
  constexpr std::array<Type, 9> kTypes = {
      {{100, 13}, {100, 9}, {96, 14}, {96, 10}, {48, 28}, {48, 16}, {1, 24}, {30, 42}, {30, 22}}};
  constexpr std::size_t kHead = 18, kTypeAt = 9;
  const std::size_t type = up_to(random, kTypes.size() - 1);
  Bytes bytes = noise(random, kHead + std::size_t{kTypes.at(type).records} * kTypes.at(type).bytes);
  bytes[0] = 5;
  bytes[kTypeAt] = static_cast<std::uint8_t>(type);
  return bytes;
}

/// Changes a few bytes or the length; half of the time checksums are right again afterwards.
void damage(Bytes& bytes, Random& random) {
  for (std::size_t change = up_to(random, 3); change > 0 && !bytes.empty(); --change) {
    switch (random() % 4) {
      case 0:
        bytes.resize(up_to(random, bytes.size()));
        break;
      case 1:
        bytes.push_back(static_cast<std::uint8_t>(random()));
        break;
      default:
        bytes[up_to(random, bytes.size() - 1)] = static_cast<std::uint8_t>(random());
    }
  }
  if (bytes.size() < kFrameOverhead || bytes[0] == 5 || random() % 2 == 0) return;
  const std::span<const std::uint8_t> whole(bytes);
  io::store<std::uint16_t>(&bytes[2], static_cast<std::uint16_t>(bytes.size()));
  io::store<std::uint16_t>(&bytes[7], risley::wire::frame_crc16(whole.first(7)));
  io::store<std::uint32_t>(&bytes[bytes.size() - 4],
                           risley::wire::frame_crc32(whole.first(bytes.size() - 4)));
}

sockaddr_in address_of(const char* address, int port) {
  sockaddr_in found{};
  found.sin_family = AF_INET;
  found.sin_port = htons(static_cast<std::uint16_t>(port));
  if (inet_pton(AF_INET, address, &found.sin_addr) != 1) throw std::runtime_error(address);
  return found;
}

/// @return how many the system took
std::uint64_t flood(int socket, std::uint64_t count, std::uint64_t per_second, std::uint64_t seed) {
  constexpr std::size_t kBatch = 64;
  Random random(seed);
  std::array<Bytes, kBatch> datagrams;
  std::array<iovec, kBatch> parts{};
  std::array<mmsghdr, kBatch> messages{};
  const auto begin = std::chrono::steady_clock::now();
  std::uint64_t sent = 0;
  while (sent < count) {
    const std::size_t size = std::min<std::uint64_t>(kBatch, count - sent);
    for (std::size_t i = 0; i < size; ++i) {
      const std::size_t kind = random() % 8;
      datagrams[i] = kind == 0  ? noise(random, up_to(random, 1400))
                     : kind < 6 ? frame(random)
                                : packet(random);
      damage(datagrams[i], random);
      parts[i] = {datagrams[i].data(), datagrams[i].size()};
      messages[i].msg_hdr = {};
      messages[i].msg_hdr.msg_iov = &parts[i];
      messages[i].msg_hdr.msg_iovlen = 1;
    }
    const int taken = sendmmsg(socket, messages.data(), static_cast<unsigned>(size), 0);
    if (taken > 0) sent += static_cast<std::uint64_t>(taken);
    // Who is gone answers with an error, which is not ours.
    if (taken <= 0 && errno != ECONNREFUSED && errno != EAGAIN && errno != EINTR) break;
    std::this_thread::sleep_until(begin +
                                  std::chrono::nanoseconds(sent * 1'000'000'000 / per_second));
  }
  return sent;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 7) {
    std::fprintf(stderr, "usage: %s FROM_ADDRESS TO_ADDRESS PORT DATAGRAMS PER_SECOND SEED\n",
                 argv[0]);
    return 2;
  }
  const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  const sockaddr_in from = address_of(argv[1], 0), to = address_of(argv[2], std::atoi(argv[3]));
  if (socket < 0 || bind(socket, reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0 ||
      connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    std::perror("flood");
    return 3;
  }
  std::printf("%llu\n",
              static_cast<unsigned long long>(flood(socket, std::strtoull(argv[4], nullptr, 10),
                                                    std::strtoull(argv[5], nullptr, 10),
                                                    std::strtoull(argv[6], nullptr, 10))));
  close(socket);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "flood: %s\n", error.what());
  return 2;
}
