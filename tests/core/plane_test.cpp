// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/plane.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

namespace risley::plane_test {

Plane tilted_wall() {
  return plane_from_angles({radians_from_degrees(10.0), radians_from_degrees(80.0)}, 30.0);
}

TEST(Plane, NormalPointsAwayFromTheOriginAtItsDistance) {
  const Plane wall = tilted_wall();
  EXPECT_NEAR(norm(wall.normal), 1.0, 1e-15);
  EXPECT_GT(wall.normal.x, 0.0);
  EXPECT_GT(wall.normal.y, 0.0);  // azimuth turns from X towards Y
  EXPECT_GT(wall.normal.z, 0.0);  // zenith 80 leans up
  EXPECT_NEAR(signed_distance(wall, {0, 0, 0}), -30.0, 1e-13);
  EXPECT_NEAR(signed_distance(wall, 30.0 * wall.normal), 0.0, 1e-13);
  EXPECT_NEAR(signed_distance(wall, 31.5 * wall.normal), 1.5, 1e-13);
}

TEST(Plane, EveryRayEndsOnThePlane) {
  const Plane wall = tilted_wall();
  for (int azimuth = -40; azimuth <= 40; azimuth += 10) {
    for (int zenith = 60; zenith <= 120; zenith += 10) {
      const Vector3<double> origin{0.5, -1.0, 2.0};
      const Vector3<double> direction = direction_from_angles<double>(
          {radians_from_degrees(azimuth), radians_from_degrees(zenith)});
      const double range = hit_distance(wall, origin, direction);
      EXPECT_GT(range, 0.0);
      EXPECT_NEAR(signed_distance(wall, origin + range * direction), 0.0, 1e-12);
      EXPECT_NEAR(hit_distance(wall, origin, -direction), -range, 1e-12);
    }
  }
}

TEST(Plane, ParallelRayNeverMeetsIt) {
  const Plane floor{{0.0, 0.0, -1.0}, 1.4};
  EXPECT_TRUE(std::isnan(hit_distance(floor, {0, 0, 0}, {1.0, 0.0, 0.0})));
  EXPECT_EQ(hit_distance(floor, {0, 0, 0}, {0.0, 0.0, -1.0}), 1.4);
}

}  // namespace risley::plane_test
