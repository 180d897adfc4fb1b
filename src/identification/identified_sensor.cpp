// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/identification/identified_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/optics/parameters.hpp"

namespace risley::identification {
namespace {

constexpr double kLikeSpeed = 0.03, kLikeDeviation = 0.03;
/// Tolerance in steps: the first shot is whole steps after the zero of the clock.
constexpr double kRoundStep = 1e-3;

/// Firing order of the emitters of a round that share a time, and their time steps.
struct Round {
  std::vector<int> emitter;  ///< place in the grid, of every place in the round
  double step = 0;           ///< between its shots, s
};

Round round_of(const Identification& identification) {
  const std::vector<double>& lag = identification.best().fit.model.lag;
  Round round;
  round.emitter.resize(lag.size());
  std::iota(round.emitter.begin(), round.emitter.end(), 0);
  std::sort(round.emitter.begin(), round.emitter.end(), [&](int a, int b) {
    return lag[static_cast<std::size_t>(a)] > lag[static_cast<std::size_t>(b)];
  });
  const auto [least, most] = std::minmax_element(lag.begin(), lag.end());
  round.step = (*most - *least) / static_cast<double>(lag.size() - 1);
  return round;
}

/// Sizes of the prisms assumed by presets if they are not known, m.
constexpr double kThickness = 0.007, kThicknessSigma = 0.005;
constexpr double kSpacing = 0.030, kSpacingSigma = 0.020;

const char* const kFound = "identified from the directions of a recording";

}  // namespace

IdentifiedSensor identified_sensor(const Identification& identification, const std::string& name,
                                   const sensors::Sensor& rest) {
  const Hypothesis& best = identification.best();
  const TrainModel& model = best.fit.model;
  const int prisms = model.train.prisms(), emitters = model.train.emitters();
  IdentifiedSensor result;
  sensors::Sensor& sensor = result.sensor;
  sensor = rest;
  sensor.name = name;
  sensor.manufacturer = "unknown";
  sensor.model = name;
  sensor.serial.clear();
  sensor.combination.reset();
  sensor.combinations.clear();
  sensor.knowledge.clear();
  sensor.covariance_names.clear();
  sensor.covariance.resize(0, 0);
  sensor.reference = sensors::CalibrationReference::none;
  sensor.device_type = 0;
  sensor.train = model.train;
  const bool all_around = model.train.layout().axis_up;
  sensor.geometry = {{kThickness}, {kSpacing}};
  if (all_around) sensor.geometry = {{0.0}, {0.0}};
  sensor.shot_rate = 1 / identification.step;
  sensors::ScanSequence sequence;
  std::vector<int> order(static_cast<std::size_t>(emitters));
  std::iota(order.begin(), order.end(), 0);
  bool repeatable = identification.timing != EmitterTiming::uneven;
  if (identification.timing == EmitterTiming::together) {
    const Round round = round_of(identification);
    const double every = identification.step / round.step;
    const auto decimation = static_cast<int>(std::lround(every));
    const auto first = std::find(round.emitter.begin(), round.emitter.end(), 0);
    const auto place = static_cast<int>(first - round.emitter.begin());
    // Row r is shot decimation (r + 1) - 1, whose place in its round must be that of row 0.
    repeatable = decimation > 0 && std::abs(every - decimation) < 0.02 * every &&
                 (decimation - 1) % emitters == place;
    for (int row = 0; repeatable && row < emitters; ++row) {
      const int shot = decimation * (row + 1) - 1;
      repeatable = round.emitter[static_cast<std::size_t>(shot % emitters)] == row;
    }
    if (repeatable) {
      result.decimation = decimation;
      order = round.emitter;
      sensor.shot_rate = decimation / identification.step;
      sequence.firing = sensors::Firing::together;
    }
  }
  for (int j = 0; j < emitters; ++j) {
    const int from = order[static_cast<std::size_t>(j)];
    sensor.train.set_place(place::incident_beam_horizontal(j, prisms),
                           model.train[place::incident_beam_horizontal(from, prisms)]);
    sensor.train.set_place(place::incident_beam_vertical(j, prisms),
                           model.train[place::incident_beam_vertical(from, prisms)]);
  }
  // The clock's own zero if the first shot is a whole number of steps after it.
  const double since_zero = 1e-9 * static_cast<double>(identification.grid.origin_ns);
  const double steps = since_zero * sensor.shot_rate - (result.decimation - 1);
  if (std::abs(steps - std::round(steps)) < kRoundStep && (steps > -0.5 && steps < 1.5)) {
    sequence.first_shot = static_cast<int>(std::lround(steps));
  }
  const double round_shots = sequence.firing == sensors::Firing::together ? emitters : 1;
  const double first_shot = result.decimation - 1;
  // The time to which the rotors of the first row refer in the sequence.
  const double rotor_time = sequence.firing == sensors::Firing::together
                                ? (sequence.first_shot + std::floor(first_shot / emitters)) *
                                      round_shots / sensor.shot_rate
                                : (sequence.first_shot + first_shot) / sensor.shot_rate;
  sensor.angular_velocity.clear();
  for (int k = 0; k < prisms; ++k) {
    const double speed = model.rotors.mean_angular_velocity(k);
    sensor.angular_velocity.push_back(speed);
    const double angle = model.rotors.angle(k, model.lag.front());
    sequence.rotation_angle.push_back(wrap_to_pi(angle - speed * rotor_time));
  }
  sensor.sequence.reset();
  if (repeatable) sensor.sequence = sequence;

  double widest = all_around ? kPi : 0;
  for (std::size_t i = 0; i < identification.grid.size(); ++i) {
    const double azimuth = identification.grid.azimuth[i] - model.frame.yaw;
    const double elevation = 0.5 * kPi - identification.grid.zenith[i] + model.frame.pitch;
    widest = std::max(widest, std::acos(std::cos(azimuth) * std::cos(elevation)));
  }
  sensor.field_of_view = 2 * widest;
  sensor.pointing_tolerance = 0;  // none is specified
  sensor.angle_noise = best.fit.rms;

  const auto sigma_of = [&](const std::string& parameter) -> std::optional<double> {
    for (std::size_t i = 0; i < best.fit.names.size(); ++i) {
      if (best.fit.names[i] != parameter) continue;
      const auto at = static_cast<Eigen::Index>(i);
      return std::sqrt(std::max(0.0, best.total_covariance(at, at)));
    }
    return {};
  };
  for (const ParameterInfo& info : parameter_list(sensor.shape())) {
    if (info.kind == ParameterKind::rotation_angle) continue;
    if (info.kind == ParameterKind::train && info.places.size() > 1) continue;
    std::string fitted = info.name;
    if (info.kind == ParameterKind::train) {
      const int emitter = place::emitter(info.places.front(), prisms);
      if (emitter >= 0 && emitters > 1) {  // as the grid counts them
        fitted.replace(fitted.find('_', 14) - 1, 1,
                       std::to_string(order[static_cast<std::size_t>(emitter)] + 1));
      }
    }
    const std::optional<double> sigma = sigma_of(fitted);
    if (sigma && !std::isfinite(*sigma)) {
      sensor.set_knowledge(
          {info.name, 0, "glass assumed to be the same as that of the other prisms"});
      continue;
    }
    sensor.set_knowledge({info.name, sigma.value_or(0.0), sigma ? kFound : "held by convention"});
  }
  sensor.set_knowledge({"angle_noise_deg", 0, fmt::format("residuals, {}", kFound)});
  sensor.set_knowledge(
      {"field_of_view_deg", 0,
       fmt::format("{}, {}", all_around ? "all around" : "the widest shot", kFound)});
  for (const auto& [size, sigma] : {std::pair{"prism_thickness_m", kThicknessSigma},
                                    std::pair{"prism_spacing_m", kSpacingSigma}}) {
    sensor.set_knowledge(
        {size, all_around ? 0.0 : sigma,
         fmt::format("assumed, as of a Mid-{}: directions do not show it", all_around ? 360 : 40)});
  }
  sensor.set_knowledge({"shot_rate_hz", 0, fmt::format("times of the shots, {}", kFound)});
  for (const char* assumed :
       {"range_noise_m", "range_resolution_m", "angle_resolution_deg", "range_minimum_m",
        "range_maximum_m", "beam_divergence_horizontal_deg", "beam_divergence_vertical_deg"}) {
    sensor.set_knowledge(
        {assumed, 0, fmt::format("assumed, as for {}: directions do not show it", rest.name)});
  }
  return result;
}

std::optional<Likeness> likeness(const Identification& identification,
                                 const sensors::Sensor& known) {
  const Hypothesis& best = identification.best();
  std::vector<const Hypothesis*> same{&best};
  for (const std::size_t other : best.equivalent_to) {
    same.push_back(&identification.hypotheses[other]);
  }
  std::optional<Likeness> found;
  for (const Hypothesis* one : same) {
    if (one->train().face_order() != known.train.face_order()) continue;
    for (const bool mirrored : {false, true}) {
      double worst = 0;
      for (int k = 0; k < known.prisms(); ++k) {
        const double speed = one->fit.model.rotors.mean_angular_velocity(k) * (mirrored ? -1 : 1);
        const double nominal = known.angular_velocity[static_cast<std::size_t>(k)];
        const auto deviation = [k](const PrismTrain& train) {
          return (train[place::refractive_index(k)] - 1) * train[place::wedge_angle(k)];
        };
        worst = std::max(worst, std::abs(speed / nominal - 1) / kLikeSpeed);
        if (known.train.layout().kind[k] == ElementKind::wedge) {
          const int face = place::prism_tilt_vertical(k);
          worst = std::max(worst,
                           std::abs(one->train()[face] / known.train[face] - 1) / kLikeDeviation);
        }
        worst = std::max(
            worst, std::abs(deviation(one->train()) / deviation(known.train) - 1) / kLikeDeviation);
      }
      if (worst <= 1 && (!found || worst < found->worst)) found = Likeness{mirrored, worst};
    }
  }
  return found;
}

}  // namespace risley::identification
