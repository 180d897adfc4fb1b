// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/estimation/estimate.hpp"

#include "estimation/series.hpp"

namespace risley::estimation::held_parameters_test {

constexpr double kNoise = radians_from_degrees(0.01);

/// An estimate of the paper's unit whose wedge is held, and taken to be off by its sigma or not.
Estimate estimate_with(const std::string& moved, double off) {
  EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.angle_noise = kNoise;
  sensors::Sensor truth = sensors::load_sensor("mid-40-table3");
  if (!moved.empty()) truth.train.set(moved, truth.train.get(moved) + off);
  const auto series = testing::constant_speed_series(truth, 0.5, 2.5, 4.0, 5000.0, 0.01, 6);
  return estimate(Method::map, series, series, options);
}

TEST(HeldParameters, AnswersMoveByWhatIsSaid) {
  const Estimate right = estimate_with("", 0);
  const sensors::Sensor nominal = sensors::load_sensor("mid-40");
  std::vector<double> squares(right.values.size(), 0.0);
  for (const char* name : {"wedge_angle_deg", "prism_tilt_a_horizontal_deg"}) {
    const double sigma = nominal.find_knowledge(name)->sigma;
    ASSERT_GT(sigma, 0) << name;
    const Estimate moved = estimate_with(name, 0.2 * sigma);
    for (std::size_t i = 0; i < squares.size(); ++i) {
      const double change = wrap_to_pi(moved.values[i].value - right.values[i].value) / 0.2;
      squares[i] += change * change;
    }
  }
  for (std::size_t i = 0; i < squares.size(); ++i) {
    const EstimatedValue& value = right.values[i];
    const double stated = std::sqrt(
        std::max(0.0, value.sigma * value.sigma - value.sigma_given_held * value.sigma_given_held));
    EXPECT_GE(value.sigma, value.sigma_given_held) << value.name;
    EXPECT_NEAR(stated, std::sqrt(squares[i]),
                0.1 * std::sqrt(squares[i]) + 0.1 * value.sigma_given_held)
        << value.name;
  }
  // Far more than the data's own uncertainty, which the calibration keeps apart.
  const EstimatedValue& index = right.values.front();
  EXPECT_EQ(index.name, "refractive_index");
  EXPECT_GT(index.sigma, 20 * index.sigma_given_held);
  const sensors::Knowledge& known = *right.sensor.find_knowledge(index.name);
  EXPECT_EQ(known.sigma, index.sigma_given_held);
  EXPECT_EQ(known.total_sigma, index.sigma);
}

TEST(HeldParameters, ExactOnesAddNothing) {
  EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  for (sensors::Knowledge& known : options.sensor.knowledge) known.sigma = 0;
  options.angle_noise = kNoise;
  const auto series = testing::constant_speed_series(sensors::load_sensor("mid-40-table3"), 0.5,
                                                     2.5, 1.0, 2000.0, 0.01, 6);
  const Estimate result = estimate(Method::map, series, series, options);
  for (const EstimatedValue& value : result.values) {
    EXPECT_EQ(value.sigma, value.sigma_given_held) << value.name;
  }
}

}  // namespace risley::estimation::held_parameters_test
