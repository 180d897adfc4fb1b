// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/wire/sensor_session.hpp"

#include <utility>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::wire {

SensorSession::SensorSession(SensorIdentity identity) : identity_(std::move(identity)) {
  constexpr std::size_t kMostCharacters = 15;
  if (identity_.code.empty() || identity_.code.size() > kMostCharacters) {
    throw InvalidArgument(fmt::format("broadcast code \"{}\" has {} characters, allowed 1 to {}",
                                      identity_.code, identity_.code.size(), kMostCharacters));
  }
}

std::optional<std::int64_t> SensorSession::take_reboot() { return std::exchange(reboot_, {}); }

std::vector<SensorSession::Outgoing> SensorSession::take_datagrams(std::int64_t /*now_ns*/) {
  return std::exchange(datagrams_, {});
}

}  // namespace risley::wire
