// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace risley::io {

static_assert(std::endian::native == std::endian::little,
              "numbers are copied from and to files as they stand in memory");

/// A number that starts at any byte of a little-endian file.
template <class T>
T load(const std::uint8_t* bytes) {
  static_assert(std::is_arithmetic_v<T>);
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

/// Writes a number as sizeof(T) little-endian bytes, aligned or not.
template <class T>
void store(std::uint8_t* bytes, std::type_identity_t<T> value) {
  static_assert(std::is_arithmetic_v<T>);
  std::memcpy(bytes, &value, sizeof(T));
}

}  // namespace risley::io
