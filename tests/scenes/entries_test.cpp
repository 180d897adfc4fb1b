// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <limits>

#include <gmock/gmock.h>

#include "risley/scenes/scene.hpp"

#include "refusal.hpp"

namespace risley::scenes::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(Entries, RaysAskForAnOriginAndAUnitVector) {
  Scene scene;
  scene.planes.emplace_back();
  scene.planes.back().plane = {{1, 0, 0}, 10.0};
  const auto run = [&](const Vector3<double>& origin, const Vector3<double>& direction) {
    return refusal([&] { return nearest_hit(scene, origin, direction); });
  };
  EXPECT_EQ(run({kNan, 0, 0}, {1, 0, 0}), "origin.x = nan m, allowed finite");
  EXPECT_EQ(run({0, kInfinite, 0}, {1, 0, 0}), "origin.y = inf m, allowed finite");
  EXPECT_EQ(run({0, 0, kNan}, {1, 0, 0}), "origin.z = nan m, allowed finite");
  EXPECT_EQ(run({0, 0, 0}, {0, 0, 0}), "direction has length 0, expected a unit vector");
  EXPECT_EQ(run({0, 0, 0}, {2, 0, 0}), "direction has length 2, expected a unit vector");
  EXPECT_EQ(run({0, 0, 0}, {0, kNan, 0}), "direction has length nan, expected a unit vector");
  EXPECT_EQ(run({0, 0, 0}, {1, 0, 0}), "");
  EXPECT_EQ(refusal([&] {
              return nearest_hit(scene, {0, 0, 0}, {1, 0, 0}, 0.5, kNan);
            }),
            "time = nan s, allowed finite");
}

TEST(Entries, StationsAskForAKnownName) {
  Scene scene;
  EXPECT_EQ(refusal([&] { return scene.station("roof"); }),
            "unknown station \"roof\", the scene has: none");
  scene.stations.resize(2);
  scene.stations[0].name = "cellar";
  scene.stations[1].name = "attic";
  EXPECT_EQ(refusal([&] { return scene.station("roof"); }),
            "unknown station \"roof\", the scene has: cellar, attic");
}

}  // namespace risley::scenes::entries_test
