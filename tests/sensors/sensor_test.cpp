// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/sensor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/sensors/prism_sizes.hpp"

#include "refusal.hpp"

namespace risley::sensors::sensor_test {

using ::testing::ElementsAre;
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
  EXPECT_THAT(refusal([&] { sensor.set("wedge_angle_a_deg", radians_from_degrees(95.0)); }),
              NamesField("wedge_angle_a_deg"));
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

TEST(Combinations, MayBeAListOfAnyLength) {
  Sensor sensor = load_sensor("horizon");
  const std::vector<double> own = sensor.angular_velocity;  // (-a, a, -c)
  const double slow = own[2];
  sensor.combination = 2;
  sensor.combinations = {{{own[0], 0.0, slow}, {}},
                         {own, {}},
                         {{-slow, own[0], own[1]}, parse_face_order("PA-AP-PA")}};
  sensor.set("angular_velocity_a_deg_per_s", own[0] + 1.0);  // a unit's own speed
  sensor.covariance_names = {"angular_velocity_c_deg_per_s", "refractive_index_a"};
  sensor.covariance = (Eigen::MatrixXd(2, 2) << 4.0, 0.5, 0.5, 1.0).finished();
  const Sensor third = with_combination(sensor, 3);
  EXPECT_EQ(third.combination, 3);
  EXPECT_EQ(third.train.face_order(), parse_face_order("PA-AP-PA"));
  EXPECT_EQ(third.train.parameters(), sensor.train.parameters());
  EXPECT_EQ(third.angular_velocity, (std::vector{-slow, own[0] + 1.0, own[1]}));
  EXPECT_EQ(third.covariance_names.front(), "angular_velocity_a_deg_per_s");
  EXPECT_EQ(third.covariance(0, 1), -0.5);
  EXPECT_EQ(third.covariance(0, 0), 4.0);
  // One with a prism that does not turn has other speeds: those of the list.
  const Sensor first = with_combination(sensor, 1);
  EXPECT_EQ(first.angular_velocity, (std::vector{own[0], 0.0, slow}));
  EXPECT_THROW(with_combination(sensor, 4), InvalidArgument);
  EXPECT_THROW(with_combination(sensor, 0), InvalidArgument);
  const auto all = in_all_combinations(sensor);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0].combination, 2);
  EXPECT_EQ(all[1].combination, 1);
  EXPECT_EQ(all[2].combination, 3);
  // The list travels in the preset.
  const Sensor again = parse_preset(preset_text(sensor), "again");
  ASSERT_EQ(again.combinations.size(), 3u);
  EXPECT_EQ(again.combination, 2);
  EXPECT_EQ(again.combinations[2].angular_velocity, sensor.combinations[2].angular_velocity);
  EXPECT_EQ(again.combinations[2].face_order, sensor.combinations[2].face_order);
  EXPECT_EQ(preset_text(again), preset_text(sensor));
}

TEST(Combinations, OfTwoRotorsNeedNoList) {
  const Sensor sensor = load_sensor("mid-40");
  const auto all = in_all_combinations(sensor);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[1].combination, 2);
  EXPECT_EQ(all[1].angular_velocity,
            (std::vector{-sensor.angular_velocity[1], -sensor.angular_velocity[0]}));
  EXPECT_EQ(in_all_combinations(load_sensor("horizon")).size(), 1u);
}

TEST(PrismSizes, MayBeThePrismsOwnInAPreset) {
  Sensor sensor = load_sensor("horizon");
  sensor.geometry = {{0.007, 0.008, 0.009}, {0.03, 0.02}};
  sensor.set_knowledge({"prism_thickness_b_m", 0.001, "measured"});
  const std::string text = preset_text(sensor);
  const Sensor again = parse_preset(text, "again");
  EXPECT_EQ(again.geometry, sensor.geometry);
  EXPECT_EQ(again.find_knowledge("prism_thickness_b_m")->sigma, 0.001);
  EXPECT_EQ(preset_text(again), text);
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    return changed;
  };
  EXPECT_THROW(parse_preset(with("prism_thickness_c_m", "prism_thickness_m"), "x"), FileError);
  EXPECT_THROW(parse_preset(with("prism_spacing_b_m", "prism_spacing_c_m"), "x"), FileError);
  EXPECT_THROW(parse_preset(with("value: 0.008", "value: -0.2"), "x"), FileError);
  sensor.geometry.thickness.pop_back();
  EXPECT_THROW(preset_text(sensor), InvalidArgument);
}

TEST(PrismSizes, AreStatedByEveryPreset) {
  for (const std::string& name : builtin_preset_names()) {
    SCOPED_TRACE(name);
    const Sensor sensor = load_sensor(name);
    if (sensor.train.layout().reflects()) {  // beams start at one point
      EXPECT_EQ(sensor.geometry, (PrismGeometry{{0}, {0}}));
      continue;
    }
    EXPECT_EQ(sensor.geometry, (PrismGeometry{{0.007}, {0.030}}));
    const bool paper = name.starts_with("mid-40");
    for (const PrismSize& size : shared_prism_sizes()) {
      const Knowledge* known = sensor.find_knowledge(size.name);
      ASSERT_NE(known, nullptr);
      EXPECT_EQ(known->source.starts_with("Brazeal"), paper);
      EXPECT_THAT(known->source, HasSubstr("assumed"));
    }
    EXPECT_EQ(sensor.find_knowledge("prism_thickness_m")->sigma, paper ? 0.001 : 0.005);
    EXPECT_EQ(sensor.find_knowledge("prism_spacing_m")->sigma, paper ? 0.003 : 0.020);
  }
}

TEST(PrismSizes, MayBeInACovariance) {
  Sensor sensor = load_sensor("mid-40");
  sensor.covariance_names = {"prism_tilt_b_vertical_deg", "prism_thickness_a_m",
                             "prism_spacing_a_m"};
  sensor.covariance.resize(3, 3);
  sensor.covariance << 1e-8, 1e-8, 1e-8, 1e-8, 1e-6, 1e-7, 1e-8, 1e-7, 9e-6;
  const std::string text = preset_text(sensor);
  const Sensor again = parse_preset(text, "again");
  EXPECT_EQ(again.covariance_names, sensor.covariance_names);
  EXPECT_EQ(again.covariance, sensor.covariance);
  std::string wrong = text;
  wrong.replace(wrong.find("prism_spacing_a_m"), 17, "prism_spacing_b_m");  // of three prisms
  EXPECT_THROW(parse_preset(wrong, "x"), FileError);
  // Thin prisms have no sizes.
  sensor.set_prism_geometry({});
  EXPECT_THAT(sensor.covariance_names, ElementsAre("prism_tilt_b_vertical_deg"));
  EXPECT_EQ(sensor.covariance.rows(), 1);
}

TEST(PrismSizes, AreFoundByName) {
  Sensor sensor = load_sensor("horizon");
  sensor.geometry = {{0.007}, {0.03, 0.02}};
  const auto value = [&](const char* name) {
    return prism_size(sensor, *find_prism_size(name, 3));
  };
  EXPECT_EQ(value("prism_thickness_m"), 0.007);
  EXPECT_EQ(value("prism_thickness_c_m"), 0.007);
  EXPECT_EQ(value("prism_spacing_b_m"), 0.02);
  sensor.geometry = {};
  EXPECT_EQ(value("prism_spacing_b_m"), 0);
  EXPECT_FALSE(find_prism_size("prism_spacing_c_m", 3));
  EXPECT_FALSE(find_prism_size("wedge_angle_deg", 3));
}

TEST(PrismSizes, AreUncertainByTheCovarianceOrBySigmas) {
  Sensor sensor = load_sensor("mid-40");
  const auto names = [&] {
    std::vector<std::string> list;
    for (const PrismSize& size : uncertain_prism_sizes(sensor)) list.push_back(size.name);
    return list;
  };
  EXPECT_THAT(names(), ElementsAre("prism_thickness_m", "prism_spacing_m"));
  sensor.covariance_names = {"prism_thickness_a_m", "prism_thickness_b_m"};
  sensor.covariance = Eigen::Matrix2d::Identity();
  EXPECT_THAT(names(),
              ElementsAre("prism_spacing_m", "prism_thickness_a_m", "prism_thickness_b_m"));
  sensor.set_prism_geometry({{0.007}, {0.03}});  // whoever sets them knows them
  EXPECT_THAT(names(), ElementsAre());
}

TEST(Sensor, OneThatWasNotSetHasNoPrisms) {
  const Sensor sensor;
  EXPECT_EQ(sensor.prisms(), 0);
  EXPECT_THROW(sensor.get("refractive_index"), InvalidArgument);
  EXPECT_THROW(preset_text(sensor), InvalidArgument);
}

}  // namespace risley::sensors::sensor_test
