// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstring>
#include <string>

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "risley/wire/address.hpp"

namespace risley::wire {

/// A browser of bytes.
class Connection {
 public:
  explicit Connection(const Endpoint& to, int receive_buffer = 0)
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer > 0) {
      ::setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(to.port);
    std::memcpy(&address.sin_addr, to.address.bytes.data(), to.address.bytes.size());
    connected_ = ::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~Connection() { ::close(socket_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  bool connected() const { return connected_; }
  bool send(const std::string& bytes) const {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) ==
           static_cast<ssize_t>(bytes.size());
  }
  /// So many bytes, or what came before the other side ended or 5 s passed without any.
  std::string read_bytes(std::size_t count) {
    std::string text;
    pollfd waiting{socket_, POLLIN, 0};
    while (text.size() < count && ::poll(&waiting, 1, 5000) == 1) {
      char bytes[65536];
      const ssize_t got = ::recv(socket_, bytes, std::min(sizeof bytes, count - text.size()), 0);
      if (got <= 0) {
        ended_ = true;
        break;
      }
      text.append(bytes, got);
    }
    return text;
  }
  /// What comes until a text is in it, the other side ends, or nothing came for so long.
  std::string read(const std::string& until, int milliseconds = 5000) {
    std::string text;
    pollfd waiting{socket_, POLLIN, 0};
    while (text.find(until) == std::string::npos && ::poll(&waiting, 1, milliseconds) == 1) {
      char bytes[4096];
      const ssize_t count = ::recv(socket_, bytes, sizeof bytes, 0);
      if (count <= 0) {
        ended_ = true;
        break;
      }
      text.append(bytes, count);
    }
    return text;
  }
  bool ended() const { return ended_; }

 private:
  int socket_;
  bool connected_ = false, ended_ = false;
};

inline const std::string kNever = "\x01 never \x01";
inline constexpr Address kLoopback{{127, 0, 0, 1}};

}  // namespace risley::wire
