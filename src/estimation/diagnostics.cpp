// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/diagnostics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace risley::estimation {

Moments moments(std::span<const double> values, std::span<const unsigned char> skip) {
  const auto used = [&](std::size_t i) {
    return std::isfinite(values[i]) && (skip.empty() || skip[i] == 0);
  };
  Moments result;
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!used(i)) continue;
    ++result.count;
    sum += values[i];
    squares += values[i] * values[i];
  }
  if (result.count == 0) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    result.mean = result.std = result.rms = result.skewness = result.kurtosis = nan;
    return result;
  }
  const double n = static_cast<double>(result.count);
  result.mean = sum / n;
  result.rms = std::sqrt(squares / n);
  double second = 0, third = 0, fourth = 0;  // central moments, second pass for accuracy
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!used(i)) continue;
    const double d = values[i] - result.mean;
    second += d * d;
    third += d * d * d;
    fourth += d * d * d * d;
  }
  second /= n;
  third /= n;
  fourth /= n;
  result.std = std::sqrt(second * n / std::max(n - 1.0, 1.0));
  if (second > 0) {
    result.skewness = third / std::pow(second, 1.5);
    result.kurtosis = fourth / (second * second) - 3.0;
  }
  return result;
}

}  // namespace risley::estimation
