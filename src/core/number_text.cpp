// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/number_text.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace risley {
namespace {

/// Decimals that show two significant digits; 0.0996 is shown as 0.10, so round first.
int decimals_for(double sigma) {
  const double exponent = std::floor(std::log10(sigma));
  const double leading = std::round(sigma / std::pow(10.0, exponent - 1));
  const int place = static_cast<int>(exponent) + (leading >= 100 ? 1 : 0);
  return std::clamp(1 - place, 0, 15);
}

/// Two significant digits of a length, m, in mm, cm or m.
std::string length_text(double length) {
  const auto in = [&](double unit, const char* name) {
    return fmt::format("{} {}", number_text(length / unit, length / unit).value, name);
  };
  // A unit ends where two digits round up to the next one.
  if (length < 0.0995) return in(0.001, "mm");
  return length < 0.995 ? in(0.01, "cm") : in(1, "m");
}

}  // namespace

std::string without_minus_zero(std::string number) {
  const bool zero = number.find_first_not_of("-0.") == std::string::npos;
  if (zero && number.starts_with('-')) number.erase(0, 1);
  return number;
}

std::string plain_text(double value, int digits) {
  std::string text = fmt::format("{:.{}g}", value, digits);
  const std::size_t mark = text.find('e');
  if (mark == std::string::npos) return without_minus_zero(text);
  const int exponent = std::stoi(text.substr(mark + 1));
  const std::size_t point = text.find('.');
  const int decimals = point == std::string::npos ? 0 : static_cast<int>(mark - point) - 1;
  return fmt::format("{:.{}f}", std::stod(text), std::max(decimals - exponent, 0));
}

bool is_sigma(double sigma) { return std::isfinite(sigma) && sigma > 0; }

NumberText number_text(double value, double sigma) {
  if (!is_sigma(sigma)) return {without_minus_zero(fmt::format("{:.7g}", value)), ""};
  const int decimals = decimals_for(sigma);
  return {without_minus_zero(fmt::format("{:.{}f}", value, decimals)),
          fmt::format("{:.{}f}", sigma, decimals)};
}

std::string text_to_place_of(double value, double sigma) {
  if (!is_sigma(sigma)) return without_minus_zero(fmt::format("{:.7g}", value));
  return without_minus_zero(fmt::format("{:.{}f}", value, decimals_for(sigma)));
}

double offset_at(double angle, double distance) { return distance * std::tan(std::abs(angle)); }

std::string offset_text(double angle, double distance) {
  const double offset = offset_at(angle, distance);
  if (!std::isfinite(offset)) return "–";
  return fmt::format("{} at {} m", length_text(offset),
                     distance >= 10 ? fmt::format("{:.0f}", distance) : plain_text(distance, 2));
}

}  // namespace risley
