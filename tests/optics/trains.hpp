// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <random>
#include <string>
#include <vector>

#include "risley/core/angle.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley::testing {

/// All four configurations of Fig. 3 and all eight trains of three prisms.
inline std::vector<std::string> all_face_orders() {
  return {"PA-PA",    "PA-AP",    "AP-AP",    "AP-PA",    "PA-PA-PA", "PA-PA-AP",
          "PA-AP-PA", "PA-AP-AP", "AP-PA-PA", "AP-PA-AP", "AP-AP-PA", "AP-AP-AP"};
}

/// A train with every parameter off its ideal value: errors N(0, sigma), and each prism its own
/// glass and wedge.
inline PrismTrain imperfect_train(const std::string& face_order, double error_sigma_deg,
                                  unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  PrismTrain train(parse_face_order(face_order));
  const bool three = train.prisms() > 2;
  for (const ParameterInfo& parameter : parameter_list(train.shape())) {
    if (parameter.kind != ParameterKind::train || parameter.places.size() > 1) continue;
    double value = train.get(parameter.name);
    if (parameter.name == "refractive_index_air") {
      value = 1.000273;
    } else if (parameter.unit == "1") {
      value += 0.003 * normal(generator);
    } else if (parameter.name.starts_with("wedge")) {
      value = (three ? 0.6 : 1.0) * value + radians_from_degrees(0.1 * normal(generator));
    } else {
      value += radians_from_degrees(error_sigma_deg * normal(generator));
    }
    train.set(parameter.name, value);
  }
  return train;
}

/// Rotation angles uniform over the circle.
inline std::vector<double> random_angles(int prisms, std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(0.0, kTwoPi);
  std::vector<double> angles;
  for (int i = 0; i < prisms; ++i) angles.push_back(uniform(generator));
  return angles;
}

}  // namespace risley::testing
