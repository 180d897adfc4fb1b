// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/sensor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::sensors {
namespace {

using ::testing::HasSubstr;

TEST(Sensor, SetsAndGetsEveryParameterInSiUnits) {
  Sensor sensor = load_sensor("mid-40");
  for (const ParameterInfo& info : parameter_list({2})) {
    if (info.kind == ParameterKind::rotation_angle) continue;
    const double value = 0.75 * info.lower + 0.25 * info.upper;
    sensor.set(info.name, value);
    EXPECT_EQ(sensor.get(info.name), value) << info.name;
  }
}

TEST(Sensor, RefusesWhatItDoesNotHaveAndWhatIsOutOfBounds) {
  Sensor sensor = load_sensor("mid-40");
  EXPECT_THROW(sensor.get("rotation_angle_a_deg"), InvalidArgument);
  EXPECT_THROW(sensor.set("wedge_angle_c_deg", 0.1), InvalidArgument);
  try {
    sensor.set("wedge_angle_a_deg", radians_from_degrees(95.0));
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), HasSubstr("wedge_angle_a_deg = 95 deg, allowed 0 to 60"));
  }
  EXPECT_NEAR(sensor.get("wedge_angle_a_deg"), radians_from_degrees(18.0), 1e-15);
}

TEST(Sensor, KnowledgeOfAllPrismsBecomesKnowledgeOfEach) {
  Sensor sensor = load_sensor("mid-40");
  const Knowledge of_all = *sensor.find_knowledge("refractive_index");
  sensor.set("refractive_index_b", 1.5);
  EXPECT_EQ(sensor.find_knowledge("refractive_index"), nullptr);
  for (const char* name : {"refractive_index_a", "refractive_index_b"}) {
    ASSERT_NE(sensor.find_knowledge(name), nullptr) << name;
    EXPECT_EQ(sensor.find_knowledge(name)->sigma, of_all.sigma);
  }
  EXPECT_NE(sensor.find_knowledge("wedge_angle_deg"), nullptr);
}

TEST(Sensor, SetKnowledgeReplaces) {
  Sensor sensor = load_sensor("mid-40");
  const std::size_t before = sensor.knowledge.size();
  sensor.set_knowledge({"refractive_index", 0.5, "test"});
  EXPECT_EQ(sensor.knowledge.size(), before);
  EXPECT_EQ(sensor.find_knowledge("refractive_index")->sigma, 0.5);
}

TEST(Sensor, CombinationsSwapSpeedsAndKeepTheirDirections) {
  Sensor sensor = load_sensor("mid-40");
  sensor.set_knowledge({"angular_velocity_a_deg_per_s", 1.0, "a"});
  sensor.set_knowledge({"angular_velocity_b_deg_per_s", 2.0, "b"});
  sensor.covariance_names = {"angular_velocity_a_deg_per_s", "refractive_index",
                             "angular_velocity_b_deg_per_s"};
  sensor.covariance.resize(3, 3);
  sensor.covariance << 1.0, 0.1, 0.2, 0.1, 3.0, 0.3, 0.2, 0.3, 4.0;
  const Sensor other = with_combination(sensor, 2);
  EXPECT_EQ(other.angular_velocity[0], -sensor.angular_velocity[1]);
  EXPECT_EQ(other.angular_velocity[1], -sensor.angular_velocity[0]);
  EXPECT_LT(other.angular_velocity[0], 0.0);
  EXPECT_GT(other.angular_velocity[1], 0.0);
  EXPECT_EQ(other.find_knowledge("angular_velocity_a_deg_per_s")->sigma, 2.0);
  EXPECT_EQ(other.covariance_names[0], "angular_velocity_b_deg_per_s");
  EXPECT_EQ(other.covariance(0, 0), 1.0);
  EXPECT_EQ(other.covariance(0, 1), -0.1);
  EXPECT_EQ(other.covariance(0, 2), 0.2);
  const Sensor back = with_combination(other, 1);
  EXPECT_EQ(back.angular_velocity, sensor.angular_velocity);
  EXPECT_EQ(back.covariance, sensor.covariance);
  EXPECT_EQ(back.covariance_names, sensor.covariance_names);
  EXPECT_EQ(with_combination(sensor, 1).angular_velocity, sensor.angular_velocity);
}

TEST(Sensor, OneCombinationOnlyIsSaid) {
  Sensor sensor = load_sensor("mid-40");
  sensor.combination.reset();
  EXPECT_THROW(with_combination(sensor, 2), InvalidArgument);
}

}  // namespace
}  // namespace risley::sensors
