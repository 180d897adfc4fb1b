// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>

namespace risley::estimation {

/// Sample statistics of residuals, in the unit of the sample.
struct Moments {
  std::size_t count = 0;
  double mean = 0;
  double std = 0;       ///< standard deviation about the mean
  double rms = 0;       ///< root of the mean square
  double skewness = 0;  ///< 0 for a normal distribution
  double kurtosis = 0;  ///< excess: 0 for a normal distribution
};

/// Moments of the finite values of a column; NaN everywhere when there is none.
/// @param skip  where not zero the value is left out (outliers); empty skips nothing
Moments moments(std::span<const double> values, std::span<const unsigned char> skip = {});

}  // namespace risley::estimation
