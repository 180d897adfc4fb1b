// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/npy_head.hpp"

#include <cstddef>
#include <cstdint>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::io {
namespace {

using namespace std::string_view_literals;

constexpr std::string_view kNpyMagic = "\x93NUMPY\x01\x00"sv;
constexpr std::size_t kNpyAlignment = 64;      ///< of the first element, as numpy has it
constexpr std::size_t kNpyTextLimit = 0xFFFF;  ///< its length is a 16-bit number

}  // namespace

std::string npy_head(std::string description) {
  const std::size_t before = kNpyMagic.size() + sizeof(std::uint16_t);
  const std::size_t size = before + description.size() + 1;
  description.append((kNpyAlignment - size % kNpyAlignment) % kNpyAlignment, ' ');
  description += '\n';
  if (description.size() > kNpyTextLimit) {
    throw InvalidArgument(
        fmt::format("npy: header of {} bytes, allowed up to {}: there are too many common factors",
                    description.size(), kNpyTextLimit));
  }
  const char length[] = {static_cast<char>(description.size() & 0xFF),
                         static_cast<char>(description.size() >> 8)};
  return std::string(kNpyMagic) + std::string(length, sizeof length) + description;
}

}  // namespace risley::io
