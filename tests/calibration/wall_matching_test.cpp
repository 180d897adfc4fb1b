// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/wall_matching.hpp"

#include <string>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

#include "calibration/walls.hpp"
#include "refusal.hpp"
#include "warning_codes.hpp"

namespace risley::calibration::wall_matching_test {

using ::testing::AllOf;
using ::testing::ElementsAre;
using testing::station;
using testing::wall;

/// A plane of the scene as a station finds it: nothing off.
FoundPlane found_from(std::size_t recording, const scenes::Station& pose,
                      const scenes::ScenePlane& plane) {
  Plane mine;
  mine.normal =
      testing::plain(testing::rotation_of(pose).transpose() * testing::eigen(plane.plane.normal));
  mine.distance = plane.plane.distance - dot(plane.plane.normal, pose.position);
  return {recording, mine, 1000, 99};
}

/// Turns the normal of a found plane about Z.
FoundPlane off_by(FoundPlane plane, double degrees) {
  const auto angles = angles_from_direction(plane.plane.normal);
  plane.plane.normal = direction_from_angles(
      SphericalAngles<double>{angles.azimuth + radians_from_degrees(degrees), angles.zenith});
  return plane;
}

std::vector<std::size_t> walls_of(const std::vector<FoundPlane>& found) {
  std::vector<std::size_t> walls;
  for (const FoundPlane& plane : found) walls.push_back(plane.wall);
  return walls;
}

std::vector<std::string> names_of(const WallMatching& matching) {
  std::vector<std::string> names;
  for (const Wall& w : matching.walls) names.push_back(w.name);
  return names;
}

const scenes::ScenePlane kLeft = wall("left", 40, 88, 10);
const scenes::ScenePlane kRight = wall("right", -45, 85, 12);
const scenes::Station kUpright = station("upright", 0, 0, 0, 0.05);
const scenes::Station kFlipped = station("flipped", 180, 3, -10, 0.08, {0.5, -1.0, 0.3});

TEST(WallMatching, WithoutADatumEveryPlaneIsAWallOfItsOwn) {
  std::vector<FoundPlane> found{found_from(0, kUpright, kLeft), found_from(0, kUpright, kRight),
                                found_from(1, kUpright, kLeft)};
  const WallMatching matching = match_walls(found, {"one.lvx", "two.lvx"}, std::nullopt, {});
  EXPECT_FALSE(matching.stations_known);
  EXPECT_THAT(walls_of(found), ElementsAre(0, 1, 2));
  EXPECT_THAT(names_of(matching), ElementsAre("plane 1", "plane 2", "plane 3"));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_LT(matching.walls[i].normal_sigma, 0.0);
    EXPECT_EQ(norm(matching.walls[i].normal - found[i].plane.normal), 0.0);
  }
  ASSERT_EQ(matching.stations.size(), 2u);
  EXPECT_EQ(matching.stations[0].name, "one.lvx");
  EXPECT_EQ(matching.stations[1].name, "two.lvx");
  for (const StationPose& pose : matching.stations) {
    EXPECT_EQ(pose.scene_from_sensor, Eigen::Matrix3d::Identity());
    EXPECT_EQ(pose.stated, Eigen::Matrix3d::Identity());
    EXPECT_EQ(pose.sigma, 0.0);
  }
  EXPECT_TRUE(matching.warnings.empty());
}

TEST(WallMatching, AFlippedStationSeesTheSameWalls) {
  std::vector<FoundPlane> found{found_from(0, kUpright, kLeft), found_from(0, kUpright, kRight),
                                off_by(found_from(1, kFlipped, kRight), 1.0),
                                off_by(found_from(1, kFlipped, kLeft), -1.5)};
  const WallMatching matching =
      match_walls(found, {"one", "two"}, std::nullopt, {kUpright, kFlipped});
  EXPECT_TRUE(matching.stations_known);
  EXPECT_THAT(walls_of(found), ElementsAre(0, 1, 1, 0));
  ASSERT_EQ(matching.walls.size(), 2u);
  EXPECT_THAT(names_of(matching), ElementsAre("plane 1", "plane 2"));
  // Walls stand in the scene, as the first station found them.
  EXPECT_LT(angle_between(matching.walls[0].normal, kLeft.plane.normal), 1e-14);
  EXPECT_LT(angle_between(matching.walls[1].normal, kRight.plane.normal), 1e-14);
  ASSERT_EQ(matching.stations.size(), 2u);
  EXPECT_EQ(matching.stations[1].name, "flipped");
  EXPECT_EQ(matching.stations[1].sigma, kFlipped.sigma);
  EXPECT_EQ(matching.stations[1].stated, testing::rotation_of(kFlipped));
  EXPECT_EQ(matching.stations[1].scene_from_sensor, matching.stations[1].stated);
}

/// Scene planes have two sides: one seen from behind is the same wall, its normal the other way.
TEST(WallMatching, AWallSeenFromBehindIsTheSame) {
  const scenes::ScenePlane between = wall("between", 0, 90, 8);
  const scenes::Station beyond = station("beyond", 0, 0, 180, 0.05, {20, 0, 0});
  FoundPlane behind = found_from(1, beyond, between);
  EXPECT_DOUBLE_EQ(behind.plane.distance, -12.0);
  behind.plane = {-behind.plane.normal, 12.0};  // as a sensor has it
  std::vector<FoundPlane> found{found_from(0, kUpright, between), behind};
  const WallMatching matching =
      match_walls(found, {"one", "two"}, std::nullopt, {kUpright, beyond});
  EXPECT_THAT(walls_of(found), ElementsAre(0, 0));
  EXPECT_EQ(found[0].side, 1.0);
  EXPECT_EQ(found[1].side, -1.0);
  PlanarProblem problem;
  problem.walls = matching.walls;
  problem.stations = matching.stations;
  problem.views.push_back({1, 0, 12.0, 1e-4, nullptr, found[1].side});
  const PlaneView view = plane_view(problem, 0);
  EXPECT_LT(angle_between(view.plane.normal, behind.plane.normal), 1e-14);
  EXPECT_NEAR(dot(view.tangent_1, view.plane.normal), 0.0, 1e-15);
  EXPECT_NEAR(dot(view.tangent_2, view.plane.normal), 0.0, 1e-15);
}

/// Parallel walls are distinguished by their distances in the scene.
TEST(WallMatching, PositionsShiftDistances) {
  const scenes::ScenePlane near = wall("near", 0, 90, 8), far = wall("far", 0, 90, 14);
  const scenes::Station back = station("back", 0, 0, 0, 0.05),
                        front = station("front", 0, 0, 0, 0.05, {6, 0, 0});
  // Eight metres before the near wall as from the back, eight metres before the far one in front.
  std::vector<FoundPlane> found{found_from(0, back, near), found_from(0, back, far),
                                found_from(1, front, far)};
  EXPECT_DOUBLE_EQ(found[2].plane.distance, 8.0);
  match_walls(found, {"one", "two"}, std::nullopt, {back, front});
  EXPECT_THAT(walls_of(found), ElementsAre(0, 1, 1));
}

TEST(WallMatching, KnownPlanesAreFoundByNormalAndDistance) {
  scenes::Scene scene;
  scene.planes = {wall("sure", 10, 90, 12, 0.02), wall("named", -30, 90, 12),
                  wall("behind it", 10, 90, 20, 0.5)};
  std::vector<FoundPlane> found{
      off_by(found_from(0, kUpright, scene.planes[2]), 2.0),
      off_by(found_from(0, kUpright, scene.planes[0]), 1.0),
      off_by(found_from(0, kUpright, scene.planes[1]), -3.0),
      found_from(0, kUpright, wall("unlisted", 0, 10, 2.5)),
  };
  const WallMatching matching = match_walls(found, {"one"}, scene, {});
  EXPECT_TRUE(matching.stations_known);
  EXPECT_THAT(names_of(matching), ElementsAre("sure", "named", "behind it", "plane 1"));
  EXPECT_THAT(walls_of(found), ElementsAre(2, 0, 1, 3));
  EXPECT_TRUE(matching.warnings.empty());
  EXPECT_DOUBLE_EQ(matching.walls[0].normal_sigma, radians_from_degrees(0.02));
  EXPECT_LT(matching.walls[1].normal_sigma, 0.0);
  EXPECT_DOUBLE_EQ(matching.walls[2].normal_sigma, radians_from_degrees(0.5));
  // Known normals start where they are stated, those of listed names where they were found.
  EXPECT_EQ(norm(matching.walls[0].normal - scene.planes[0].plane.normal), 0.0);
  EXPECT_EQ(norm(matching.walls[0].stated - scene.planes[0].plane.normal), 0.0);
  EXPECT_LT(angle_between(matching.walls[1].normal, found[2].plane.normal), 1e-14);
  EXPECT_LT(angle_between(matching.walls[3].normal, found[3].plane.normal), 1e-14);
}

TEST(WallMatching, OfTwoCandidatesTheNearerNormalWins) {
  scenes::Scene scene;
  scene.planes = {wall("a", 0, 90, 10, 0.1), wall("b", 4, 90, 10, 0.1)};
  for (const auto& [azimuth, expected] : {std::pair(1.5, 0u), std::pair(2.5, 1u)}) {
    std::vector<FoundPlane> found{found_from(0, kUpright, wall("", azimuth, 90, 10))};
    const WallMatching matching = match_walls(found, {"one"}, scene, {});
    ASSERT_EQ(matching.walls.size(), 1u);
    EXPECT_EQ(matching.walls[0].name, scene.planes[expected].name);
  }
}

/// Five degrees, and 0.3 m plus a twentieth of the distance.
TEST(WallMatching, AsFarAsUncalibratedPlanesMayBeOff) {
  const auto same = [](double azimuth, double distance) {
    scenes::Scene scene;
    scene.planes = {wall("known", 0, 90, 10), wall("other", 90, 90, 10)};
    std::vector<FoundPlane> found{found_from(0, kUpright, wall("", azimuth, 90, distance))};
    return match_walls(found, {"one"}, scene, {}).walls.at(0).name == "known";
  };
  EXPECT_TRUE(same(4.9, 10.0));
  EXPECT_FALSE(same(5.1, 10.0));
  EXPECT_TRUE(same(0.0, 10.79));
  EXPECT_FALSE(same(0.0, 10.81));
  EXPECT_TRUE(same(0.0, 9.21));
  EXPECT_FALSE(same(0.0, 9.19));
}

TEST(WallMatching, ListedPlanesThatNobodySawAreNoUnknowns) {
  scenes::Scene scene;
  scene.planes = {wall("behind", 180, 90, 5), wall("left", 40, 88, 10, 0.1),
                  wall("above", 0, 0, 3, 0.1)};
  std::vector<FoundPlane> found{found_from(0, kUpright, scene.planes[1])};
  const WallMatching matching = match_walls(found, {"one"}, scene, {});
  EXPECT_THAT(names_of(matching), ElementsAre("left"));
  EXPECT_THAT(walls_of(found), ElementsAre(0));
  EXPECT_THAT(codes_of(matching.warnings), ElementsAre("not_seen", "not_seen"));
}

TEST(WallMatching, RefusesWhenNoKnownPlaneIsSeen) {
  scenes::Scene scene;
  scene.planes = {wall("known", 60, 90, 10, 0.1), wall("named", 0, 90, 10)};
  std::vector<FoundPlane> found{found_from(0, kUpright, scene.planes[1])};
  EXPECT_THAT(refusal<EstimationError>([&] { match_walls(found, {"one.lvx"}, scene, {}); }),
              AllOf(NamesField("one.lvx"), NamesField("azimuth 0.0"), NamesField("10.00 m")));
  // Planes that are only named are no datum and may be missing.
  scene.planes[0].normal_sigma.reset();
  found = {found_from(0, kUpright, wall("", -90, 90, 4))};
  EXPECT_EQ(match_walls(found, {"one.lvx"}, scene, {}).warnings.size(), 2u);
}

TEST(WallMatching, NamesAStationThatSharesNothing) {
  scenes::Station wrong = kFlipped;
  wrong.yaw += radians_from_degrees(20.0);  // stated so, and not standing so
  std::vector<FoundPlane> found{found_from(0, kUpright, kLeft), found_from(0, kUpright, kRight),
                                found_from(1, kFlipped, kLeft), found_from(1, kFlipped, kRight)};
  EXPECT_THAT(refusal<EstimationError>([&] {
                match_walls(found, {"one", "two"}, std::nullopt, {kUpright, wrong});
              }),
              AllOf(NamesField("station upright"), NamesField("20.0 degrees")));

  // With a third one that agrees with the first, the second is to blame.
  scenes::Station third = kUpright;
  third.name = "third";
  found.push_back(found_from(2, third, kLeft));
  EXPECT_THAT(refusal<EstimationError>([&] {
                match_walls(found, {"one", "two", "three"}, std::nullopt, {kUpright, wrong, third});
              }),
              NamesField("station flipped"));

  // A known wall ties a station as well as another station does.
  scenes::Scene scene;
  scene.planes = {kLeft, wall("known", -80, 90, 7, 0.1)};
  found = {found_from(0, kUpright, kLeft), found_from(1, third, kLeft),
           found_from(2, kFlipped, scene.planes[1])};
  EXPECT_NO_THROW(match_walls(found, {"one", "two", "three"}, scene, {kUpright, third, kFlipped}));
  // A station that found no plane at all does no harm, and one alone has no other to share
  // with.
  found = {found_from(0, kUpright, kLeft), found_from(1, third, kLeft)};
  EXPECT_NO_THROW(
      match_walls(found, {"one", "two", "three"}, std::nullopt, {kUpright, third, kFlipped}));
  found = {found_from(0, kFlipped, kLeft)};
  EXPECT_NO_THROW(match_walls(found, {"one"}, std::nullopt, {kFlipped}));
}

}  // namespace risley::calibration::wall_matching_test
