// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/ekf.hpp"

#include <cmath>
#include <cstdlib>
#include <limits>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/estimate.hpp"

#include "estimation/series.hpp"

namespace risley::estimation::ekf_test {

constexpr double kNoise = radians_from_degrees(0.01);

sensors::Sensor bent_sensor() {
  auto sensor = sensors::load_sensor("mid-40-table3");
  return sensor;
}

std::vector<FreeParameter> default_parameters() {
  return free_parameters(default_free_names({2}), {2});
}

Solution run(const AngleSeries& series, EkfOptions options) {
  const auto nominal = sensors::load_sensor("mid-40");
  options.angle_noise = options.angle_noise > 0 ? options.angle_noise : kNoise;
  if (options.free.empty()) options.free = default_parameters();
  const Start start =
      find_start(series, nominal, {options.free, options.angle_noise, false, false});
  return run_ekf(series, start, options);
}

TEST(Ekf, NoiseFreeConstantSpeedIsRecoveredFarBelowTheStatedNoise) {
  const auto sensor = bent_sensor();
  const auto series = testing::constant_speed_series(sensor, 0.5, 2.5, 1.0, 2000.0);
  const Solution result = run(series, {});
  EXPECT_EQ(result.outliers, 0u);
  const std::vector<FreeParameter> free = default_parameters();
  for (std::size_t i = 0; i < free.size(); ++i) {
    const double truth = sensor.train.get(free[i].name);
    EXPECT_NEAR(result.parameters[static_cast<Eigen::Index>(i)], truth, 2e-6) << free[i].name;
  }
  EXPECT_LT(degrees_from_radians(moments(result.azimuth_residual).rms), 1e-4);
}

TEST(Ekf, MeanAndCovarianceEqualTheWeightedLeastSquaresOfTheWholeTrajectory) {
  // Without process noise the smoother must give what one batch adjustment gives: 12 unknowns,
  // linearised at the answer. An independent solution by stacked normal equations.
  const auto sensor = bent_sensor();
  const auto series = testing::constant_speed_series(sensor, 0.5, 2.5, 0.6, 1000.0, 0.01, 3);
  EkfOptions options;
  options.rotor_process = {{1e-9, 0, 0}, {1e-9, 0, 0}};
  options.gate_chi_square = std::numeric_limits<double>::infinity();
  options.passes = 4;
  const Solution result = run(series, options);
  const std::vector<FreeParameter> free = default_parameters();
  const auto statics = result.parameters.size();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(statics + 4, statics + 4);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(statics + 4);
  for (std::size_t i = 0; i < series.size(); ++i) {
    std::array<double, 2> angle{result.trajectory.angle(i, 0, 0.0),
                                result.trajectory.angle(i, 1, 0.0)};
    const Eigen::Vector2d residual(result.azimuth_residual[i], result.zenith_residual[i]);
    Eigen::MatrixXd row(2, statics + 4);
    const double h = 1e-6;
    const auto at = [&](const PrismTrain& train, double a, double b) {
      const auto shot = observe(train, std::array{a, b});
      return Eigen::Vector2d(shot.azimuth, shot.zenith);
    };
    for (Eigen::Index j = 0; j < statics; ++j) {
      PrismTrain up = result.train, down = result.train;
      for (const int p : free[static_cast<std::size_t>(j)].places) {
        up.set_place(p, up[p] + h);
        down.set_place(p, down[p] - h);
      }
      row.col(j) = (at(up, angle[0], angle[1]) - at(down, angle[0], angle[1])) / (2 * h);
    }
    for (Eigen::Index k = 0; k < 2; ++k) {
      const double a = k == 0 ? h : 0, b = k == 1 ? h : 0;
      row.col(statics + 2 * k) = (at(result.train, angle[0] + a, angle[1] + b) -
                                  at(result.train, angle[0] - a, angle[1] - b)) /
                                 (2 * h);
      row.col(statics + 2 * k + 1) = series.time(i) * row.col(statics + 2 * k);
    }
    normal += row.transpose() * row / (kNoise * kNoise);
    gradient += row.transpose() * residual / (kNoise * kNoise);
  }
  const Eigen::MatrixXd covariance =
      normal.ldlt().solve(Eigen::MatrixXd::Identity(statics + 4, statics + 4));
  const Eigen::VectorXd step = normal.ldlt().solve(gradient);
  for (Eigen::Index i = 0; i < statics; ++i) {
    const double sigma = std::sqrt(covariance(i, i));
    EXPECT_NEAR(std::sqrt(result.covariance(i, i)) / sigma, 1.0, 0.01) << i;
    EXPECT_LT(std::abs(step[i]) / sigma, 0.02) << i;
  }
}

TEST(Ekf, SmoothingNeverWidensAndKnowsLeastAtTheEnds) {
  const auto series = testing::constant_speed_series(bent_sensor(), 0.5, 2.5, 2.0, 1000.0, 0.01, 5);
  const Solution result = run(series, {});
  const auto variance = states_of_knots(result, series).rotation_angle_covariance[0];
  const double middle = variance[variance.size() / 2];
  EXPECT_LT(middle, variance.front());
  EXPECT_LT(middle, variance.back());
  for (const double v : variance) EXPECT_GT(v, 0.0);
}

TEST(Ekf, AGapIsBridgedAndItsUncertaintyShown) {
  auto series = testing::constant_speed_series(bent_sensor(), 0.5, 2.5, 3.0, 1000.0, 0.01, 6);
  const auto cut = [](auto& column) { column.erase(column.begin() + 1200, column.begin() + 1700); };
  cut(series.time_ns);
  cut(series.azimuth);
  cut(series.zenith);
  cut(series.azimuth_rounding_variance);
  cut(series.zenith_rounding_variance);
  cut(series.beam);
  EkfOptions options;
  options.rotor_process.assign(2, {radians_from_degrees(1.5), 0.0, 0.0});
  const Solution result = run(series, options);
  EXPECT_LT(result.outliers, 15u);
  const auto variance = states_of_knots(result, series).rotation_angle_covariance[0];
  EXPECT_GT(variance[1200], 1.2 * variance[600]);
}

TEST(Ekf, ShotsWithoutEmittersAreAllOfTheFirst) {
  AngleSeries series = testing::constant_speed_series(bent_sensor(), 0.5, 2.5, 0.3, 1000.0);
  const auto nominal = sensors::load_sensor("mid-40");
  EkfOptions options;
  options.angle_noise = kNoise;
  Start start = find_start(series, nominal, {default_parameters(), kNoise, false, false});
  start.train = PrismTrain(nominal.train.face_order(), 2);
  const Solution named = run_ekf(series, start, options);
  series.beam.clear();
  const Solution nameless = run_ekf(series, start, options);
  EXPECT_EQ(named.azimuth_residual, nameless.azimuth_residual);
}

TEST(Ekf, PoliteRefusals) {
  EkfOptions options;
  options.angle_noise = kNoise;
  EXPECT_THROW(run_ekf({}, {}, options), EstimationError);
  EXPECT_THROW(free_parameters({"refractive_index", "refractive_index_a"}, {2}), InvalidArgument);
  EXPECT_THROW(free_parameters({"angular_velocity_a_deg_per_s"}, {2}), InvalidArgument);
}

TEST(AngleSeries, SelectsFirstReturnsInOrderOnAFixedGrid) {
  recordings::Observations o;
  o.resize(7);
  const std::int64_t times[] = {0, 0, 400'000, 1'000'000, 900'000, 2'000'000, 3'000'000};
  for (std::size_t i = 0; i < 7; ++i) {
    o.time_ns[i] = times[i];
    o.azimuth[i] = static_cast<double>(i);
    o.valid[i] = i != 5;
    o.zenith_resolution[i] = 0.12F;
  }
  o.return_number[1] = 2;
  ShotSelector selector({1000.0});
  selector.add(o);
  EXPECT_EQ(selector.series().time_ns, (std::vector<std::int64_t>{0, 1'000'000, 3'000'000}));
  EXPECT_EQ(selector.head().size(), 4u);
  EXPECT_EQ(selector.counts().further_returns, 1u);
  EXPECT_EQ(selector.counts().out_of_order, 1u);
  EXPECT_EQ(selector.counts().invalid, 1u);
  EXPECT_NEAR(static_cast<double>(selector.series().zenith_rounding_variance[0]), 0.0012, 1e-9);
  EXPECT_THROW(ShotSelector({0.0}), InvalidArgument);
}

TEST(Diagnostics, MomentsOfAKnownSample) {
  const std::vector<double> sample{1, 2, 3, 4, 10, std::nan(""), 99};
  const std::vector<unsigned char> skip{0, 0, 0, 0, 0, 0, 1};
  const Moments m = moments(sample, skip);
  EXPECT_EQ(m.count, 5u);
  EXPECT_DOUBLE_EQ(m.mean, 4.0);
  EXPECT_NEAR(m.std, std::sqrt(50.0 / 4.0), 1e-12);
  EXPECT_NEAR(m.rms, std::sqrt(130.0 / 5.0), 1e-12);
  EXPECT_NEAR(m.skewness, 36.0 / std::pow(10.0, 1.5), 1e-12);  // sum of cubes 180 / 5
  EXPECT_NEAR(m.kurtosis, 1394.0 / 5.0 / 100.0 - 3.0, 1e-12);
  EXPECT_TRUE(std::isnan(moments({}).mean));
}

}  // namespace risley::estimation::ekf_test
