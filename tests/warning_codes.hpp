// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>
#include <vector>

#include "risley/core/warning.hpp"

namespace risley {

/// What warnings are about, in their order.
inline std::vector<std::string_view> codes_of(const std::vector<Warning>& warnings) {
  std::vector<std::string_view> codes;
  for (const Warning& warning : warnings) codes.push_back(warning.code.name);
  return codes;
}

}  // namespace risley
