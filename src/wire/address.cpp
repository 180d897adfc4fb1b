// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/address.hpp"

#include <charconv>
#include <system_error>

#include <fmt/format.h>

namespace risley::wire {

std::string to_string(const Address& address) {
  return fmt::format("{}.{}.{}.{}", address.bytes[0], address.bytes[1], address.bytes[2],
                     address.bytes[3]);
}

std::optional<Address> address_from(std::string_view text) {
  Address address;
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t i = 0; i < address.bytes.size(); ++i) {
    if (i > 0 && (at == end || *at++ != '.')) return std::nullopt;
    const auto [last, code] = std::from_chars(at, end, address.bytes[i]);
    if (code != std::errc() || (last - at > 1 && *at == '0')) return std::nullopt;
    at = last;
  }
  return at == end ? std::optional(address) : std::nullopt;
}

std::string to_string(const Endpoint& endpoint) {
  return fmt::format("{}:{}", to_string(endpoint.address), endpoint.port);
}

}  // namespace risley::wire
