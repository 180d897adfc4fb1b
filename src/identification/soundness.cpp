// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/soundness.hpp"

#include <cmath>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/identification/fitted_values.hpp"

namespace risley::identification {
namespace {

/// A wedge of fewer sigmas has not been detected.
constexpr double kSeenSigmas = 3.0;
/// Neighbouring residuals of noise are practically independent. In a train that leaves as much as
/// the noise again, three are correlated.
constexpr double kMostCorrelated = 3.0;

}  // namespace

Doubt doubt_of(const Identification& found, const sensors::Sensor& sensor) {
  for (const ParameterInfo& info : parameter_list(sensor.shape())) {
    if (info.kind != ParameterKind::train) continue;
    for (const int at : info.places) {
      try {
        check_bounds(info, sensor.train[at]);
      } catch (const InvalidArgument& error) {
        return {fmt::format("the train that fits best is not possible: {}", error.what()), true};
      }
    }
  }
  for (const FittedValue& value : fitted_values(found.best())) {
    // Held values determine how a deflection divides into wedge and glass, not whether it exists.
    const double sigma =
        std::isfinite(value.sigma_given_held) ? value.sigma_given_held : value.sigma;
    if (!value.name.starts_with("wedge_angle_") || !std::isfinite(sigma)) continue;
    if (std::abs(value.value) >= kSeenSigmas * sigma) continue;
    return {fmt::format("the train that fits best has a prism that the scan does not show: {} = "
                        "{:.3g} +- {:.2g} {}",
                        value.name, value.value, sigma, value.unit),
            false};
  }
  if (found.correlation_time_factor > kMostCorrelated) {
    return {fmt::format("the best train leaves residuals that are not noise: {:.0f} neighbouring "
                        "shots have the same error",
                        found.correlation_time_factor),
            false};
  }
  return {};
}

}  // namespace risley::identification
