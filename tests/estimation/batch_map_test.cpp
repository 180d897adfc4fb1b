// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/batch_map.hpp"

#include <cmath>
#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "risley/core/error.hpp"
#include "risley/estimation/ekf.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/optics/observation_model.hpp"

#include "estimation/series.hpp"

namespace risley::estimation::batch_map_test {

constexpr double kNoise = radians_from_degrees(0.01);

EstimateOptions nominal_options(double noise = kNoise) {
  EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.angle_noise = noise;
  return options;
}

Estimate estimate_map(const AngleSeries& series, const EstimateOptions& options) {
  AngleSeries head;
  for (std::size_t i = 0; i < series.size() && series.time(i) >= 0 && series.time(i) <= 1.0; ++i) {
    head.append(series, i);
  }
  return estimate(Method::map, series, head, options);
}

/// Every error of a bent sensor's parameters in its stated sigma.
double worst_error(const Estimate& estimate, const sensors::Sensor& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < estimate.free.size(); ++i) {
    const double error = estimate.values[i].value - truth.train.get(estimate.free[i].name);
    worst = std::max(worst, std::abs(error) / estimate.values[i].sigma_given_held);
  }
  return worst;
}

TEST(BatchMap, NoiseFreeConstantSpeedIsRecoveredFarBelowTheStatedNoise) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  const auto series = testing::constant_speed_series(sensor, 0.5, 2.5, 1.0, 2000.0);
  const double noise = radians_from_degrees(1e-6);
  EstimateOptions options = nominal_options(noise);
  const Estimate result = estimate_map(series, options);
  EXPECT_EQ(result.outliers, 0u);
  for (std::size_t i = 0; i < result.free.size(); ++i) {
    EXPECT_NEAR(result.parameters[static_cast<Eigen::Index>(i)],
                sensor.train.get(result.free[i].name), 1e-9)
        << result.free[i].name;
  }
  // No noise at all is far below what was stated, which the verdict says.
  EXPECT_TRUE(result.converged) << result.reason;
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_EQ(result.warnings.front().code, kWarning.unusual_noise);
}

TEST(BatchMap, TheDirectionOfAnEmitterWithoutShotsIsHeldAndNamed) {
  const sensors::Sensor sensor = sensors::load_sensor("horizon");
  std::mt19937_64 generator(3);
  std::normal_distribution<double> noise(0.0, kNoise);
  AngleSeries series;
  for (int i = 0; i < 120'000; ++i) {
    const int beam = i % 6;
    if (beam == 3) continue;
    const std::int64_t time_ns = i * 12'500LL / 3;
    std::vector<double> angles;
    for (const double speed : sensor.angular_velocity) {
      angles.push_back(wrap_to_pi(1.0 + speed * 1e-9 * static_cast<double>(time_ns)));
    }
    const Observation shot = observe(sensor.train, angles, beam);
    series.append(time_ns, shot.azimuth + noise(generator), shot.zenith + noise(generator),
                  static_cast<std::uint8_t>(beam));
  }
  EstimateOptions options;
  options.sensor = sensor;
  const Estimate result = estimate(Method::map, series, series, options);
  EXPECT_TRUE(result.converged) << result.reason;
  for (const FreeParameter& parameter : result.free) {
    EXPECT_EQ(parameter.name.find("incident_beam_4"), std::string::npos) << parameter.name;
  }
  const PrismTrain& train = result.sensor.train;
  for (const int at :
       {place::incident_beam_horizontal(3, 3), place::incident_beam_vertical(3, 3)}) {
    EXPECT_EQ(train[at], sensor.train[at]);
  }
  EXPECT_LT(worst_error(result, sensor), 4.5);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_EQ(result.warnings.front().code, kWarning.not_seen);
}

TEST(BatchMap, TellsWhatAllAnglesOfARotorHaveInCommon) {
  // Rotors at constant speed have nothing but common errors. In the middle of the recording the
  // speed's error plays no part, so an angle's covariance there is that of the mean angle at given
  // parameters plus what the parameters' errors add.
  const auto sensor = sensors::load_sensor("mid-40");
  const auto series = testing::constant_speed_series(sensors::load_sensor("mid-40-table3"), 0.5,
                                                     2.5, 2.0, 2000.0, 0.01, 6);
  BatchMapOptions options;
  options.angle_noise = equal_noise(kNoise);
  options.free = free_parameters(default_free_names({2}), {2});
  options.rotor_process.assign(2, {1e-9, 0.0, 0.0});
  const Start start = find_start(series, sensor, {options.free, kNoise, false, false});
  const Solution map = run_batch_map(series, start, sensor, options);
  const Eigen::MatrixXd common =
      map.common_angles->information.inverse() +
      map.common_angles->sensitivity * map.covariance * map.common_angles->sensitivity.transpose();
  const std::size_t middle = map.trajectory.size() / 2;
  for (std::size_t k = 0; k < 2; ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    EXPECT_NEAR(map.trajectory.angle_covariance(middle, k, k, 0.0) / common(i, i), 1.0, 0.1) << k;
  }
}

TEST(BatchMap, AgreesWithTheFilterOnTheSameMotionModel) {
  // With the same motion model, and no shot left out, both solve the same problem.
  const auto sensor = sensors::load_sensor("mid-40");
  const auto series = testing::constant_speed_series(sensors::load_sensor("mid-40-table3"), 0.5,
                                                     2.5, 3.0, 1000.0, 0.01, 3);
  BatchMapOptions batch;
  batch.angle_noise = equal_noise(kNoise);
  batch.free = free_parameters(default_free_names({2}), {2});
  batch.rotor_process.assign(2, {radians_from_degrees(1.5), 0.0, 0.0});
  batch.outlier_chi2 = 1e6;
  EkfOptions filter;
  filter.angle_noise = kNoise;
  filter.free = batch.free;
  filter.rotor_process = batch.rotor_process;
  filter.gate_chi_square = 1e6;
  filter.passes = 4;
  const Start start = find_start(series, sensor, {batch.free, kNoise, false, false});
  const Solution map = run_batch_map(series, start, sensor, batch);
  const Solution ekf = run_ekf(series, start, filter);
  for (Eigen::Index i = 0; i < map.parameters.size(); ++i) {
    const double sigma = std::sqrt(map.covariance(i, i));
    EXPECT_NEAR(map.parameters[i], ekf.parameters[i], 0.01 * sigma) << i;
    EXPECT_NEAR(std::sqrt(ekf.covariance(i, i)) / sigma, 1.0, 0.001) << i;
  }
}

TEST(BatchMap, TheLengthOfTheKnotsDoesNotMatter) {
  const auto series = testing::constant_speed_series(sensors::load_sensor("mid-40-table3"), 0.5,
                                                     2.5, 2.0, 10000.0, 0.01, 4);
  const auto sensor = sensors::load_sensor("mid-40");
  BatchMapOptions options;
  options.angle_noise = equal_noise(kNoise);
  options.free = free_parameters(default_free_names({2}), {2});
  options.rotor_process.assign(2, {0.0, 0.0, radians_from_degrees(4.0)});
  const Start start = find_start(series, sensor, {options.free, kNoise, false, false});
  const Solution fine = [&] {
    BatchMapOptions half = options;
    half.knot_interval = 0.0005;
    return run_batch_map(series, start, sensor, half);
  }();
  const Solution coarse = run_batch_map(series, start, sensor, options);
  for (Eigen::Index i = 0; i < coarse.parameters.size(); ++i) {
    const double sigma = std::sqrt(fine.covariance(i, i));
    EXPECT_NEAR(coarse.parameters[i], fine.parameters[i], 0.01 * sigma) << i;
    EXPECT_NEAR(std::sqrt(coarse.covariance(i, i)) / sigma, 1.0, 0.002) << i;
  }
}

TEST(BatchMap, AnySubsetOfParametersCanBeHeldOrFreed) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  const auto series = testing::constant_speed_series(sensor, 0.5, 2.5, 2.0, 1000.0, 0.01, 5);
  EstimateOptions options = nominal_options();
  options.sensor.train = sensor.train;
  options.fixed = {"refractive_index", "prism_tilt_b_horizontal_deg"};
  const Estimate held = estimate_map(series, options);
  ASSERT_TRUE(held.converged) << held.reason;
  EXPECT_EQ(held.free.size(), 6u);
  EXPECT_LT(worst_error(held, sensor), 4.5);
  options.fixed = default_free_names({2});  // nothing free: the rotors alone
  const Estimate rotors = estimate_map(series, options);
  ASSERT_TRUE(rotors.converged) << rotors.reason;
  EXPECT_EQ(rotors.free.size(), 0u);
  EXPECT_EQ(rotors.covariance.size(), 0);
  EXPECT_LT(degrees_from_radians(rotors.azimuth_moments.rms), 0.0105);
}

TEST(BatchMap, WhatTheDataDoNotTellIsNamedAndNotConverged) {
  const auto series = testing::constant_speed_series(sensors::load_sensor("mid-40-table3"), 0.5,
                                                     2.5, 2.0, 1000.0, 0.01, 6);
  for (const char* name :
       {"refractive_index_air", "prism_tilt_a_horizontal_deg", "wedge_angle_deg"}) {
    EstimateOptions options = nominal_options();
    options.additional = {name};
    const Estimate result = estimate_map(series, options);
    EXPECT_FALSE(result.converged) << name;
    ASSERT_FALSE(result.unobservable.empty()) << name;
    EXPECT_NE(result.reason.find(name), std::string::npos) << result.reason;
  }
}

TEST(BatchMap, AResetOfTheClockAndALongPauseSplitTheRotorsAndNotTheParameters) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  const auto whole = testing::constant_speed_series(sensor, 0.5, 2.5, 3.0, 1000.0, 0.01, 7);
  AngleSeries pieces = whole;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (i >= 1000) pieces.time_ns[i] += 60'000'000'000;  // a minute's pause
    if (i >= 2000) pieces.time_ns[i] -= 61'900'000'000;  // and a reset
  }
  const Estimate result = estimate_map(pieces, nominal_options());
  ASSERT_TRUE(result.converged) << result.reason;
  EXPECT_EQ(result.trajectory.stretch_begin.size(), 3u);
  EXPECT_EQ(result.unused_shots, 0u);
  EXPECT_LT(worst_error(result, sensor), 4.5);
  EXPECT_NEAR(degrees_from_radians(result.values[8].value),
              degrees_from_radians(sensor.angular_velocity[0]), 0.1);
  // A piece too short to find its rotors' phases is left out and counted.
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (i >= 2980) pieces.time_ns[i] -= 50'000'000'000;
  }
  const Estimate shorter = estimate_map(pieces, nominal_options());
  ASSERT_TRUE(shorter.converged) << shorter.reason;
  EXPECT_EQ(shorter.unused_shots, 21u);
  EXPECT_TRUE(std::isnan(states_of_shots(shorter, {2990, 2991}).rotation_angle[0][0]));
  EXPECT_FALSE(std::isnan(states_of_shots(shorter, {2970, 2971}).rotation_angle[0][0]));
}

TEST(BatchMap, ABeginningThatTellsNothingIsNoObstacle) {
  // A lone shot, nothing for three seconds, then data.
  const auto sensor = sensors::load_sensor("mid-40-table3");
  auto series = testing::constant_speed_series(sensor, 0.5, 2.5, 2.0, 1000.0, 0.01, 11);
  for (std::size_t i = 1; i < series.size(); ++i) series.time_ns[i] += 3'000'000'000;
  const Estimate result = estimate_map(series, nominal_options());
  ASSERT_TRUE(result.converged) << result.reason;
  EXPECT_LT(worst_error(result, sensor), 4.5);
}

TEST(BatchMap, StatesOfShotsAndKnotsAreOneTrajectory) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  const auto series = testing::constant_speed_series(sensor, 0.5, 2.5, 0.5, 10000.0, 0.01, 8);
  const Estimate result = estimate_map(series, nominal_options());
  ASSERT_TRUE(result.converged) << result.reason;
  const RotorStates all = states_of_shots(result, {0, series.size()});
  ASSERT_EQ(all.size(), series.size());
  double squares = 0, variances = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double truth = 0.5 + series.time(i) * sensor.angular_velocity[0];
    squares += std::pow(wrap_to_pi(all.rotation_angle[0][i] - truth), 2);
    variances += all.rotation_angle_covariance[0][i];
  }
  EXPECT_LT(squares, 6.0 * variances);
  for (std::size_t row = 0; row < result.states.size(); ++row) {
    const auto at = std::find(all.time_ns.begin(), all.time_ns.end(), result.states.time_ns[row]) -
                    all.time_ns.begin();
    const auto i = static_cast<std::size_t>(at);
    ASSERT_LT(i, all.size());
    EXPECT_EQ(all.rotation_angle[1][i], result.states.rotation_angle[1][row]);
    EXPECT_EQ(all.azimuth_residual[i], result.states.azimuth_residual[row]);
  }
  // The middle of the recording is known better than its ends.
  EXPECT_LT(all.rotation_angle_covariance[0][all.size() / 2],
            all.rotation_angle_covariance[0].front());
}

TEST(BatchMap, ResultsDoNotDependOnTheNumberOfThreads) {
  const auto series = testing::constant_speed_series(sensors::load_sensor("mid-40-table3"), 0.5,
                                                     2.5, 5.0, 1000.0, 0.01, 9);
  std::vector<Estimate> results;
  for (const std::size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(estimate_map(series, nominal_options()));
  }
  EXPECT_EQ(results[0].parameters, results[1].parameters);
  EXPECT_EQ(results[0].covariance, results[1].covariance);
}

TEST(BatchMap, CorrelatedNoiseWidensTheSigmas) {
  // AR(1) with rho 0.8: a mean of such noise varies nine times as much.
  const auto sensor = sensors::load_sensor("mid-40-table3");
  auto series = testing::constant_speed_series(sensor, 0.5, 2.5, 1.0, 100000.0);
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  double a = 0, z = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    a = 0.8 * a + 0.6 * kNoise * normal(generator);
    z = 0.8 * z + 0.6 * kNoise * normal(generator);
    series.azimuth[i] += a;
    series.zenith[i] += z;
  }
  const Estimate result = estimate_map(series, nominal_options());
  ASSERT_TRUE(result.converged) << result.reason;
  EXPECT_NEAR(result.autocorrelation.factor, 9.0, 0.7);
  EXPECT_LT(worst_error(result, sensor), 3.5);
  EXPECT_GT(worst_error(result, sensor), 0.5);
}

TEST(BatchMap, MoreNoiseThanStatedWidensTheSigmasAndALotMoreFails) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  const auto series = testing::constant_speed_series(sensor, 0.5, 2.5, 2.0, 1000.0, 0.02, 10);
  const Estimate doubled = estimate_map(series, nominal_options());
  ASSERT_TRUE(doubled.converged) << doubled.reason;
  EXPECT_NEAR(doubled.variance_factor, 4.0, 0.25);
  EXPECT_FALSE(doubled.warnings.empty());
  const Estimate right = estimate_map(series, nominal_options(radians_from_degrees(0.02)));
  EXPECT_NEAR(doubled.values[0].sigma_given_held / right.values[0].sigma_given_held, 1.0, 0.03);
  const Estimate far_above = estimate_map(series, nominal_options(radians_from_degrees(0.004)));
  EXPECT_FALSE(far_above.converged);
  const Estimate far_below = estimate_map(series, nominal_options(radians_from_degrees(0.1)));
  EXPECT_TRUE(far_below.converged) << far_below.reason;  // too careful, and said so
  ASSERT_FALSE(far_below.warnings.empty());
  EXPECT_EQ(far_below.warnings.front().code, kWarning.unusual_noise);
}

TEST(BatchMap, PoliteRefusals) {
  EXPECT_THROW(estimate_map({}, nominal_options()), EstimationError);
  EstimateOptions unknown = nominal_options();
  unknown.additional = {"no_such_parameter"};
  const auto series =
      testing::constant_speed_series(sensors::load_sensor("mid-40"), 0, 0, 0.2, 1000.0);
  EXPECT_THROW(estimate_map(series, unknown), InvalidArgument);
}

}  // namespace risley::estimation::batch_map_test
