// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "statistics/simulated.hpp"

namespace risley::testing {

/// Root mean square errors and mean NEES over seeds. Angles in degrees, parameters in file units.
struct MonteCarlo {
  std::map<std::string, double> rmse, sigma;  ///< of the parameters; sigma: root mean square
  double angle_a_deg = 0, angle_b_deg = 0;
  double angle_ratio = 0, speed_ratio = 0;  ///< errors over stated sigmas, both rotors
  double nees_parameters = 0, nees_angles = 0;
  double residual_std_deg = 0;
  double within_two_sigma = 0;

  /// Errors over sigmas of the prisms' parameters: root mean square, and the largest.
  double parameter_ratio = 0, largest_parameter_ratio = 0;
};

inline bool is_prism_parameter(const std::string& name) {
  return find_parameter(name, {2}).kind == ParameterKind::train;
}

/// Simulates and estimates for every seed and gathers the errors; expects each run to converge in
/// the right speed combination and not mirrored. What was measured is recorded with the test:
/// --gtest_output=json:FILE shows it.
/// @param settings_of  simulation of a seed
/// @param change       what happens to the recording before it is estimated
inline MonteCarlo monte_carlo(
    estimation::Method method, int seeds,
    const std::function<simulation::SimulationSettings(std::uint64_t)>& settings_of,
    const std::vector<estimation::RotorProcess>& process = {},
    const std::function<void(recordings::Observations&, std::uint64_t)>& change = {}) {
  MonteCarlo sum;
  double angle_a = 0, angle_b = 0, covered = 0, counted = 0, angles = 0, speeds = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    const auto number = static_cast<std::uint64_t>(seed);
    const auto settings = settings_of(number);
    Simulated data = simulate(settings);
    if (change) change(data.observations, number);
    const double noise_deg = degrees_from_radians(*settings.angle_noise);
    const auto estimate = testing::estimate(method, data.observations, noise_deg, process);
    EXPECT_TRUE(estimate.converged) << "seed " << seed << ": " << estimate.reason;
    EXPECT_EQ(estimate.sensor.combination, settings.truth.combination) << "seed " << seed;
    EXPECT_FALSE(estimate.mirrored) << "seed " << seed;
    const auto evaluation = evaluate(estimate, settings.truth, data.truth);
    for (std::size_t i = 0; i < evaluation.parameters.size(); ++i) {
      const auto& row = evaluation.parameters[i];
      const double unit = find_parameter(row.name, {2}).si_per_unit;
      sum.rmse[row.name] += std::pow(row.error / unit, 2);
      sum.sigma[row.name] += std::pow(estimate.values[i].sigma_given_held / unit, 2);
      covered += std::abs(row.error_over_sigma) < 2.0;
      counted += 1.0;
    }
    angle_a += std::pow(degrees_from_radians(evaluation.rotation_angle_rmse[0]), 2);
    angle_b += std::pow(degrees_from_radians(evaluation.rotation_angle_rmse[1]), 2);
    for (std::size_t k = 0; k < 2; ++k) {
      angles += std::pow(evaluation.rotation_angle_rmse_over_sigma[k], 2);
      speeds += std::pow(evaluation.angular_velocity_rmse_over_sigma[k], 2);
    }
    sum.nees_parameters += evaluation.nees_parameters;
    sum.nees_angles += evaluation.nees_rotation_angles;
    sum.residual_std_deg += degrees_from_radians(estimate.azimuth_moments.std);
  }
  double squares = 0, parameters = 0;
  for (auto& [name, value] : sum.rmse) {
    value = std::sqrt(value / seeds);
    sum.sigma[name] = std::sqrt(sum.sigma[name] / seeds);
    if (!is_prism_parameter(name)) continue;
    const double ratio = value / sum.sigma[name];
    squares += ratio * ratio;
    parameters += 1.0;
    sum.largest_parameter_ratio = std::max(sum.largest_parameter_ratio, ratio);
  }
  sum.parameter_ratio = std::sqrt(squares / parameters);
  sum.angle_a_deg = std::sqrt(angle_a / seeds);
  sum.angle_b_deg = std::sqrt(angle_b / seeds);
  sum.angle_ratio = std::sqrt(angles / (2.0 * seeds));
  sum.speed_ratio = std::sqrt(speeds / (2.0 * seeds));
  sum.nees_parameters /= seeds;
  sum.nees_angles /= seeds;
  sum.residual_std_deg /= seeds;
  sum.within_two_sigma = covered / counted;
  const auto record = [](const std::string& name, double value) {
    ::testing::Test::RecordProperty(name, fmt::format("{:.4g}", value));
  };
  for (const auto& [name, value] : sum.rmse) record("rmse_" + name, value);
  record("rotation_angle_a_deg", sum.angle_a_deg);
  record("rotation_angle_b_deg", sum.angle_b_deg);
  record("angle_error_over_sigma", sum.angle_ratio);
  record("speed_error_over_sigma", sum.speed_ratio);
  record("parameter_error_over_sigma", sum.parameter_ratio);
  record("largest_parameter_error_over_sigma", sum.largest_parameter_ratio);
  record("nees_parameters", sum.nees_parameters);
  record("nees_rotation_angles", sum.nees_angles);
  record("residual_std_deg", sum.residual_std_deg);
  record("within_two_sigma", sum.within_two_sigma);
  return sum;
}

}  // namespace risley::testing
