// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace risley {

/// Standard deviation of a normal distribution over the median distance from its middle.
inline constexpr double kSigmaOverMedianDistance = 1.4826;

/// The middle value; the mean of the two middle ones; NaN for no values. Orders the values anew.
inline double median(std::span<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

/// The value at a place in sorted order, counted from 0. Orders the values anew.
template <class T>
T nth_value(std::vector<T>& values, std::size_t place) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(place);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// The middle value, or the greater of the two middle ones; there must be one. Orders the values
/// anew.
template <class T>
T upper_median(std::vector<T>& values) {
  return nth_value(values, values.size() / 2);
}

/// The quantile: this share of the others is below it, without interpolation; there must be one.
/// Orders the values anew.
template <class T>
T quantile(std::vector<T>& values, double share) {
  return nth_value(values,
                   static_cast<std::size_t>(share * static_cast<double>(values.size() - 1)));
}

}  // namespace risley
