// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/free_parameters.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"

namespace risley::estimation {

bool one_glass(const PrismTrain& train) {
  for (int i = 1; i < train.prisms(); ++i) {
    if (train[place::refractive_index(i)] != train[place::refractive_index(0)]) return false;
  }
  return true;
}

std::vector<std::string> default_free_names(TrainShape shape, bool one_glass) {
  const int prisms = shape.prisms;
  std::vector<std::string> names;
  if (one_glass) names.emplace_back("refractive_index");
  for (int i = 0; !one_glass && i < prisms; ++i) {
    names.push_back(fmt::format("refractive_index_{}", prism_letter(i)));
  }
  for (const ParameterInfo& info : parameter_list(shape)) {
    if (info.name.starts_with("incident_beam")) names.push_back(info.name);
  }
  if (shape.prisms.reflects()) {
    // A row of emitters determines every angle but one: the vertical tilt of the reflector cannot
    // be separated from glass, mirror and entrance face.
    const std::string held = fmt::format("prism_tilt_{}_vertical_deg", prism_letter(prisms - 1));
    for (const ParameterInfo& info : parameter_list(shape)) {
      const bool is_angle = info.kind == ParameterKind::train && info.unit == "deg";
      if (is_angle && info.name != held && !info.name.starts_with("incident_beam")) {
        names.push_back(info.name);
      }
    }
    return names;
  }
  for (int i = 0; i + 1 < prisms; ++i) {
    names.push_back(fmt::format("bearing_tilt_{}_horizontal_deg", prism_letter(i)));
    names.push_back(fmt::format("bearing_tilt_{}_vertical_deg", prism_letter(i)));
  }
  for (int i = 0; i + 1 < prisms; ++i) {
    if (shape.emitters > 1) {
      names.push_back(fmt::format("prism_tilt_{}_horizontal_deg", prism_letter(i)));
    }
    names.push_back(fmt::format("prism_tilt_{}_vertical_deg", prism_letter(i)));
  }
  names.push_back(fmt::format("prism_tilt_{}_horizontal_deg", prism_letter(prisms - 1)));
  names.push_back(fmt::format("prism_tilt_{}_vertical_deg", prism_letter(prisms - 1)));
  return names;
}

std::vector<FreeParameter> free_parameters(const std::vector<std::string>& names,
                                           TrainShape shape) {
  constexpr double kIndexSigma = 0.01;
  constexpr double kAngleSigma = radians_from_degrees(1.0);
  std::vector<FreeParameter> free;
  std::vector<int> taken;
  for (const std::string& name : names) {
    const ParameterInfo& info = find_parameter(name, shape);
    if (info.kind != ParameterKind::train) {
      throw InvalidArgument(fmt::format(
          "{} is always estimated and cannot be chosen, choose among the prisms' parameters",
          name));
    }
    for (const int at : info.places) {
      if (std::find(taken.begin(), taken.end(), at) != taken.end()) {
        throw InvalidArgument(fmt::format("{} is already free under another name", name));
      }
      taken.push_back(at);
    }
    free.push_back({name, info.places, info.unit == "1" ? kIndexSigma : kAngleSigma});
  }
  return free;
}

bool takes_place(const std::vector<FreeParameter>& parameters, int place) {
  return std::any_of(parameters.begin(), parameters.end(), [place](const FreeParameter& one) {
    return std::find(one.places.begin(), one.places.end(), place) != one.places.end();
  });
}

std::vector<FreeParameter> uncertain_held(const sensors::Sensor& sensor,
                                          const std::vector<FreeParameter>& free) {
  std::vector<FreeParameter> held;
  for (const ParameterInfo& info : parameter_list(sensor.shape())) {
    if (info.kind != ParameterKind::train) continue;
    const sensors::Knowledge* known = sensor.find_knowledge(info.name);
    if (known == nullptr || known->name != info.name || !(known->sigma > 0)) continue;
    const bool is_free = std::any_of(info.places.begin(), info.places.end(),
                                     [&](int place) { return takes_place(free, place); });
    if (!is_free) held.push_back({info.name, info.places, known->sigma});
  }
  return held;
}

Eigen::VectorXd free_values(const PrismTrain& train, const std::vector<FreeParameter>& free) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(free.size()));
  for (std::size_t i = 0; i < free.size(); ++i) {
    values[static_cast<Eigen::Index>(i)] = train[free[i].places.front()];
  }
  return values;
}

PrismTrain with_free_values(PrismTrain train, const std::vector<FreeParameter>& free,
                            const Eigen::VectorXd& values) {
  require_length("values", static_cast<std::size_t>(values.size()), free.size());
  for (std::size_t i = 0; i < free.size(); ++i) {
    for (const int at : free[i].places) train.set_place(at, values[static_cast<Eigen::Index>(i)]);
  }
  return train;
}

double prior_chi2(const std::vector<FreeParameter>& free, const Eigen::VectorXd& offset) {
  require_length("offset", static_cast<std::size_t>(offset.size()), free.size());
  double chi2 = 0;
  for (Eigen::Index i = 0; i < offset.size(); ++i) {
    chi2 += std::pow(offset[i] / free[static_cast<std::size_t>(i)].prior_sigma, 2);
  }
  return chi2;
}

}  // namespace risley::estimation
