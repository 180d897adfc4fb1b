// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The batch estimator against the Cramer-Rao bound: errors as small as the data allow, sigmas that
// say so, at 1 kHz and at the sensor's full rate, among outliers and gaps and in correlated noise.
#include <cmath>

#include <gtest/gtest.h>

#include "risley/core/random.hpp"
#include "risley/simulation/noise.hpp"

#include "seeds.hpp"
#include "statistics/monte_carlo.hpp"

namespace risley::map_test {

using estimation::Method;
using testing::monte_carlo;
using testing::MonteCarlo;
using testing::table3_settings;

/// Section 3.2 of the paper at the sensor's full rate.
simulation::SimulationSettings full_rate(std::uint64_t seed) {
  auto settings = table3_settings(seed);
  settings.rate = 100000.0;
  return settings;
}

/// Keeps the rows for which keep(row) holds.
template <class Keep>
void filter_rows(recordings::Observations& o, const Keep& keep) {
  recordings::Observations kept;
  kept.resize(o.size());
  std::size_t n = 0;
  for (std::size_t i = 0; i < o.size(); ++i) {
    if (!keep(i)) continue;
    kept.time_ns[n] = o.time_ns[i];
    kept.azimuth[n] = o.azimuth[i];
    kept.zenith[n] = o.zenith[i];
    kept.azimuth_resolution[n] = o.azimuth_resolution[i];
    kept.zenith_resolution[n] = o.zenith_resolution[i];
    kept.valid[n++] = o.valid[i];
  }
  kept.resize(n);
  o = std::move(kept);
}

/// Turns a share of the shots into directions anywhere in the field of view.
void add_gross_errors(recordings::Observations& o, double share, std::uint64_t seed) {
  const RandomStream choice(seed, 71), azimuth(seed, 72), zenith(seed, 73);
  for (std::size_t i = 0; i < o.size(); ++i) {
    if (choice.uniform(i) > share) continue;
    o.azimuth[i] = 0.33 * (2.0 * azimuth.uniform(i) - 1.0);
    o.zenith[i] = kPi / 2 + 0.33 * (2.0 * zenith.uniform(i) - 1.0);
  }
}

TEST(Map, Table3AtOneKilohertzReachesTheBound) {
  const MonteCarlo result = monte_carlo(Method::map, 20, table3_settings);
  EXPECT_LE(result.parameter_ratio, 1.15);
  EXPECT_GE(result.parameter_ratio, 0.85) << "sigmas that are too large are not honest either";
  EXPECT_LE(result.largest_parameter_ratio, 1.5);
  EXPECT_GE(result.nees_parameters, 0.75);
  EXPECT_LE(result.nees_parameters, 1.3);
  EXPECT_GE(result.within_two_sigma, 0.92);
  EXPECT_LE(result.angle_a_deg, 0.0055);
  EXPECT_LE(result.angle_b_deg, 0.0055);
  EXPECT_GE(result.nees_angles, 0.6);
  EXPECT_LE(result.nees_angles, 1.1);
}

TEST(Map, Table3AtFullRateIsTenTimesBetter) {
  const MonteCarlo result = monte_carlo(Method::map, 6, full_rate);
  EXPECT_LE(result.rmse.at("refractive_index"), 6.5e-7);
  EXPECT_LE(result.rmse.at("incident_beam_horizontal_deg"), 1.6e-5);
  EXPECT_LE(result.rmse.at("incident_beam_vertical_deg"), 1.6e-5);
  EXPECT_LE(result.rmse.at("bearing_tilt_a_horizontal_deg"), 3.0e-4);
  EXPECT_LE(result.rmse.at("bearing_tilt_a_vertical_deg"), 3.0e-4);
  EXPECT_LE(result.rmse.at("prism_tilt_a_vertical_deg"), 3.0e-4);
  EXPECT_LE(result.rmse.at("prism_tilt_b_horizontal_deg"), 3.6e-4);
  EXPECT_LE(result.rmse.at("prism_tilt_b_vertical_deg"), 3.6e-4);
  EXPECT_LE(result.angle_a_deg, 0.0010);
  EXPECT_LE(result.angle_b_deg, 0.0010);
  EXPECT_LE(result.parameter_ratio, 1.15);
  EXPECT_LE(result.largest_parameter_ratio, 1.5);
  EXPECT_GE(result.nees_parameters, 0.75);
  EXPECT_LE(result.nees_parameters, 1.3);
  EXPECT_GE(result.within_two_sigma, 0.92);
}

TEST(Map, RoundedAnglesOfARealSensorKeepTheirSigma) {
  const MonteCarlo result = monte_carlo(Method::map, 3, [](std::uint64_t seed) {
    auto settings = full_rate(seed);
    settings.angle_noise = radians_from_degrees(0.004);
    settings.quantize = true;
    return settings;
  });
  EXPECT_LE(result.rmse.at("refractive_index"), 3.2e-7);
  for (const char* tilt :
       {"bearing_tilt_a_horizontal_deg", "bearing_tilt_a_vertical_deg", "prism_tilt_a_vertical_deg",
        "prism_tilt_b_horizontal_deg", "prism_tilt_b_vertical_deg"}) {
    EXPECT_LE(result.rmse.at(tilt), 1.8e-4) << tilt;
  }
  EXPECT_LE(result.angle_a_deg, 6e-4);
  EXPECT_LE(result.angle_b_deg, 6e-4);
  EXPECT_GE(result.nees_parameters, 0.4);  // chi-square of 24: 0.4 to 1.9 holds 99.5 %
  EXPECT_LE(result.nees_parameters, 1.9);
}

TEST(Map, RotorsThatMoveAsTheModelSaysAreKnownExactlyAsWellAsStated) {
  // The motion model is found by maximum likelihood, not given.
  const MonteCarlo result = monte_carlo(Method::map, testing::seeds_or(8), [](std::uint64_t seed) {
    auto settings = table3_settings(seed);
    settings.rotor = simulation::RotorKind::random_walk;
    return settings;
  });
  EXPECT_GE(result.angle_ratio, 0.97);
  EXPECT_LE(result.angle_ratio, 1.03);
  EXPECT_GE(result.speed_ratio, 0.97);
  EXPECT_LE(result.speed_ratio, 1.03);
  EXPECT_GE(result.nees_angles, 0.95);
  EXPECT_LE(result.nees_angles, 1.05);
}

TEST(Map, HuntingRotorsAreFollowedHonestly) {
  const MonteCarlo result = monte_carlo(Method::map, 4, [](std::uint64_t seed) {
    auto settings = table3_settings(seed);
    settings.rotor = simulation::RotorKind::hunting;
    return settings;
  });
  EXPECT_LE(result.angle_a_deg, 0.010);
  EXPECT_LE(result.angle_b_deg, 0.010);
  EXPECT_GE(result.nees_angles, 0.6);
  EXPECT_LE(result.nees_angles, 1.1);
}

TEST(Map, CorrelatedNoiseIsSeenAndPaidFor) {
  // AR(1) noise, rho 0.9 at 100 kHz: nineteen shots are worth one independent shot.
  constexpr double kRho = 0.9;
  const MonteCarlo result = monte_carlo(
      Method::map, 6,
      [](std::uint64_t seed) {
        auto settings = full_rate(seed);
        settings.duration = 3.0;
        return settings;
      },
      {},
      [](recordings::Observations& o, std::uint64_t seed) {
        // The simulated noise is white and known by its seed: it goes, correlated noise comes.
        std::vector<double> azimuth(o.size(), 0.0), zenith(o.size(), kPi / 2);
        simulation::ObservationNoise({radians_from_degrees(0.01), 0, 0, 0}, seed)
            .apply_to_angles(0, azimuth, zenith);
        for (double& value : zenith) value -= kPi / 2;
        double a = azimuth[0], z = zenith[0];
        const double fresh = std::sqrt(1.0 - kRho * kRho);
        for (std::size_t i = 0; i < o.size(); ++i) {
          o.azimuth[i] += a - azimuth[i];
          o.zenith[i] += z - zenith[i];
          if (i + 1 == o.size()) break;
          a = kRho * a + fresh * azimuth[i + 1];
          z = kRho * z + fresh * zenith[i + 1];
        }
      });
  EXPECT_GE(result.nees_parameters, 0.5);
  EXPECT_LE(result.nees_parameters, 1.5);
}

TEST(Map, OutliersMissingShotsAndAGapTogether) {
  const MonteCarlo clean = monte_carlo(Method::map, 8, table3_settings);
  const MonteCarlo result = monte_carlo(
      Method::map, 8, table3_settings, {}, [](recordings::Observations& o, std::uint64_t seed) {
        add_gross_errors(o, 0.01, seed);
        const RandomStream missing(seed, 74);
        filter_rows(o, [&](std::size_t i) {
          const double t = 1e-9 * static_cast<double>(o.time_ns[i]);
          return missing.uniform(i) > 0.2 && (t < 12.0 || t > 12.5);
        });
      });
  EXPECT_LE(result.angle_a_deg, 1.4 * clean.angle_a_deg);
  EXPECT_LE(result.angle_b_deg, 1.4 * clean.angle_b_deg);
  EXPECT_LE(result.nees_parameters, 1.5);
}

TEST(Map, ATenthOfGrossErrorsIsSurvived) {
  const MonteCarlo result = monte_carlo(
      Method::map, 4, table3_settings, {},
      [](recordings::Observations& o, std::uint64_t seed) { add_gross_errors(o, 0.1, seed); });
  EXPECT_LE(result.angle_a_deg, 0.006);
  EXPECT_LE(result.nees_parameters, 1.6);
}

/// A Mid-40 with random errors, speeds and combination.
sensors::Sensor random_sensor(std::uint64_t seed, double error_deg, double speed_share) {
  const RandomStream errors(seed, 81), speeds(seed, 82);
  auto sensor = sensors::load_sensor(speeds.uniform(0) < 0.5 ? "mid-40" : "mid-40-reversed");
  std::uint64_t number = 0;
  for (const std::string& name : estimation::default_free_names({2})) {
    if (name == "refractive_index") continue;
    sensor.set(name, radians_from_degrees(error_deg) * errors.normal(number++));
  }
  for (std::size_t k = 0; k < 2; ++k) {
    sensor.angular_velocity[k] *= 1.0 + speed_share * (2.0 * speeds.uniform(k + 1) - 1.0);
  }
  return sensor;
}

void expect_every_start(int sensors, double error_deg, double speed_share) {
  for (int i = 0; i < sensors; ++i) {
    SCOPED_TRACE(i);
    auto settings = table3_settings(static_cast<std::uint64_t>(i));
    settings.truth = random_sensor(static_cast<std::uint64_t>(i), error_deg, speed_share);
    settings.duration = 1.0;
    settings.angle_noise = radians_from_degrees(0.004);
    settings.quantize = true;
    auto data = testing::simulate(settings);
    const bool mirrored = i % 4 == 3;
    if (mirrored) {
      for (double& zenith : data.observations.zenith) zenith = kPi - zenith;
    }
    const auto estimate = testing::estimate(Method::map, data.observations, 0.004);
    ASSERT_TRUE(estimate.converged) << estimate.reason;
    ASSERT_EQ(estimate.mirrored, mirrored);
    ASSERT_EQ(estimate.sensor.combination, settings.truth.combination);
    const auto evaluation = evaluate(estimate, settings.truth, data.truth);
    for (const auto& row : evaluation.parameters) {
      EXPECT_LT(std::abs(row.error_over_sigma), 5.0) << row.name;
    }
    EXPECT_LT(degrees_from_radians(evaluation.rotation_angle_rmse[0]), 0.05);
  }
}

TEST(Map, RandomSensorsAreFoundFromAnyPhase) {
  expect_every_start(testing::seeds_or(60), 0.3, 0.01);
}

TEST(Map, BadlyBentSensorsAreFoundFromAnyPhase) {
  expect_every_start(testing::seeds_or(30), 1.0, 0.03);
}

TEST(Map, AWrongFaceOrderIsSaidAndNotBentUntilItFits) {
  for (const char* order : {"AP-PA", "PA-PA", "AP-AP"}) {
    auto settings = table3_settings(5);
    settings.truth.train = PrismTrain(parse_face_order(order));
    settings.duration = 3.0;
    const auto data = testing::simulate(settings);
    const auto estimate = testing::estimate(Method::map, data.observations, 0.01);
    EXPECT_FALSE(estimate.converged) << order;
    EXPECT_FALSE(estimate.reason.empty()) << order;
  }
}

TEST(Map, AParameterHeldAtAWrongValueShowsOverThePrismsAngle) {
  auto settings = table3_settings(1);
  const auto data = testing::simulate(settings);
  estimation::ShotSelector selector({});
  selector.add(data.observations);
  estimation::EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.angle_noise = radians_from_degrees(0.01);
  options.fixed = {"prism_tilt_b_vertical_deg"};  // true: -0.383
  const auto wrong = estimation::estimate(Method::map, selector.series(), selector.head(), options);
  EXPECT_GT(wrong.residuals_over_angle[1].chi2_per_bin, 1.6);
  EXPECT_FALSE(wrong.warnings.empty());
  options.fixed.clear();
  const auto right = estimation::estimate(Method::map, selector.series(), selector.head(), options);
  EXPECT_LT(right.residuals_over_angle[1].chi2_per_bin, 1.4);
  EXPECT_TRUE(right.warnings.empty());
}

}  // namespace risley::map_test
