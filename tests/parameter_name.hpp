// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley {

/// A text as the name of a test's parameter: its letters, digits and underscores, which are all
/// that GoogleTest takes.
inline std::string parameter_name(std::string text) {
  std::erase_if(text, [](char c) {
    return !(c >= '0' && c <= '9') && !(c >= 'A' && c <= 'Z') && !(c >= 'a' && c <= 'z') &&
           c != '_';
  });
  return text;
}

/// Names tests by parameters that are texts.
inline constexpr auto kByItself = [](const auto& test) { return parameter_name(test.param); };

}  // namespace risley
