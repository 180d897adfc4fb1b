// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/sensor.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace risley::sensors {
namespace {

/// The parameter of that name, which must be one a sensor has.
const ParameterInfo& find_sensor_parameter(std::string_view name, int prisms) {
  const ParameterInfo& parameter = find_parameter(name, prisms);
  if (parameter.kind == ParameterKind::rotation_angle) {
    throw InvalidArgument(
        fmt::format("{} belongs to a recording and is no property of a sensor", name));
  }
  return parameter;
}

std::size_t rotor_of(const ParameterInfo& parameter) {
  return static_cast<std::size_t>(parameter.places.front());
}

}  // namespace

std::string to_string(CalibrationReference reference) {
  switch (reference) {
    case CalibrationReference::none:
      return "none";
    case CalibrationReference::directions:
      return "directions";
    case CalibrationReference::planes:
      return "planes";
  }
  return {};
}

double Sensor::range_variance(double range, double tan_incidence, double intensity) const {
  const auto square = [](double x) { return x * x; };
  return square(range_noise) + square(range_noise_per_range * range) +
         square(range_noise_incidence * tan_incidence) +
         square(range_noise_weak_return) / std::max(intensity, 1.0);
}

double Sensor::get(std::string_view parameter) const {
  const ParameterInfo& info = find_sensor_parameter(parameter, prisms());
  if (info.kind == ParameterKind::train) return train.get(parameter);
  const std::size_t rotor = rotor_of(info);
  if (rotor >= angular_velocity.size()) {
    throw InvalidArgument(fmt::format("{} is not set for sensor \"{}\"", parameter, name));
  }
  return angular_velocity[rotor];
}

void Sensor::set(std::string_view parameter, double value) {
  const ParameterInfo& info = find_sensor_parameter(parameter, prisms());
  check_bounds(info, value);
  if (info.kind == ParameterKind::angular_velocity) {
    angular_velocity.resize(static_cast<std::size_t>(prisms()), 0.0);
    angular_velocity[rotor_of(info)] = value;
    return;
  }
  train.set(parameter, value);
  if (info.places.size() > 1) return;
  // Prisms that stop being alike: what was known of all is now known of each.
  for (const ParameterInfo& shared : parameter_list(prisms())) {
    if (shared.kind != ParameterKind::train || shared.places.size() < 2) continue;
    if (std::find(shared.places.begin(), shared.places.end(), info.places.front()) ==
        shared.places.end()) {
      continue;
    }
    const Knowledge* known_of_all = find_knowledge(shared.name);
    if (known_of_all == nullptr) return;
    const Knowledge all = *known_of_all;
    std::erase_if(knowledge, [&](const Knowledge& entry) { return entry.name == all.name; });
    for (const ParameterInfo& own : parameter_list(prisms())) {
      if (own.kind == ParameterKind::train && own.places.size() == 1 &&
          std::find(shared.places.begin(), shared.places.end(), own.places.front()) !=
              shared.places.end()) {
        set_knowledge({own.name, all.sigma, all.source});
      }
    }
    return;
  }
}

void Sensor::set_prism_geometry(const PrismGeometry& geometry) {
  prism_thickness = geometry.thickness;
  prism_spacing = geometry.spacing;
  std::erase_if(knowledge, [](const Knowledge& entry) {
    return entry.name == "prism_thickness_m" || entry.name == "prism_spacing_m";
  });
}

const Knowledge* Sensor::find_knowledge(std::string_view parameter) const {
  const auto found =
      std::find_if(knowledge.begin(), knowledge.end(),
                   [parameter](const Knowledge& entry) { return entry.name == parameter; });
  return found == knowledge.end() ? nullptr : &*found;
}

void Sensor::set_knowledge(Knowledge entry) {
  for (Knowledge& old : knowledge) {
    if (old.name == entry.name) {
      old = std::move(entry);
      return;
    }
  }
  knowledge.push_back(std::move(entry));
}

Sensor with_combination(const Sensor& sensor, SpeedCombination combination) {
  if (!sensor.combination || sensor.prisms() != 2 || sensor.angular_velocity.size() != 2) {
    throw InvalidArgument(
        fmt::format("sensor \"{}\" has only one combination of speeds", sensor.name));
  }
  Sensor other = sensor;
  if (*sensor.combination == combination) return other;
  other.combination = combination;
  other.angular_velocity = {-sensor.angular_velocity[1], -sensor.angular_velocity[0]};
  // The two names change places, and a covariance with a negated quantity changes sign.
  const std::string first = "angular_velocity_a_deg_per_s", second = "angular_velocity_b_deg_per_s";
  const auto exchange = [&](std::string& name) {
    if (name == first) {
      name = second;
    } else if (name == second) {
      name = first;
    } else {
      return false;
    }
    return true;
  };
  for (Knowledge& entry : other.knowledge) exchange(entry.name);
  for (std::size_t i = 0; i < other.covariance_names.size(); ++i) {
    if (!exchange(other.covariance_names[i])) continue;
    const auto at = static_cast<Eigen::Index>(i);
    other.covariance.row(at) *= -1.0;
    other.covariance.col(at) *= -1.0;
  }
  return other;
}

}  // namespace risley::sensors
