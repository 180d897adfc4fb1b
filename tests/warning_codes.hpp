// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <ostream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "risley/core/warning.hpp"

#include "refusal.hpp"

namespace risley {

/// What warnings are about, in their order.
inline std::vector<std::string_view> codes_of(const std::vector<Warning>& warnings) {
  std::vector<std::string_view> codes;
  for (const Warning& warning : warnings) codes.push_back(warning.code.name);
  return codes;
}

/// Matches a warning of a code whose message names some numbers, fields or files, whatever its
/// other words.
struct Warns {
  using is_gtest_matcher = void;

  explicit Warns(WarningCode about, std::vector<std::string> naming = {})
      : code(about), named(std::move(naming)) {}

  bool MatchAndExplain(const Warning& warning, std::ostream* why) const {
    if (why != nullptr) *why << warning.code.name << ": " << warning.message;
    for (const std::string& one : named) {
      if (!NamesField(one).MatchAndExplain(warning.message, nullptr)) return false;
    }
    return warning.code == code;
  }
  void DescribeTo(std::ostream* stream) const {
    *stream << "warns of " << code.name;
    for (const std::string& one : named) *stream << ", naming " << one;
  }
  void DescribeNegationTo(std::ostream* stream) const {
    *stream << "not: ";
    DescribeTo(stream);
  }

  WarningCode code;
  std::vector<std::string> named;
};

}  // namespace risley
