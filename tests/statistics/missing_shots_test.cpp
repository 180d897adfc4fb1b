// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Recordings as people bring them: whole millimetres, returns from a part of the field only, tenths
// of a second, unknown noise. Random units, uneven rotors; the answer must be right or refused, and
// its sigmas and its noise must be true.
#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "risley/core/random.hpp"

#include "statistics/simulated.hpp"

namespace risley::missing_shots_test {

using recordings::Observations;

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

/// The directions as a record of whole millimetres in a hall holds them; a row without a return
/// holds nothing.
template <class Returns>
void as_millimetres(Observations& o, const Returns& returns) {
  constexpr double kStep = 0.001;
  for (std::size_t i = 0; i < o.size(); ++i) {
    const auto v = direction_from_angles<double>({o.azimuth[i], o.zenith[i]});
    if (!returns(o.azimuth[i], o.zenith[i], i)) {
      o.valid[i] = 0;
      o.azimuth[i] = o.zenith[i] = std::nan("");
      o.range[i] = 0;
      continue;
    }
    const double range = 3.0 / std::max(0.1, std::abs(v.y) + std::abs(v.z));
    const auto whole = [&](double value) { return kStep * std::round(range * value / kStep); };
    const Vector3<double> point{whole(v.x), whole(v.y), whole(v.z)};
    const auto angles = angles_from_direction(point);
    o.azimuth[i] = angles.azimuth;
    o.zenith[i] = angles.zenith;
    o.range[i] = norm(point);
    o.zenith_resolution[i] = static_cast<float>(kStep / o.range[i]);
    o.azimuth_resolution[i] = static_cast<float>(kStep / o.range[i] / std::sin(angles.zenith));
  }
}

estimation::Estimate estimate_found_noise(const Observations& observations, bool cartesian) {
  estimation::ShotSelector selector({.rate = {}, .ranges = cartesian, .rows = false});
  selector.add(observations);
  estimation::EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.cartesian = cartesian;
  return estimation::estimate(estimation::Method::map, selector.take_series(), selector.head(),
                              options);
}

/// NEES of the prisms' parameters per degree of freedom.
double nees(const estimation::Estimate& estimate, const sensors::Sensor& truth, double& largest) {
  Eigen::VectorXd error(estimate.parameters.size());
  for (std::size_t k = 0; k < estimate.free.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    error[at] = estimate.parameters[at] - truth.get(estimate.free[k].name);
    largest = std::max(largest, std::abs(error[at]) / std::sqrt(estimate.covariance(at, at)));
  }
  return error.dot(estimate.covariance.ldlt().solve(error)) / static_cast<double>(error.size());
}

TEST(MissingShots, RandomUnitsAreFoundInAnyPartOfTheField) {
  int right = 0, all = 0;
  double sum = 0;
  for (std::uint64_t seed = 0; seed < 24; ++seed) {
    const auto settings = random_unit(seed, seed % 4 == 0 ? 0.3 : 0.1);
    auto data = testing::simulate(settings);
    const RandomStream place(seed, 6);
    const double middle_azimuth = radians_from_degrees(8.0 * (2 * place.uniform(0) - 1));
    const double middle_zenith = kPi / 2 + radians_from_degrees(8.0 * (2 * place.uniform(1) - 1));
    as_millimetres(data.observations, [&](double azimuth, double zenith, std::size_t i) {
      switch (seed % 6) {
        case 0:
          return zenith > kPi / 2 + radians_from_degrees(2.0);
        case 1:
          return zenith < kPi / 2;
        case 2:
          return azimuth > 0;
        case 3:
          return std::abs(azimuth - middle_azimuth) < radians_from_degrees(6.0) &&
                 std::abs(zenith - middle_zenith) < radians_from_degrees(6.0);
        case 4:
          return place.uniform(10 + i) < 0.2;
        default:
          return true;
      }
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
