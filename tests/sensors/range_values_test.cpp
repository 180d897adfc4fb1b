// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/range_values.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/sensors/footprint.hpp"
#include "risley/sensors/preset.hpp"

#include "refusal.hpp"

namespace risley::sensors::range_values_test {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(RangeValues, EveryNumberOfTheErrorsHasAName) {
  Sensor sensor = load_sensor("avia");
  double value = 0.001;
  for (const RangeValue& known : range_values(6)) {
    EXPECT_TRUE(is_range_value(known.name));
    EXPECT_EQ(get_range_value(sensor, known.name), 0.0);
    set_range_value(sensor, known.name, value);
    EXPECT_EQ(get_range_value(sensor, known.name), value);
    value += 0.001;
  }
  EXPECT_EQ(sensor.range_offset, 0.001);
  EXPECT_EQ(sensor.range_errors.near, 0.002);
  EXPECT_EQ(sensor.range_errors.incidence, 0.003);
  EXPECT_EQ(sensor.range_errors.per_decade, 0.004);
  ASSERT_EQ(sensor.range_errors.emitter.size(), 6U);
  EXPECT_DOUBLE_EQ(sensor.range_errors.emitter[5], 0.01);
  EXPECT_FALSE(is_range_value("wedge_angle_deg"));
  EXPECT_FALSE(is_range_value("range_noise_m"));
}

TEST(RangeValues, OfAnotherSensorAreRefused) {
  Sensor sensor = load_sensor("mid-40");
  EXPECT_THAT(refusal([&] { set_range_value(sensor, "range_emitter_2_m", 1); }),
              NamesField("\"range_emitter_2_m\""));
  EXPECT_THAT(refusal([&] { get_range_value(sensor, "range_nearr_m"); }),
              NamesField("range_near_m"));
  EXPECT_EQ(refusal([&] { set_range_value(sensor, "range_near_m", 200); }),
            "range_near_m = 200 m, allowed -100 to 100");
  EXPECT_EQ(refusal([&] { set_range_value(sensor, "range_near_m", NAN); }),
            "range_near_m = nan m, allowed -100 to 100");
}

TEST(RangeValues, PresetsKeepThem) {
  Sensor sensor = load_sensor("avia");
  EXPECT_THAT(preset_text(sensor), Not(HasSubstr("range_near_m")));
  sensor.range_offset = -0.0125;
  sensor.range_errors = {0.015, 0.3, 0.01, {0.001, 0, 0, 0, 0, -0.002}};
  sensor.set_knowledge({"range_near_m", 0.004, "a wall at 1 m"});
  sensor.set_knowledge({"range_emitter_2_m", 0.001, "walls"});
  sensor.covariance_names = {"range_offset_m", "range_per_decade_m"};
  sensor.covariance = Eigen::MatrixXd::Identity(2, 2);
  const std::string text = preset_text(sensor);
  const Sensor back = parse_preset(text, "avia.yaml");
  EXPECT_EQ(back.range_offset, sensor.range_offset);
  EXPECT_EQ(back.range_errors, sensor.range_errors);
  ASSERT_NE(back.find_knowledge("range_near_m"), nullptr);
  EXPECT_EQ(back.find_knowledge("range_near_m")->sigma, 0.004);
  EXPECT_NE(back.find_knowledge("range_emitter_2_m"), nullptr);
  EXPECT_EQ(back.covariance_names, sensor.covariance_names);
  EXPECT_EQ(back.covariance, sensor.covariance);
  EXPECT_EQ(preset_text(back), text);
}

TEST(RangeValues, MistakesInPresetsAreNamedWithTheirLine) {
  const std::string good = builtin_preset_text("mid-40");
  const auto problem = [&](const std::string& field) {
    try {
      parse_preset(good + "range:\n  " + field + "\n", "mid-40.yaml");
    } catch (const FileError& error) {
      EXPECT_TRUE(error.place().line.has_value());
      return error.problem();
    }
    return std::string();
  };
  EXPECT_EQ(problem("range_near_m: {value: 0.01, unit: m}"), "");
  EXPECT_THAT(problem("range_near_mm: {value: 10, unit: mm}"), NamesField("range.range_near_mm"));
  EXPECT_THAT(problem("range_emitter_2_m: {value: 0, unit: m}"), NamesField("range_emitter_2_m"));
  EXPECT_THAT(problem("range_incidence: {value: 1, unit: m}"), NamesField("expected \"1\""));
  EXPECT_THAT(problem("range_incidence: {value: 1000, unit: '1'}"), NamesField("-100 to 100"));
}

TEST(Footprint, LiesAcrossTheBeamAndLevel) {
  for (const Vector3<double>& beam : {Vector3<double>{1, 0, 0}, {0.6, 0.48, -0.64}, {0, 0, 1}}) {
    const FootprintAxes axes = footprint_axes(beam);
    EXPECT_NEAR(norm(axes.horizontal), 1.0, 1e-15);
    EXPECT_NEAR(norm(axes.vertical), 1.0, 1e-15);
    EXPECT_NEAR(dot(axes.horizontal, beam), 0.0, 1e-15);
    EXPECT_NEAR(dot(axes.vertical, beam), 0.0, 1e-15);
    EXPECT_NEAR(dot(axes.vertical, axes.horizontal), 0.0, 1e-15);
    EXPECT_EQ(axes.horizontal.z, 0.0);
  }
  EXPECT_EQ(footprint_axes({1, 0, 0}).horizontal.y, 1.0);  // to the left
  EXPECT_EQ(footprint_axes({1, 0, 0}).vertical.z, 1.0);    // upwards
  // A wall that leans by 30 degrees to the left.
  const Vector3<double> normal{std::sqrt(0.75), 0.5, 0.0};
  EXPECT_NEAR(footprint_slope(normal, {1, 0, 0}, {0, 1, 0}), std::tan(0.5235987755982988), 1e-15);
  EXPECT_EQ(footprint_slope(normal, {1, 0, 0}, {0, 0, 1}), 0.0);
}

}  // namespace risley::sensors::range_values_test
