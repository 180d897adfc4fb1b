// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/sensor.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/square.hpp"
#include "risley/sensors/prism_sizes.hpp"

namespace risley::sensors {
namespace {

/// The parameter of that name, which must be one a sensor has.
const ParameterInfo& find_sensor_parameter(std::string_view name, TrainShape shape) {
  const ParameterInfo& parameter = find_parameter(name, shape);
  if (parameter.kind == ParameterKind::rotation_angle) {
    throw InvalidArgument(
        fmt::format("{} belongs to a recording and is not a property of a sensor", name));
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

std::string to_string(Firing firing) { return firing == Firing::together ? "together" : "in_turn"; }

double Sensor::range_variance(double range, double tan_incidence, double intensity) const {
  return square(range_noise) + square(range_noise_per_range * range) +
         square(range_noise_incidence * tan_incidence) +
         square(range_noise_weak_return) / std::max(intensity, 1.0);
}

double Sensor::get(std::string_view parameter) const {
  const ParameterInfo& info = find_sensor_parameter(parameter, shape());
  if (info.kind == ParameterKind::train) return train.get(parameter);
  const std::size_t rotor = rotor_of(info);
  if (rotor >= angular_velocity.size()) {
    throw InvalidArgument(fmt::format("{} is not set for sensor \"{}\"", parameter, name));
  }
  return angular_velocity[rotor];
}

void Sensor::set(std::string_view parameter, double value) {
  const ParameterInfo& info = find_sensor_parameter(parameter, shape());
  check_bounds(info, value);
  if (info.kind == ParameterKind::angular_velocity) {
    angular_velocity.resize(static_cast<std::size_t>(prisms()), 0.0);
    angular_velocity[rotor_of(info)] = value;
    return;
  }
  train.set(parameter, value);
  if (info.places.size() > 1) return;
  // Prisms that stop being alike: knowledge of all becomes knowledge of each.
  for (const ParameterInfo& shared : parameter_list(shape())) {
    if (shared.kind != ParameterKind::train || shared.places.size() < 2) continue;
    if (std::find(shared.places.begin(), shared.places.end(), info.places.front()) ==
        shared.places.end()) {
      continue;
    }
    const Knowledge* known_of_all = find_knowledge(shared.name);
    if (known_of_all == nullptr) return;
    const Knowledge all = *known_of_all;
    std::erase_if(knowledge, [&](const Knowledge& entry) { return entry.name == all.name; });
    for (const ParameterInfo& own : parameter_list(shape())) {
      if (own.kind == ParameterKind::train && own.places.size() == 1 &&
          std::find(shared.places.begin(), shared.places.end(), own.places.front()) !=
              shared.places.end()) {
        set_knowledge({own.name, all.sigma, all.source, all.total_sigma});
      }
    }
    return;
  }
}

void Sensor::set_prism_geometry(const PrismGeometry& sizes) {
  face_positions(train.face_order(), sizes);  // rejects sizes that do not fit
  geometry = sizes;
  std::erase_if(knowledge, [](const Knowledge& entry) {
    return entry.name.starts_with("prism_thickness_") || entry.name.starts_with("prism_spacing_");
  });
  std::vector<Eigen::Index> kept;
  for (std::size_t i = 0; i < covariance_names.size(); ++i) {
    if (!find_prism_size(covariance_names[i], prisms()))
      kept.push_back(static_cast<Eigen::Index>(i));
  }
  if (kept.size() == covariance_names.size()) return;
  covariance = covariance(kept, kept).eval();
  std::erase_if(covariance_names, [&](const std::string& name) {
    return find_prism_size(name, prisms()).has_value();
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

namespace {

std::vector<SpeedCombination> combinations_of(const Sensor& sensor) {
  if (!sensor.combination || !sensor.combinations.empty()) return sensor.combinations;
  if (sensor.prisms() != 2 || sensor.angular_velocity.size() != 2) return {};
  const std::vector<double>& own = sensor.angular_velocity;
  std::vector<SpeedCombination> two{{own, {}}, {{-own[1], -own[0]}, {}}};
  if (*sensor.combination == 2) std::swap(two[0], two[1]);
  return two;
}

/// Permutation of the rotors between two combinations, and the changes of sense.
struct Place {
  std::size_t rotor = 0;
  double sign = 1;
};

/// [rotors of `to`]; empty if the speeds differ.
std::vector<Place> places_of(const std::vector<double>& from, const std::vector<double>& to) {
  std::vector<Place> places;
  std::vector<bool> taken(from.size(), false);
  for (const double speed : to) {
    std::size_t best = from.size();
    for (std::size_t k = from.size(); k-- > 0;) {
      const bool same_size =
          !taken[k] && std::abs(std::abs(from[k]) - std::abs(speed)) <= 1e-9 * std::abs(speed);
      // One that also keeps its sense is more likely.
      if (same_size && (best == from.size() || from[k] * speed >= 0)) best = k;
    }
    if (best == from.size()) return {};
    taken[best] = true;
    places.push_back({best, from[best] * speed < 0 ? -1.0 : 1.0});
  }
  return places;
}

std::string speed_name(std::size_t rotor) {
  return fmt::format("angular_velocity_{}_deg_per_s", prism_letter(static_cast<int>(rotor)));
}

/// A sensor whose speeds, face orders and covariance can be transferred to other rotors.
void require_combinations(const Sensor& sensor, const std::vector<SpeedCombination>& all) {
  const auto prisms = static_cast<std::size_t>(sensor.prisms());
  require_length("angular_velocity of the sensor", sensor.angular_velocity.size(), prisms);
  for (const SpeedCombination& one : all) {
    require_length("angular_velocity of a combination", one.angular_velocity.size(), prisms);
    require_length_or_none("face_order of a combination", one.face_order.size(), prisms);
  }
  const std::size_t names = sensor.covariance_names.size();
  require_length("a row of the covariance", static_cast<std::size_t>(sensor.covariance.cols()),
                 names);
  require_length("a column of the covariance", static_cast<std::size_t>(sensor.covariance.rows()),
                 names);
}

}  // namespace

Sensor with_combination(const Sensor& sensor, int combination) {
  const std::vector<SpeedCombination> all = combinations_of(sensor);
  const auto count = static_cast<int>(all.size());
  if (count == 0) {
    throw InvalidArgument(
        fmt::format("sensor \"{}\" has only one combination of speeds", sensor.name));
  }
  if (!sensor.combination) {
    throw InvalidArgument(fmt::format(
        "sensor \"{}\" does not say which of its {} combinations it is in", sensor.name, count));
  }
  require_combinations(sensor, all);
  for (const int number : {combination, *sensor.combination}) {
    if (number < 1 || number > count) {
      throw InvalidArgument(fmt::format("combination = {} of sensor \"{}\", allowed 1 to {}",
                                        number, sensor.name, count));
    }
  }
  Sensor other = sensor;
  if (*sensor.combination == combination) return other;
  const SpeedCombination& from = all[static_cast<std::size_t>(*sensor.combination - 1)];
  const SpeedCombination& to = all[static_cast<std::size_t>(combination - 1)];
  other.combination = combination;
  if (!to.face_order.empty() && to.face_order != sensor.train.face_order()) {
    other.train = PrismTrain(to.face_order, sensor.train.emitters());
    for (int at = 0; at < parameter_count(sensor.shape()); ++at) {
      other.train.set_place(at, sensor.train[at]);
    }
  }
  const std::vector<Place> places = places_of(from.angular_velocity, to.angular_velocity);
  if (places.empty()) {
    other.angular_velocity = to.angular_velocity;
    return other;
  }
  // The names change places, and a covariance with a negated quantity changes sign.
  const auto moved = [&](const std::string& name) -> std::optional<std::size_t> {
    for (std::size_t k = 0; k < places.size(); ++k) {
      if (speed_name(places[k].rotor) == name) return k;
    }
    return std::nullopt;
  };
  for (std::size_t k = 0; k < places.size(); ++k) {
    other.angular_velocity[k] = places[k].sign * sensor.angular_velocity[places[k].rotor];
  }
  for (Knowledge& entry : other.knowledge) {
    if (const auto rotor = moved(entry.name)) entry.name = speed_name(*rotor);
  }
  for (std::size_t i = 0; i < other.covariance_names.size(); ++i) {
    const auto rotor = moved(other.covariance_names[i]);
    if (!rotor) continue;
    other.covariance_names[i] = speed_name(*rotor);
    const auto at = static_cast<Eigen::Index>(i);
    other.covariance.row(at) *= places[*rotor].sign;
    other.covariance.col(at) *= places[*rotor].sign;
  }
  return other;
}

std::vector<Sensor> in_all_combinations(const Sensor& sensor) {
  std::vector<Sensor> sensors{sensor};
  const auto count = static_cast<int>(combinations_of(sensor).size());
  for (int number = 1; number <= count; ++number) {
    if (number != sensor.combination) sensors.push_back(with_combination(sensor, number));
  }
  return sensors;
}

}  // namespace risley::sensors
