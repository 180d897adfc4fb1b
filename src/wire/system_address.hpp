// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstring>
#include <type_traits>

#include <netinet/in.h>
#include <sys/socket.h>

#include "risley/wire/address.hpp"

namespace risley::wire {

/// An endpoint in the form for socket calls.
inline sockaddr_in system_address(const Endpoint& endpoint) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(endpoint.port);
  std::memcpy(&address.sin_addr, endpoint.address.bytes.data(), endpoint.address.bytes.size());
  return address;
}

inline Address address_of(const sockaddr_in& system) {
  Address address;
  std::memcpy(address.bytes.data(), &system.sin_addr, address.bytes.size());
  return address;
}

inline Endpoint endpoint_of(const sockaddr_in& system) {
  return {address_of(system), ntohs(system.sin_port)};
}

/// These calls have one type for the addresses of all protocols.
template <class System>
auto* any_address(System* address) {
  if constexpr (std::is_const_v<System>) {
    return reinterpret_cast<const sockaddr*>(address);
  } else {
    return reinterpret_cast<sockaddr*>(address);
  }
}

}  // namespace risley::wire
