// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <random>
#include <string>
#include <vector>

#include "risley/core/angle.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley::testing {

/// All four configurations of Fig. 3, all eight trains of three prisms, and a wedge with a
/// reflector.
inline std::vector<std::string> all_face_orders() {
  return {"PA-PA",    "PA-AP",    "AP-AP",    "AP-PA",    "PA-PA-PA", "PA-PA-AP", "PA-AP-PA",
          "PA-AP-AP", "AP-PA-PA", "AP-PA-AP", "AP-AP-PA", "AP-AP-AP", "AA-PMU"};
}

/// Those whose beams start elsewhere than at the origin.
inline std::vector<std::string> refracting_face_orders() {
  std::vector<std::string> orders = all_face_orders();
  orders.pop_back();
  return orders;
}

/// A train with every parameter off its ideal value: errors N(0, sigma), and each prism its own
/// glass and wedge. Several emitters stand 0.9 degrees apart.
inline PrismTrain imperfect_train(const std::string& face_order, double error_sigma_deg,
                                  unsigned seed, int emitters = 1) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  PrismTrain train(parse_face_order(face_order), emitters);
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
  for (int j = 1; j < emitters; ++j) {
    const int at = place::incident_beam_vertical(j, train.prisms());
    train.set_place(at, train[at] + radians_from_degrees(0.9 * j));
  }
  return train;
}

/// Where a shot points in the train's frame, whose X is the axis of rotation.
inline Vector3<double> along_axis(const PrismTrain& train, const Vector3<double>& direction) {
  return train.layout().axis_up ? in_train_frame<kWedgeAndReflector>(direction) : direction;
}

/// Thickness and spacing, none where an element reflects.
inline PrismGeometry some_geometry(const PrismTrain& train) {
  return train.layout().reflects() ? PrismGeometry{} : PrismGeometry{{0.007}, {0.03}};
}

/// The train that one emitter sees.
inline PrismTrain train_of_emitter(const PrismTrain& train, int beam) {
  PrismTrain own(train.face_order());
  for (int at = 0; at < parameter_count(train.prisms()); ++at) own.set_place(at, train[at]);
  own.set_place(place::incident_beam_horizontal(),
                train[place::incident_beam_horizontal(beam, train.prisms())]);
  own.set_place(place::incident_beam_vertical(),
                train[place::incident_beam_vertical(beam, train.prisms())]);
  return own;
}

/// Where a place of the whole flat vector is in the vector that one emitter sees, or -1.
inline int place_of_emitter(int at, int beam, int prisms) {
  const int emitter = place::emitter(at, prisms);
  if (emitter < 0) return at;
  if (emitter != beam) return -1;
  return at - place::incident_beam_horizontal(beam, prisms) + place::incident_beam_horizontal();
}

/// Rotation angles uniform over the circle.
inline std::vector<double> random_angles(int prisms, std::mt19937& generator) {
  std::uniform_real_distribution<double> uniform(0.0, kTwoPi);
  std::vector<double> angles;
  for (int i = 0; i < prisms; ++i) angles.push_back(uniform(generator));
  return angles;
}

}  // namespace risley::testing
