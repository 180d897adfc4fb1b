// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Recordings as people bring them: whole millimetres, returns from a part of the field only, tenths
// of a second, unknown noise. Random units, uneven rotors; the answer must be right or refused, and
// its sigmas and its noise must be true.
#include <cmath>

#include <gtest/gtest.h>

#include "risley/core/random.hpp"

#include "statistics/sky.hpp"

namespace risley::missing_shots_test {

using testing::as_millimetres;
using testing::estimate_found_noise;
using testing::nees;

simulation::SimulationSettings random_unit(std::uint64_t seed, double duration) {
  simulation::SimulationSettings settings;
  const RandomStream stream(seed, 5);
  settings.truth = sensors::load_sensor(stream.uniform(0) < 0.5 ? "mid-40" : "mid-40-reversed");
  std::uint64_t number = 1;
  for (const std::string& name : estimation::default_free_names({2})) {
    const double sigma = name == "refractive_index" ? 0.001 : radians_from_degrees(0.3);
    settings.truth.set(name, settings.truth.get(name) + sigma * stream.normal(number++));
  }
  for (double& speed : settings.truth.angular_velocity) {
    speed *= 1.0 + 0.01 * (2.0 * stream.uniform(100 + number++) - 1.0);
  }
  settings.duration = duration;
  settings.rate = 100000.0;
  settings.angle_noise = radians_from_degrees(0.001);
  settings.quantize = false;
  settings.rotor = simulation::RotorKind::hunting;
  settings.seed = seed;
  return settings;
}

TEST(MissingShots, RandomUnitsAreFoundInAnyPartOfTheField) {
  int right = 0, all = 0;
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const auto settings = random_unit(seed, seed % 4 == 0 ? 0.3 : 0.1);
    auto data = testing::simulate(settings);
    const testing::Sky sky(seed);
    as_millimetres(data.observations, [&](double azimuth, double zenith, std::size_t i) {
      return sky.returns(azimuth, zenith, i);
    });
    SCOPED_TRACE(seed);
    ++all;
    try {
      const auto estimate = estimate_found_noise(data.observations, true);
      if (!estimate.converged) continue;  // refused
      EXPECT_EQ(estimate.sensor.combination, settings.truth.combination);
      EXPECT_FALSE(estimate.mirrored);
      double largest = 0;
      sum += nees(estimate, settings.truth, largest);
      EXPECT_LT(largest, 4.5);
      ++right;
    } catch (const EstimationError&) {  // refused
    }
  }
  EXPECT_GE(right, all - 1);
  EXPECT_GT(sum / right, 0.6);
  EXPECT_LT(sum / right, 1.5);
  RecordProperty("nees_parameters", std::to_string(sum / right));
}

TEST(FoundNoise, IsTrueOverTwoDecadesAndSoAreTheSigmas) {
  double sum = 0, squares = 0, largest_noise = 0;
  constexpr std::uint64_t kSeeds = 24;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    auto settings = random_unit(seed, 0.5);
    const double decades = static_cast<double>(seed) / static_cast<double>(kSeeds - 1);
    settings.angle_noise = radians_from_degrees(0.0005 * std::pow(100.0, decades));
    settings.quantize = seed % 2 == 1;
    const auto data = testing::simulate(settings);
    const auto estimate = estimate_found_noise(data.observations, false);
    SCOPED_TRACE(seed);
    ASSERT_TRUE(estimate.converged) << estimate.reason;
    for (const auto& [value, sigma] :
         {std::pair(estimate.noise.value.azimuth, estimate.noise.sigma.azimuth),
          std::pair(estimate.noise.value.zenith, estimate.noise.sigma.zenith)}) {
      const double z = (value - *settings.angle_noise) / sigma;
      squares += z * z;
      largest_noise = std::max(largest_noise, std::abs(z));
    }
    double largest = 0;
    sum += nees(estimate, settings.truth, largest);
  }
  EXPECT_LT(largest_noise, 4.0);
  EXPECT_NEAR(squares / (2.0 * kSeeds), 1.0, 0.5);
  EXPECT_GT(sum / kSeeds, 0.7);
  EXPECT_LT(sum / kSeeds, 1.35);
  RecordProperty("nees_parameters", std::to_string(sum / kSeeds));
}

}  // namespace risley::missing_shots_test
