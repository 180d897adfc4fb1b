// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Section 2.4 of the paper: the zero position of the prisms, Eq. (30) and the two combinations of
// speeds.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/optics/observation_model.hpp"

#include "reproduction/runs.hpp"

namespace risley::reproduction {
namespace {

/// Zenith where the ideal beam is bent most, over all pairs of rotation angles.
double largest_zenith(const PrismTrain& train) {
  constexpr int kSteps = 721;
  double largest = 0;
  for (int a = 0; a < kSteps; ++a) {
    for (int b = 0; b < kSteps; ++b) {
      const std::array angles{kTwoPi * a / (kSteps - 1), kTwoPi * b / (kSteps - 1)};
      const Observation shot = observe(train, angles);
      largest = std::max(largest, angles_from_direction(shot.direction).zenith);
    }
  }
  return largest;
}

Row at_digits(const char* term, const char* unit, const char* paper, double ours) {
  Row row{term, unit, printed(paper), ours};
  row.checks = {at_printed_digits(*row.paper, ours)};
  return row;
}

/// One second of a sensor in a combination, estimated from a sensor in the other one.
Row recognised(const ReproduceOptions& options, int combination, std::uint64_t draw) {
  simulation::SimulationSettings settings = unit_settings(options, draw);
  settings.truth = sensors::with_combination(options.unit, combination);
  settings.duration = 1.0;
  settings.rate = 10000.0;
  const bool first = combination == 1;
  const sensors::Sensor other = sensors::with_combination(options.type, first ? 2 : 1);
  const estimation::Estimate estimate =
      estimate_run(estimation::Method::map, simulate(settings), other, options.angle_noise);
  Row row{fmt::format("combination {} recognised from 1 s of directions", first ? 1 : 2), "1",
          printed(first ? "1" : "2"),
          estimate.sensor.combination ? static_cast<double>(*estimate.sensor.combination) : 0.0};
  row.checks = {holds("ours is the simulated one", row.ours == row.paper->value,
                      "the estimate started from the other one"),
                holds("the estimate converged", estimate.converged, estimate.reason)};
  return row;
}

}  // namespace

Reproduction zero_position(const ReproduceOptions& options) {
  Table table{"zero_position",
              "Sections 2.1 and 2.4: zero position, Eq. (30) and speeds",
              "The paper finds the zero position where the azimuth is about 0 and the zenith "
              "greatest. Here: the ideal model at rotation angles zero and over half a degree's "
              "grid of both, the presets' speeds, and the start of an estimation, which reads the "
              "combination off the spectrum.",
              {}};
  const PrismTrain ideal = options.type.train.without_errors();
  const std::array zero{0.0, 0.0};
  const auto at_zero = angles_from_direction(observe(ideal, zero).direction);
  const double largest = largest_zenith(ideal);
  table.rows.push_back(at_digits("zenith in the zero position", "deg", "109.2",
                                 degrees_from_radians(at_zero.zenith)));
  Row azimuth{"azimuth in the zero position", "deg", printed("0"),
              degrees_from_radians(at_zero.azimuth)};
  azimuth.checks = {within("ours", azimuth.ours, -1e-9, 1e-9, "all normals lie in one plane")};
  table.rows.push_back(azimuth);
  Row maximum = at_digits("largest zenith at any rotation angles", "deg", "109.2",
                          degrees_from_radians(largest));
  maximum.checks.push_back(at_most("ours less the zenith in the zero position",
                                   degrees_from_radians(largest - at_zero.zenith), 1e-9,
                                   "it is the maximum"));
  table.rows.push_back(maximum);
  Row field = at_digits("field of view (Table 1)", "deg", "38.4",
                        2.0 * (degrees_from_radians(largest) - 90.0));
  field.note = "The optics alone give the manufacturer's figure.";
  table.rows.push_back(field);

  const auto speed = [&](const sensors::Sensor& sensor, int prism) {
    return degrees_from_radians(sensor.angular_velocity[static_cast<std::size_t>(prism)]);
  };
  const sensors::Sensor first = sensors::with_combination(options.type, 1);
  const sensors::Sensor second = sensors::with_combination(options.type, 2);
  constexpr double kPerRpm = 6.0;  // deg/s
  table.rows.push_back(
      at_digits("speed of prism A, combination 1", "rpm", "-4,664", speed(first, 0) / kPerRpm));
  table.rows.push_back(
      at_digits("speed of prism B, combination 1", "rpm", "7,294", speed(first, 1) / kPerRpm));
  table.rows.push_back(
      at_digits("speed of prism A, combination 1 (Eq. 30)", "deg/s", "-27,984", speed(first, 0)));
  table.rows.push_back(
      at_digits("speed of prism B, combination 1 (Eq. 30)", "deg/s", "43,764", speed(first, 1)));
  table.rows.push_back(
      at_digits("speed of prism A, combination 2", "deg/s", "-43,764", speed(second, 0)));
  table.rows.push_back(
      at_digits("speed of prism B, combination 2", "deg/s", "27,984", speed(second, 1)));
  table.rows.push_back(at_digits("refractive index to start from (Eq. 30)", "1", "1.51",
                                 options.type.get("refractive_index")));
  table.rows.push_back(at_digits("wedge angle (section 2.3)", "deg", "18",
                                 degrees_from_radians(options.type.get("wedge_angle_deg"))));
  table.rows.push_back(recognised(options, 1, 900001));
  table.rows.push_back(recognised(options, 2, 900002));
  return {{table}, {}};
}

}  // namespace risley::reproduction
