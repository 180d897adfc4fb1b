// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "report/chart_fields.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include <fmt/format.h>

namespace risley::report {

int digits_of(const std::vector<double>& values) {
  constexpr int kDigits = 7, kMostDigits = 15;
  double least = std::numeric_limits<double>::infinity(), greatest = -least;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    least = std::min(least, value);
    greatest = std::max(greatest, value);
  }
  const double size = std::max(std::abs(least), std::abs(greatest)), spread = greatest - least;
  if (!(spread > 0) || !(size > spread)) return kDigits;
  return std::min(kDigits + static_cast<int>(std::ceil(std::log10(size / spread))), kMostDigits);
}

std::vector<double> shortened(const std::vector<double>& values) {
  const int digits = digits_of(values);
  std::vector<double> result;
  result.reserve(values.size());
  for (const double value : values) {
    result.push_back(std::isfinite(value)
                         ? std::strtod(fmt::format("{:.{}g}", value, digits).c_str(), nullptr)
                         : value);
  }
  return result;
}

std::span<const char* const> enum_names(SeriesKind) {
  static constexpr const char* kNames[] = {"points", "line", "steps", "cells"};
  return kNames;
}

std::span<const char* const> enum_names(ChartKind) {
  static constexpr const char* kNames[] = {"plain", "full_turn", "two_turns",
                                           "map",   "ground",    "space"};
  return kNames;
}

std::span<const char* const> enum_names(Palette) {
  static constexpr const char* kNames[] = {"sequential", "diverging"};
  return kNames;
}

}  // namespace risley::report
