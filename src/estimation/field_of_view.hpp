// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "risley/core/angle.hpp"
#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// Distance outside the sensor's field of view that counts as noise or a unit's own error, rad, and
/// the number of shots that may lie there.
inline constexpr double kFieldMargin = radians_from_degrees(1.5);
inline constexpr double kFewOutside = 0.03;

/// Share of the shots outside the cone that a sensor reaches about its X axis.
/// @param field_of_view  full cone, rad; 0 when unknown: then no shot is outside
inline double share_outside(const AngleSeries& series, double field_of_view) {
  if (!(field_of_view > 0)) return 0.0;
  std::size_t outside = 0;
  const double limit = std::cos(std::min(0.5 * field_of_view + kFieldMargin, kPi));
  for (std::size_t i = 0; i < series.size(); ++i) {
    outside += std::sin(series.zenith[i]) * std::cos(series.azimuth[i]) < limit ? 1 : 0;
  }
  return static_cast<double>(outside) /
         static_cast<double>(std::max<std::size_t>(1, series.size()));
}

}  // namespace risley::estimation
