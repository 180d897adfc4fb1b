// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/furniture.hpp"

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/scenes/scene.hpp"

namespace risley::scenes::furniture_test {

const std::string kRoom = R"(
planes:
  - {name: wall, distance_m: 10, normal_azimuth_deg: 0, normal_zenith_deg: 90}
boxes:
  - {name: shelf, center_m: [6, 0, 0], size_m: [2, 1, 3], yaw_deg: 45, reflectivity: 0.4}
  - {name: table, center_m: [4, -3, -1], size_m: [1, 1, 0.2]}
people:
  - {name: walker, from_m: [5, 2, -1], to_m: [5, 6, -1], speed_m_per_s: 1.5, size_m: [0.5, 1.8], reflectivity: 0.5}
)";

TEST(Furniture, BoxesStandBeforeTheWall) {
  const Scene scene = parse_scene(kRoom, "room.yaml");
  EXPECT_EQ(scene.surfaces(), 4U);
  EXPECT_EQ(scene.surface_name(1), "shelf");
  EXPECT_EQ(scene.surface_name(2), "table");
  EXPECT_EQ(scene.surface_name(3), "walker");
  // Turned by 45 degrees: a ray along X meets the face whose normal is (-1, -1) or (-1, 1), 0.5 m
  // from the middle, at sqrt(0.5) m before it.
  const auto shelf = nearest_hit(scene, {0, 0, 0}, {1, 0, 0});
  ASSERT_TRUE(shelf);
  EXPECT_EQ(shelf->surface, 1U);
  EXPECT_NEAR(shelf->range, 6.0 - std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(shelf->cosine, std::sqrt(0.5), 1e-12);
  EXPECT_NEAR(std::abs(shelf->normal.x), std::sqrt(0.5), 1e-12);
  EXPECT_EQ(shelf->reflectivity, 0.4);
  // Over it, and from within it.
  EXPECT_EQ(nearest_hit(scene, {0, 0, 1.6}, {1, 0, 0})->surface, 0U);
  EXPECT_NEAR(nearest_hit(scene, {6, 0, 0}, {0, 0, 1})->range, 1.5, 1e-12);
  EXPECT_NEAR(nearest_hit(scene, {4, -3, 0}, {0, 0, -1})->range, 0.9, 1e-12);
  EXPECT_EQ(nearest_hit(scene, {4, -3, 0}, {0, 0, -1})->reflectivity, kMattReflectivity);
}

TEST(Furniture, PeopleWalkToAndFro) {
  const Scene scene = parse_scene(kRoom, "room.yaml");
  const Person& walker = scene.people.front();
  EXPECT_NEAR(walker.feet_at(0).y, 2.0, 1e-12);
  EXPECT_NEAR(walker.feet_at(2).y, 5.0, 1e-12);
  EXPECT_NEAR(walker.feet_at(4).y, 4.0, 1e-12);  // 6 m: 4 m there and 2 m back
  EXPECT_NEAR(walker.feet_at(8.0 / 1.5 + 2).y, 5.0, 1e-12);
  EXPECT_EQ(walker.feet_at(2).x, 5.0);
  EXPECT_EQ(walker.feet_at(2).z, -1.0);
  // Straight at the middle of the body, 0.9 m above the feet.
  for (const auto& [time, left] : {std::pair{0.0, 2.0}, {2.0, 5.0}, {4.0, 4.0}}) {
    const auto hit = nearest_hit(scene, {0, left, -0.1}, {1, 0, 0}, 0.5, time);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->surface, 3U);
    EXPECT_NEAR(hit->range, 4.75, 1e-12);
    EXPECT_NEAR(hit->cosine, 1.0, 1e-12);
    EXPECT_EQ(hit->reflectivity, 0.5);
    EXPECT_EQ(nearest_hit(scene, {0, left, -0.1}, {1, 0, 0}, 0.5, time + 1)->surface, 0U);
  }
  // The ellipsoid ends at the feet, at the head, and at half its width.
  EXPECT_NEAR(nearest_hit(scene, {5, 2, 5}, {0, 0, -1})->range, 4.2, 1e-12);
  EXPECT_EQ(nearest_hit(scene, {0, 2.249, -0.1}, {1, 0, 0})->surface, 3U);
  EXPECT_EQ(nearest_hit(scene, {0, 2.251, -0.1}, {1, 0, 0})->surface, 0U);
}

TEST(Furniture, WhoDoesNotWalkStandsStill) {
  EXPECT_EQ((Person{"a", {1, 2, 0}, {3, 2, 0}, 0.0}.feet_at(7).x), 1.0);
  EXPECT_EQ((Person{"a", {1, 2, 0}, {1, 2, 0}, 2.0}.feet_at(7).x), 1.0);
}

}  // namespace risley::scenes::furniture_test
