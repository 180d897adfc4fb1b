// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <limits>

#include <gmock/gmock.h>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"

#include "refusal.hpp"

namespace risley::sensors::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Entries, SizesAskForThePrismsOfTheTrain) {
  Sensor sensor = load_sensor("mid-40");
  const PrismGeometry before = sensor.geometry;
  EXPECT_EQ(refusal([&] {
              sensor.set_prism_geometry({{0.01, 0.01, 0.01}, {}});
            }),
            "thickness has 3 values, allowed none, 1 or 2");
  EXPECT_EQ(refusal([&] {
              sensor.set_prism_geometry({{}, {kNan}});
            }),
            "spacing = nan m, allowed finite");
  EXPECT_EQ(sensor.geometry, before);
}

/// A sensor of two prisms in the second of three combinations.
Sensor with_list() {
  Sensor sensor = load_sensor("mid-40");
  sensor.combination = 2;
  sensor.combinations = {{{10.0, -20.0}, {}}, {sensor.angular_velocity, {}}, {{30.0, 40.0}, {}}};
  return sensor;
}

TEST(Entries, CombinationsAskForOneThatIsThere) {
  Sensor sensor = with_list();
  EXPECT_EQ(refusal([&] { return with_combination(sensor, 4); }),
            "combination = 4 of sensor \"mid-40\", allowed 1 to 3");
  EXPECT_EQ(refusal([&] { return with_combination(sensor, 0); }),
            "combination = 0 of sensor \"mid-40\", allowed 1 to 3");
  sensor.combination = 5;
  EXPECT_EQ(refusal([&] { return with_combination(sensor, 1); }),
            "combination = 5 of sensor \"mid-40\", allowed 1 to 3");
  sensor.combination.reset();
  const char* unsaid = "sensor \"mid-40\" does not say which of its 3 combinations it is in";
  EXPECT_EQ(refusal([&] { return with_combination(sensor, 1); }), unsaid);
  EXPECT_EQ(refusal([&] { return in_all_combinations(sensor); }), unsaid);
  sensor.combinations.clear();
  EXPECT_EQ(refusal([&] { return with_combination(sensor, 1); }),
            "sensor \"mid-40\" has only one combination of speeds");
}

TEST(Entries, CombinationsAskForColumnsThatFit) {
  const auto run = [](auto&& change) {
    Sensor sensor = with_list();
    change(sensor);
    return refusal([&] { return with_combination(sensor, 1); });
  };
  EXPECT_EQ(run([](Sensor& s) { s.angular_velocity.push_back(1.0); }),
            "angular_velocity of the sensor has 3 values, expected 2");
  EXPECT_EQ(run([](Sensor& s) { s.combinations[0].angular_velocity.pop_back(); }),
            "angular_velocity of a combination has 1 values, expected 2");
  EXPECT_EQ(run([](Sensor& s) { s.combinations[2].face_order = parse_face_order("PA"); }),
            "face_order of a combination has 1 values, expected 2 or none");
  EXPECT_EQ(run([](Sensor& s) { s.covariance_names = {"refractive_index"}; }),
            "a row of the covariance has 0 values, expected 1");
  EXPECT_EQ(run([](Sensor& s) { s.covariance.resize(1, 0); }),
            "a column of the covariance has 1 values, expected 0");
  EXPECT_EQ(run([](Sensor&) {}), "");
}

TEST(Entries, PresetsAskForNumbersThatCanBeReadAgain) {
  const auto run = [](auto&& change) {
    Sensor sensor = load_sensor("mid-40");
    change(sensor);
    return refusal([&] { return preset_text(sensor); });
  };
  EXPECT_EQ(run([](Sensor&) {}), "");
  EXPECT_EQ(run([](Sensor& s) { s.shot_rate = -5; }),
            "shot_rate_hz = -5 Hz, allowed 0.001 to 1e+09");
  EXPECT_EQ(run([](Sensor& s) { s.angle_noise = radians_from_degrees(-0.5); }),
            "angle_noise_deg = -0.5 deg, allowed 0 to 10");
  EXPECT_EQ(run([](Sensor& s) { s.range_noise = kNan; }),
            "range_noise_m = nan m, allowed 0 to 100");
  EXPECT_EQ(run([](Sensor& s) { s.combination = 3; }), "combination = 3, allowed 1 to 2");
  EXPECT_EQ(run([](Sensor& s) {
              s.combinations = {{{1.0, 2.0}, {}}};
              s.combination.reset();
            }),
            "combinations of a sensor without combination has 1 values, expected 0");
  EXPECT_EQ(run([](Sensor& s) {
              s.geometry.spacing = {0.1, 0.1};
            }),
            "spacing has 2 values, allowed none, 1 or 1");
}

TEST(Entries, SpecificationsMayStandOnTheirBounds) {
  Sensor sensor = load_sensor("mid-40");
  sensor.field_of_view = kTwoPi;
  sensor.angle_resolution = radians_from_degrees(10);
  EXPECT_EQ(refusal([&] { return preset_text(sensor); }), "");
}

}  // namespace risley::sensors::entries_test
