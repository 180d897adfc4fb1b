// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/scene.hpp"

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "refusal.hpp"
#include "source_tree.hpp"

namespace risley::scenes::scene_test {

using ::testing::HasSubstr;
using ::testing::StartsWith;

Vector3<double> towards(double azimuth_deg, double zenith_deg) {
  return direction_from_angles<double>(
      {radians_from_degrees(azimuth_deg), radians_from_degrees(zenith_deg)});
}

void expect_near(const Vector3<double>& a, const Vector3<double>& b) {
  EXPECT_LT(norm(a - b), 1e-15) << a.x << ' ' << a.y << ' ' << a.z;
}

const std::string kHall = R"(
planes:
  - {name: wall, distance_m: 30, normal_azimuth_deg: 10, normal_zenith_deg: 80}
  - {name: board, distance_m: 10, normal_azimuth_deg: 0, normal_zenith_deg: 90, extent_m: [2, 1], center_m: [3, -1], sigma_deg: 0.5}
stations:
  - {name: upright}
  - {name: flipped, position_m: [1, 2, 3], roll_deg: 180, pitch_deg: 0, yaw_deg: 30, sigma_deg: 0.02}
)";

TEST(Scene, ReadsPlanesAndStations) {
  const Scene scene = parse_scene(kHall, "hall.yaml");
  ASSERT_EQ(scene.planes.size(), 2u);
  EXPECT_EQ(scene.planes[0].name, "wall");
  EXPECT_EQ(scene.planes[0].plane.distance, 30.0);
  expect_near(scene.planes[0].plane.normal, towards(10, 80));
  EXPECT_FALSE(scene.planes[0].extent.has_value());
  EXPECT_EQ((*scene.planes[1].extent)[0], 2.0);
  EXPECT_EQ(scene.planes[1].center[1], -1.0);
  EXPECT_DOUBLE_EQ(*scene.planes[1].normal_sigma, radians_from_degrees(0.5));
  const Station flipped = scene.station("flipped");
  EXPECT_EQ(flipped.position.z, 3.0);
  EXPECT_DOUBLE_EQ(flipped.roll, kPi);
  EXPECT_DOUBLE_EQ(flipped.yaw, radians_from_degrees(30));
  EXPECT_DOUBLE_EQ(flipped.sigma, radians_from_degrees(0.02));
  EXPECT_EQ(scene.station("").position.x, 0.0);
  EXPECT_THAT(refusal([&] { static_cast<void>(scene.station("sideways")); }),
              NamesField("upright, flipped"));
}

TEST(Scene, BundledRoomIsClosedTowardsTheFront) {
  const Scene room = load_scene(in_source_tree("data/room.yaml"));
  for (int azimuth = -19; azimuth <= 19; ++azimuth) {
    for (int zenith = 71; zenith <= 109; ++zenith) {
      EXPECT_TRUE(nearest_hit(room, {0, 0, 0}, towards(azimuth, zenith)).has_value());
    }
  }
}

TEST(Scene, AxesOfAPlaneAreHorizontalAndUpright) {
  const Scene scene = parse_scene(R"(
planes:
  - {name: ahead, distance_m: 1, normal_azimuth_deg: 0, normal_zenith_deg: 90}
  - {name: ceiling, distance_m: 1, normal_azimuth_deg: 0, normal_zenith_deg: 0}
  - {name: any, distance_m: 1, normal_azimuth_deg: 40, normal_zenith_deg: 70}
)",
                                  "axes.yaml");
  expect_near(scene.planes[0].horizontal_axis, {0, 1, 0});  // to the left
  expect_near(scene.planes[0].vertical_axis, {0, 0, 1});
  expect_near(scene.planes[1].horizontal_axis, {0, 1, 0});
  for (const ScenePlane& plane : scene.planes) {
    EXPECT_EQ(plane.horizontal_axis.z, 0.0);
    EXPECT_NEAR(dot(plane.horizontal_axis, plane.plane.normal), 0.0, 1e-15);
    EXPECT_NEAR(dot(plane.vertical_axis, plane.plane.normal), 0.0, 1e-15);
    EXPECT_NEAR(norm(plane.vertical_axis), 1.0, 1e-15);
  }
}

TEST(Scene, NearestPlaneInFrontStopsTheRay) {
  const Scene scene = parse_scene(R"(
planes:
  - {name: far, distance_m: 20, normal_azimuth_deg: 0, normal_zenith_deg: 90}
  - {name: near, distance_m: 5, normal_azimuth_deg: 0, normal_zenith_deg: 90}
  - {name: behind, distance_m: 1, normal_azimuth_deg: 180, normal_zenith_deg: 90}
)",
                                  "walls.yaml");
  const auto ahead = nearest_hit(scene, {0, 0, 0}, {1, 0, 0});
  ASSERT_TRUE(ahead);
  EXPECT_EQ(ahead->surface, 1u);
  EXPECT_DOUBLE_EQ(ahead->range, 5.0);
  EXPECT_DOUBLE_EQ(ahead->cosine, 1.0);
  const auto past_it = nearest_hit(scene, {6, 0, 0}, towards(60, 90));
  ASSERT_TRUE(past_it);
  EXPECT_EQ(past_it->surface, 0u);
  EXPECT_NEAR(past_it->range, 28.0, 1e-12);
  EXPECT_NEAR(past_it->cosine, 0.5, 1e-12);
  EXPECT_EQ(nearest_hit(scene, {0, 0, 0}, {-1, 0, 0})->surface, 2u);
  EXPECT_FALSE(nearest_hit(scene, {0, 0, 0}, {0, 0, 1}));
}

TEST(Scene, ExtentEndsAPlaneAroundItsCenter) {
  const Scene scene = parse_scene(kHall, "hall.yaml");
  const auto hits_board = [&](double left, double up) {
    const auto hit = nearest_hit(scene, {0, 0, 0}, normalized(Vector3<double>{10.0, left, up}));
    return hit && hit->surface == 1;
  };
  // 2 m wide around 3 m to the left, 1 m high around 1 m below.
  EXPECT_TRUE(hits_board(3, -1));
  EXPECT_TRUE(hits_board(2.001, -1.499));
  EXPECT_TRUE(hits_board(3.999, -0.501));
  EXPECT_FALSE(hits_board(1.999, -1));
  EXPECT_FALSE(hits_board(4.001, -1));
  EXPECT_FALSE(hits_board(3, -0.499));
  EXPECT_FALSE(hits_board(3, -1.501));
  EXPECT_FALSE(hits_board(0, 0));
}

TEST(Scene, StationTurnsRollThenPitchThenYaw) {
  Station station;
  station.yaw = radians_from_degrees(90);
  expect_near(station.scene_from_sensor({1, 0, 0}), {0, 1, 0});  // looks left
  station = {};
  station.pitch = radians_from_degrees(90);
  expect_near(station.scene_from_sensor({1, 0, 0}), {0, 0, -1});  // looks down
  station = {};
  station.roll = radians_from_degrees(90);
  expect_near(station.scene_from_sensor({0, 1, 0}), {0, 0, 1});
  station.pitch = station.yaw = radians_from_degrees(90);
  // Y: roll to Z, pitch to X, yaw to Y.
  expect_near(station.scene_from_sensor({0, 1, 0}), {0, 1, 0});
}

TEST(Scene, MistakesAreToldWithTheirLine) {
  struct Mistake {
    std::string text;
    int line;
    const char* message;
  };
  const std::string wall =
      "planes:\n  - name: a\n    distance_m: 3\n    normal_azimuth_deg: 0\n"
      "    normal_zenith_deg: 90\n    ";
  const Mistake mistakes[] = {
      {"planes: []\nwalls: []\n", 2, "unknown field walls"},
      {"planes:\n  name: a\n", 1, "expected a list"},
      {"planes:\n  - 3\n", 2, "planes[0]: expected a map"},
      {"planes:\n"
       "  - {name: a, distance_m: 3, normal_azimuth_deg: 0, normal_zenith_deg: 90}\n"
       "  - {name: b, distance_m: 3, normal_azimuth_deg: 0, normal_zenith: 90}\n",
       3, "unknown field planes[1].normal_zenith"},
      {"planes:\n  - {name: a, distance_m: 3, normal_azimuth_deg: 0}\n", 2,
       "planes[0].normal_zenith_deg is missing"},
      {"planes:\n  - {distance_m: 3, normal_azimuth_deg: 0, normal_zenith_deg: 90}\n", 2,
       "planes[0].name is missing"},
      {"stations:\n  - {name: a}\n  - {name: a}\n", 3, "appears twice"},
      {"planes:\n"
       "  - {name: a, normal_azimuth_deg: 0, normal_zenith_deg: 90, distance_m: 0}\n",
       2, "planes[0].distance_m = 0 m, allowed 0.001 to"},
      {"planes:\n  - name: a\n    distance_m: 3\n    normal_azimuth_deg: 0\n"
       "    normal_zenith_deg: 190\n",
       5, "normal_zenith_deg = 190 deg, allowed 0 to 180"},
      {"planes:\n  - name: a\n    distance_m: .nan\n    normal_azimuth_deg: 0\n"
       "    normal_zenith_deg: 90\n",
       3, "planes[0].distance_m: expected a finite number"},
      {wall + "extent_m: [1]\n", 6, "extent_m: expected a list of 2 numbers in m"},
      {wall + "extent_m: [1, -1]\n", 6, "extent_m[1] = -1 m"},
      {wall + "center_m: [0, 0]\n", 6, "center_m needs planes[0].extent_m"},
      {"stations:\n  - {name: a, sigma_deg: -1}\n", 2, "sigma_deg = -1 deg, allowed 0"},
      {"planes: [\n", 2, "YAML"},
      {wall + "waves: {peak_to_valley_m: 0.01}\n", 6, "planes[0].waves.half_wave_m is missing"},
      {wall + "waves: {peak_to_valley_mm: 1, half_wave_m: 1}\n", 6,
       "unknown field planes[0].waves.peak_to_valley_mm"},
      {wall + "waves: {peak_to_valley_m: -0.01, half_wave_m: 1}\n", 6,
       "peak_to_valley_m = -0.01 m, allowed 0 to 1"},
      {wall + "waves: [{peak_to_valley_m: 0.01, half_wave_m: 0.01}]\n", 6,
       "planes[0].waves[0].half_wave_m = 0.01 m, allowed 0.05"},
      {wall + "bow_m: 0.01\n", 6, "bow_m needs planes[0].extent_m"},
      {wall + "reflectivity: 0\n", 6, "reflectivity = 0"},
      {wall + "glass: 1\n", 6, "glass"},
      {wall + "patches: [{center_m: [0, 0]}]\n", 6, "planes[0].patches[0].size_m is missing"},
      {wall + "patches: [{center_m: [0, 0], size_m: [1, 1], depth_m: 1000}]\n", 6,
       "depth_m = 1000 m, allowed -100 to 100"},
      {wall + "patches: 3\n", 6, "patches: expected a list"},
      {"boxes:\n  - {center_m: [1, 2, 3], size_m: [1, 1, 1]}\n", 2, "boxes[0].name is missing"},
      {"boxes:\n  - {name: a, center_m: [1, 2, 3], size_m: [1, 0, 1]}\n", 2,
       "boxes[0].size_m[1] = 0 m, allowed 0.001"},
      {"boxes:\n  - {name: a, center_m: [1, 2], size_m: [1, 1, 1]}\n", 2,
       "center_m: expected a list of 3 numbers in m"},
      {"boxes:\n  - {name: a, center_m: [1, 2, 3], size_m: [1, 1, 1]}\n"
       "people:\n  - {name: a, from_m: [1, 2, 3], to_m: [1, 1, 1], speed_m_per_s: 1}\n",
       4, "appears twice"},
      {"people:\n  - {name: a, from_m: [1, 2, 3], to_m: [1, 1, 1]}\n", 2,
       "people[0].speed_m_per_s is missing"},
      {"people:\n  - {name: a, from_m: [1, 2, 3], to_m: [1, 1, 1], speed_m_per_s: -1}\n", 2,
       "speed_m_per_s = -1 m/s, allowed 0 to 100"},
      {"planes: []\nfootprint: 9\n", 2, "footprint"}};
  for (const auto& [text, line, message] : mistakes) {
    EXPECT_THAT(line_and_problem([&] { parse_scene(text, "scene.yaml"); }),
                AllOf(StartsWith(std::to_string(line) + ": "), HasSubstr(message)));
  }
}

}  // namespace risley::scenes::scene_test
