// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/io/json_text.hpp"

#include <cstddef>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley::io {

void require_shallow_json(const std::string& path, std::string_view text) {
  constexpr int kDeepest = 100;
  int depth = 0;
  bool in_string = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (in_string) {
      if (c == '\\') ++at;
      if (c == '"') in_string = false;
    } else if (c == '"') {
      in_string = true;
    } else if (c == '[' || c == '{') {
      if (++depth <= kDeepest) continue;
      throw FileError(
          path, {at, {}},
          fmt::format("expected lists and objects at most {} deep, found deeper ones", kDeepest));
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
}

}  // namespace risley::io
