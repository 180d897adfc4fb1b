// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How recordings stood to each other, found from the planes that they share.
#include "calibration/same_walls.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

#include "calibration/walls.hpp"

namespace risley::same_walls_test {

using calibration::FoundPlane;
using calibration::FoundPoses;
using calibration::poses_before_same_walls;

const std::vector<std::string> kNames{"first", "second"};

scenes::Scene room(double left, double right, double ceiling, double floor) {
  scenes::Scene scene;
  scene.planes = {testing::wall("end", 0, 90, 12), testing::wall("left", 90, 90, left),
                  testing::wall("right", -90, 90, right), testing::wall("ceiling", 0, 0, ceiling),
                  testing::wall("floor", 0, 180, floor)};
  return scene;
}

/// The planes of a scene as a station sees them.
std::vector<FoundPlane> planes_from(const scenes::Scene& scene, const scenes::Station& pose,
                                    std::size_t recording) {
  std::vector<FoundPlane> found;
  const Eigen::Matrix3d turn = testing::rotation_of(pose);
  for (const scenes::ScenePlane& plane : scene.planes) {
    FoundPlane one;
    one.recording = recording;
    one.plane = {testing::plain(turn.transpose() * testing::eigen(plane.plane.normal)),
                 plane.plane.distance - dot(plane.plane.normal, pose.position)};
    one.points = 1000;
    found.push_back(one);
  }
  return found;
}

FoundPoses poses_of(const scenes::Scene& scene, const scenes::Station& pose) {
  auto found = planes_from(scene, testing::station("first", 0, 0, 0, 0), 0);
  const auto second = planes_from(scene, pose, 1);
  found.insert(found.end(), second.begin(), second.end());
  return poses_before_same_walls(found, kNames);
}

TEST(SameWalls, FindTheTurnAndTheShift) {
  const scenes::Scene scene = room(2.0, 3.5, 1.4, 2.3);
  for (const double roll_deg : {0.0, 90.0, 178.0}) {
    const scenes::Station pose =
        testing::station("second", roll_deg, 1.5, -12.0, 0, {0.04, -0.11, 0.07});
    const FoundPoses poses = poses_of(scene, pose);
    ASSERT_EQ(poses.stations.size(), 2u) << poses.why_not;
    EXPECT_EQ(poses.reference, 0u);
    const Eigen::Matrix3d off =
        testing::rotation_of(poses.stations[1]).transpose() * testing::rotation_of(pose);
    EXPECT_LT(Eigen::AngleAxisd(off).angle(), 1e-9) << roll_deg;
    EXPECT_LT((testing::eigen(poses.stations[1].position) - testing::eigen(pose.position)).norm(),
              1e-4);
    EXPECT_TRUE(std::isinf(poses.stations[1].sigma));
  }
}

TEST(SameWalls, ARoomThatFitsInTwoWaysHasNoAnswer) {
  const FoundPoses poses =
      poses_of(room(2.0, 2.0, 1.5, 1.5), testing::station("second", 180, 0, 0, 0));
  EXPECT_TRUE(poses.stations.empty());
  EXPECT_NE(poses.why_not.find("several ways"), std::string::npos);
}

TEST(SameWalls, OtherWallsAreNotTheSame) {
  auto found = planes_from(room(2.0, 3.5, 1.4, 2.3), testing::station("first", 0, 0, 0, 0), 0);
  const auto other =
      planes_from(room(5.0, 1.0, 3.0, 1.2), testing::station("second", 0, 0, 0, 0), 1);
  found.insert(found.end(), other.begin(), other.end());
  EXPECT_TRUE(poses_before_same_walls(found, kNames).stations.empty());
}

TEST(SameWalls, OneWallFixesNoTurn) {
  scenes::Scene scene;
  scene.planes = {testing::wall("wall", 40, 90, 5)};
  EXPECT_TRUE(poses_of(scene, testing::station("second", 180, 0, 0, 0)).stations.empty());
}

}  // namespace risley::same_walls_test
