// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace risley::wire {

/// Port on which a sensor listens, and from which it broadcasts and replies.
inline constexpr std::uint16_t kSensorPort = 65000;
/// Port of hosts to which sensors broadcast.
inline constexpr std::uint16_t kBroadcastPort = 55000;

/// An IPv4 address.
struct Address {
  std::array<std::uint8_t, 4> bytes{};  ///< in written order
  friend bool operator==(const Address&, const Address&) = default;
  friend bool operator<(const Address& a, const Address& b) {
    return std::lexicographical_compare(a.bytes.begin(), a.bytes.end(), b.bytes.begin(),
                                        b.bytes.end());
  }
};

/// "192.168.1.2"
std::string to_string(const Address& address);
/// The inverse of to_string(); empty if the text is not an address.
std::optional<Address> address_from(std::string_view text);

/// 255.255.255.255: everybody on the interface.
inline constexpr Address kEverybody{{255, 255, 255, 255}};

/// Source or destination of a datagram.
struct Endpoint {
  Address address;
  std::uint16_t port = 0;
  friend bool operator==(const Endpoint&, const Endpoint&) = default;
};

/// "192.168.1.2:65000"
std::string to_string(const Endpoint& endpoint);

}  // namespace risley::wire
