// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/fitted_values.hpp"

#include <algorithm>
#include <cmath>

#include "risley/core/angle.hpp"

namespace risley::identification {

std::vector<FittedValue> fitted_values(const Hypothesis& hypothesis) {
  const TrainFit& fit = hypothesis.fit;
  const TrainShape shape = hypothesis.train().shape();
  std::vector<FittedValue> values;
  for (const ParameterInfo& info : parameter_list(shape)) {
    if (info.kind == ParameterKind::train && info.places.size() > 1) continue;
    double value = 0;
    const int place = info.places.front();
    const RotorCurves& rotors = fit.model.rotors;
    if (info.kind == ParameterKind::train) {
      value = hypothesis.train()[place];
    } else if (info.kind == ParameterKind::angular_velocity) {
      value = rotors.mean_angular_velocity(place);
    } else {
      value = wrap_to_pi(rotors.angle(place, rotors.begin));
    }
    const auto at = std::find(fit.names.begin(), fit.names.end(), info.name);
    const auto row = static_cast<Eigen::Index>(at - fit.names.begin());
    // Parameters held at zero are not results.
    if (at == fit.names.end() && info.kind == ParameterKind::train && value == 0) continue;
    const auto sigma = [&](const Eigen::MatrixXd& covariance) {
      if (row >= covariance.rows()) return std::nan("");
      return std::sqrt(std::max(0.0, covariance(row, row))) / info.si_per_unit;
    };
    values.push_back({info.name, info.unit, value / info.si_per_unit,
                      sigma(hypothesis.total_covariance), sigma(fit.covariance)});
  }
  return values;
}

}  // namespace risley::identification
