// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <type_traits>

#include "risley/io/little_endian.hpp"

namespace risley::cloud::las {

/// Writes a number. @return where the next one goes
template <class T>
std::uint8_t* put(std::uint8_t* out, std::type_identity_t<T> value) {
  io::store<T>(out, value);
  return out + sizeof(T);
}

}  // namespace risley::cloud::las
