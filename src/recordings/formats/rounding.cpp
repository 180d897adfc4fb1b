// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "recordings/formats/rounding.hpp"

#include <algorithm>
#include <limits>

namespace risley::recordings {
namespace {

/// One in this many numbers rounded to a step is a multiple of the next coarser one.
constexpr double kChanceOfCoarser = 0.1;
constexpr double kLeastChance = 1e-9;
constexpr int kFinestDecimals = 6;
/// Relative accuracy of a decimal fraction in arithmetic and in the type itself.
constexpr double kFloat32Precision = 0x1p-22, kFloat64Precision = 0x1p-50;
/// If this many changing integers are all multiples of a coarser step, it is not a coincidence.
constexpr std::size_t kChangesForStep = 16;

bool are_multiples(std::span<const std::vector<Decimal>* const> columns, double per_unit,
                   double precision) {
  double log_chance = 0.0;  // probability of a coincidence
  for (const auto* const column : columns) {
    for (const Decimal& cell : *column) {
      if (!std::isfinite(cell.value) || cell.value == 0.0) continue;
      const double scaled = std::abs(cell.value) * per_unit;
      const double tolerance = scaled * precision;
      if (std::abs(scaled - std::round(scaled)) > tolerance) return false;
      log_chance += std::log(std::clamp(2.0 * tolerance, kChanceOfCoarser, 1.0));
    }
  }
  return log_chance < std::log(kLeastChance);
}

}  // namespace

Rounding rounding_of(std::span<const std::vector<Decimal>* const> columns, CellType type) {
  Rounding rounding;
  rounding.decimals = type == CellType::text ? -1 : std::numeric_limits<int>::max();
  if (type == CellType::integer) {
    rounding.step = 1.0;
    return rounding;
  }
  if (type == CellType::text) {
    for (const auto* const column : columns) {
      for (const Decimal& cell : *column) rounding.notice(cell);
    }
  }
  // Numbers that once were float32 are recognised by the same inaccuracy.
  for (const double precision : {kFloat64Precision, kFloat32Precision}) {
    if (type == CellType::float32 && precision == kFloat64Precision) continue;
    for (int decimals = 0; decimals <= kFinestDecimals; ++decimals) {
      if (!are_multiples(columns, std::pow(10.0, decimals), precision)) continue;
      rounding.step = std::pow(10.0, -decimals);
      return rounding;
    }
  }
  if (type == CellType::float32) rounding.relative = 0x1p-23;
  return rounding;
}

std::int64_t common_power_of_ten(std::span<const std::int64_t> numbers) {
  std::int64_t power = 1, before = 0;
  std::size_t changes = 0;
  for (const std::int64_t number : numbers) {
    if (number != 0 && number != before) ++changes;
    before = number;
  }
  if (changes < kChangesForStep) return power;
  const auto all_multiples = [numbers](std::int64_t of) {
    return std::all_of(numbers.begin(), numbers.end(),
                       [of](std::int64_t number) { return number % of == 0; });
  };
  while (all_multiples(10 * power)) power *= 10;
  return power;
}

}  // namespace risley::recordings
