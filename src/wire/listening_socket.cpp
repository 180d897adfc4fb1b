// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "wire/listening_socket.hpp"

#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <sys/socket.h>

#include "risley/core/error.hpp"
#include "risley/wire/udp_socket.hpp"

#include "wire/system_address.hpp"

namespace risley::wire {

io::FileDescriptor listening_socket(Endpoint& local) {
  if (local.address == Address{}) {
    throw InvalidArgument(
        "0.0.0.0 is not a reachable address, expected one of this machine, such as 127.0.0.1");
  }
  const auto refuse_if = [&](bool failed) {
    if (!failed) return;
    throw NetworkError(fmt::format(
        "{}: {}: {}", to_string(local), std::strerror(errno),
        errno == EADDRINUSE ? "another program uses this port; name another, or 0"
                            : "name an address of this machine and a port that is free"));
  };
  io::FileDescriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  refuse_if(socket.get() < 0);
  const int on = 1;  // a port counts as free although its last connections have not timed out yet
  refuse_if(::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0);
  sockaddr_in address = system_address(local);
  socklen_t bytes = sizeof address;
  refuse_if(::bind(socket.get(), any_address(&address), bytes) != 0 ||
            ::listen(socket.get(), SOMAXCONN) != 0 ||
            ::getsockname(socket.get(), any_address(&address), &bytes) != 0);
  local = endpoint_of(address);
  return socket;
}

}  // namespace risley::wire
