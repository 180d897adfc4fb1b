// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/require.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>

#include "risley/core/error.hpp"

namespace risley {
namespace {

[[noreturn]] void refuse(std::string_view name, double value, std::string_view unit,
                         const std::string& allowed) {
  throw InvalidArgument(
      fmt::format("{} = {}{}{}, allowed {}", name, value, unit.empty() ? "" : " ", unit, allowed));
}

}  // namespace

void require_length(std::string_view name, std::size_t length, std::size_t expected) {
  if (length == expected) return;
  throw InvalidArgument(fmt::format("{} has {} values, expected {}", name, length, expected));
}

void require_length_or_none(std::string_view name, std::size_t length, std::size_t expected) {
  if (length == expected || length == 0) return;
  throw InvalidArgument(
      fmt::format("{} has {} values, expected {} or none", name, length, expected));
}

void require_place(std::string_view name, std::size_t place, std::size_t size) {
  if (place < size) return;
  throw InvalidArgument(size == 0 ? fmt::format("{} = {}, but there are none", name, place)
                                  : fmt::format("{} = {}, allowed 0 to {}", name, place, size - 1));
}

void require_rows(std::string_view name, std::size_t begin, std::size_t end, std::size_t size) {
  if (begin <= end && end <= size) return;
  throw InvalidArgument(
      fmt::format("{} = [{}, {}), allowed within [0, {})", name, begin, end, size));
}

void require_at_least(std::string_view name, long long value, long long least) {
  if (value >= least) return;
  throw InvalidArgument(fmt::format("{} = {}, allowed {} or more", name, value, least));
}

void require_above(std::string_view name, double value, double limit, std::string_view unit) {
  if (value > limit && std::isfinite(value)) return;
  refuse(name, value, unit, fmt::format("above {}", limit));
}

void require_threshold(std::string_view name, double value) {
  if (value > 0) return;
  refuse(name, value, "", "above 0");
}

void require_not_below(std::string_view name, double value, double limit, std::string_view unit) {
  if (value >= limit && std::isfinite(value)) return;
  refuse(name, value, unit, fmt::format("{} and above", limit));
}

void require_between(std::string_view name, double value, double lowest, double highest,
                     std::string_view unit) {
  if (value >= lowest && value <= highest) return;
  refuse(name, value, unit, fmt::format("{} to {}", lowest, highest));
}

void require_finite(std::string_view name, double value, std::string_view unit) {
  if (std::isfinite(value)) return;
  refuse(name, value, unit, "finite");
}

void require_unit_length(std::string_view name, double length) {
  if (std::abs(length - 1.0) < 1e-6) return;
  throw InvalidArgument(fmt::format("{} has length {}, expected a unit vector", name, length));
}

}  // namespace risley
