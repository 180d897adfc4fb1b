// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/initialisation.hpp"

#include <random>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"

#include "estimation/series.hpp"

namespace risley::estimation {
namespace {

using sensors::SpeedCombination;

/// A Mid-40 with random errors, speeds and combination.
sensors::Sensor random_sensor(std::mt19937_64& generator, double error_deg, double speed_share) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  auto sensor = sensors::load_sensor(uniform(generator) < 0 ? "mid-40" : "mid-40-reversed");
  for (const std::string& name : default_free_names(2)) {
    const double step = name == "refractive_index" ? 0.002 : radians_from_degrees(error_deg);
    sensor.set(name, sensor.get(name) + step * normal(generator));
  }
  for (double& speed : sensor.angular_velocity) speed *= 1.0 + speed_share * uniform(generator);
  return sensor;
}

class StartOfRandomSensors : public ::testing::TestWithParam<double> {};  // rate, Hz

TEST_P(StartOfRandomSensors, AlwaysFindsCombinationSpeedsAndAngles) {
  const auto nominal = sensors::load_sensor("mid-40");
  const auto free = free_parameters(default_free_names(2), 2);
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> phase(-kPi, kPi);
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    const auto sensor = random_sensor(generator, 0.3, 0.01);
    const double a = phase(generator), b = phase(generator);
    const auto head = testing::constant_speed_series(sensor, a, b, 1.0, GetParam(), 0.01,
                                                     static_cast<unsigned>(i));
    const Start start = find_start(head, nominal, free, radians_from_degrees(0.01));
    ASSERT_EQ(start.combination, sensor.combination);
    EXPECT_LT(degrees_from_radians(start.residual_rms), 0.02);
    const double t = 1e-9 * static_cast<double>(start.time_ns - head.time_ns[0]);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(degrees_from_radians(start.angular_velocity[k]),
                  degrees_from_radians(sensor.angular_velocity[k]), 15.0);
      const double truth = (k == 0 ? a : b) + t * sensor.angular_velocity[k];
      EXPECT_LT(degrees_from_radians(std::abs(wrap_to_pi(start.rotation_angle[k] - truth))), 1.0);
    }
    EXPECT_FALSE(is_mirrored(head, nominal, free, radians_from_degrees(0.01)));
    EXPECT_TRUE(is_mirrored(mirror_image(head), nominal, free, radians_from_degrees(0.01)));
  }
}

INSTANTIATE_TEST_SUITE_P(Rates, StartOfRandomSensors, ::testing::Values(1000.0, 100000.0));

TEST(Initialisation, LinesCarryTheSpeedsOfTheRotors) {
  const auto sensor = sensors::load_sensor("mid-40");
  const auto lines = rotor_lines(testing::constant_speed_series(sensor, 0.3, 1.0, 0.1, 100000.0));
  ASSERT_EQ(lines.size(), 2u);
  const auto rotors = identify_rotors(lines, sensor);
  EXPECT_EQ(rotors.combination, SpeedCombination::first);
  EXPECT_NEAR(rotors.line[0].angular_velocity / sensor.angular_velocity[0], 1.0, 1e-4);
  EXPECT_NEAR(rotors.line[1].angular_velocity / sensor.angular_velocity[1], 1.0, 1e-4);
  // At rotation angle zero the beam leans to -Z.
  EXPECT_NEAR(wrap_to_pi(rotors.line[0].phase + kPi / 2 - 0.3), 0.0, 0.02);
  EXPECT_NEAR(wrap_to_pi(rotors.line[1].phase + kPi / 2 - 1.0), 0.0, 0.02);
}

TEST(Initialisation, TheZeroPositionIsWhereBothAnglesAreNearlyZero) {
  const auto sensor = sensors::load_sensor("mid-40");
  const auto series = testing::constant_speed_series(sensor, 2.0, -1.0, 1.0, 100000.0);
  const std::size_t row = zero_position_row(series, sensor.train);
  for (std::size_t k = 0; k < 2; ++k) {
    const double angle = (k == 0 ? 2.0 : -1.0) + series.time(row) * sensor.angular_velocity[k];
    EXPECT_LT(std::abs(wrap_to_pi(angle)), radians_from_degrees(10.0));
  }
}

TEST(Initialisation, TooLittleDataIsSaidInNumbers) {
  const auto sensor = sensors::load_sensor("mid-40");
  const auto series = testing::constant_speed_series(sensor, 0, 0, 0.049, 10000.0);
  try {
    rotor_lines(series);
    FAIL() << "accepted 49 ms";
  } catch (const EstimationError& error) {
    EXPECT_NE(std::string(error.what()).find("0.0490 s"), std::string::npos) << error.what();
  }
}

TEST(Initialisation, SpeedsOfAnotherSensorAreRefused) {
  auto sensor = sensors::load_sensor("mid-40");
  sensor.angular_velocity = {-2 * kPi * 30, 2 * kPi * 200};
  const auto head = testing::constant_speed_series(sensor, 0, 0, 0.2, 10000.0);
  EXPECT_THROW(find_start(head, sensors::load_sensor("mid-40"),
                          free_parameters(default_free_names(2), 2), 1e-4),
               EstimationError);
}

}  // namespace
}  // namespace risley::estimation
