// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/yaml_output.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include <fmt/format.h>

#include "risley/core/require.hpp"

namespace risley::io {

std::string yaml_quoted(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string yaml_decimal(double value, long double scale) {
  require_finite("value", value);
  require_above("scale", static_cast<double>(scale), 0);
  const long double in_file = static_cast<long double>(value) / scale;
  std::array<char, 64> text{};
  char* const begin = text.data();
  char* const limit = begin + text.size();
  const auto reads_back = [&](const char* end) {
    long double again = 0;
    std::from_chars(begin, end, again);
    return static_cast<double>(again * scale) == value;
  };
  char* end = begin;
  int decimals = 0;
  for (; decimals < 24; ++decimals) {
    end = std::to_chars(begin, limit, in_file, std::chars_format::scientific, decimals).ptr;
    if (reads_back(end)) break;
  }
  int exponent = 0;
  const char* digits = std::find(begin, end, 'e') + 1;
  std::from_chars(*digits == '+' ? digits + 1 : digits, end, exponent);
  if (exponent >= -5 && exponent < 16) {  // as people write it
    end = std::to_chars(begin, limit, in_file, std::chars_format::fixed,
                        std::max(0, decimals - exponent))
              .ptr;
  }
  return {begin, end};
}

}  // namespace risley::io
