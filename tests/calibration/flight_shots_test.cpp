// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_shots.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "refusal.hpp"

namespace risley::calibration::flight_shots_test {

FlightShots some_shots() {
  FlightShots shots;
  shots.rotation_angle = {{0.1, 0.2, 0.3}, {1, 2, 3}};
  shots.range = {80, 81, 82};
  shots.time_ns = {1'000'000'000, 1'500'000'000, 2'000'000'000};
  shots.strip = {0, 0, 1};
  return shots;
}

/// Along x at 3 m/s, turning about z at 0.2 rad/s, 0 to 3 s; nothing from 1.6 to 1.9 s.
trajectories::Trajectory straight() {
  trajectories::Trajectory t;
  t.frame = trajectories::Frame::local;
  for (int i = 0; i <= 300; ++i) {
    if (i > 160 && i < 190) continue;
    const double time = 0.01 * i;
    t.time_ns.push_back(i * 10'000'000LL);
    t.position.emplace_back(3 * time, 1, 2);
    t.attitude.emplace_back(
        Eigen::Quaterniond(Eigen::AngleAxisd(0.2 * time, Eigen::Vector3d::UnitZ())));
  }
  return t;
}

TEST(FlightShots, RefuseColumnsThatDoNotFit) {
  const auto refused = [](const auto& damage) {
    FlightShots shots = some_shots();
    damage(shots);
    return refusal([&] { require_flight_shots(shots); });
  };
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused([](FlightShots&) {}), "");
  EXPECT_EQ(refused([](FlightShots& s) { s.range[1] = 0; }), "range[1] = 0 m, allowed above 0");
  EXPECT_EQ(refused([](FlightShots& s) { s.range[2] = kNaN; }),
            "range[2] = nan m, allowed above 0");
  EXPECT_EQ(refused([](FlightShots& s) { s.rotation_angle[1][0] = kNaN; }),
            "rotation_angle[0] = nan rad, allowed finite");
  EXPECT_EQ(refused([](FlightShots& s) { s.time_ns[2] = 7; }),
            "time_ns[2] = 7, allowed not before the shot before it, 1500000000");
  EXPECT_EQ(refused([](FlightShots& s) {
              s.strip = {1, 0, 0};
            }),
            "strip[1] = 0, allowed 1 and more, as the shot before it");
  EXPECT_NE(
      refused([](FlightShots& s) { s.time_ns[2] = std::numeric_limits<std::int64_t>::max(); }), "");
  EXPECT_NE(refused([](FlightShots& s) { s.strip.pop_back(); }), "");
  EXPECT_NE(refused([](FlightShots& s) { s.beam = {0}; }), "");
  EXPECT_NE(refused([](FlightShots& s) { s.rotation_angle.clear(); }), "");
  EXPECT_NE(refusal([] { require_flight_shots({}); }), "");
}

TEST(FlightShots, HavePosesAtTheTrajectorysTime) {
  const FlightShots shots = some_shots();
  const auto trajectory = straight();
  const trajectories::Interpolation interpolation(trajectory);
  const ShotPoses poses = poses_of(shots, interpolation, 0.05);
  EXPECT_EQ(poses.clock_offset, 0.05);
  EXPECT_NEAR(poses.pose[0].position[0], 3 * 1.05, 1e-12);
  EXPECT_NEAR(poses.pose[0].attitude[0], std::cos(0.105), 1e-12);
  EXPECT_NEAR(poses.pose[0].attitude[3], std::sin(0.105), 1e-12);
  EXPECT_NEAR(poses.pose[2].velocity[0], 3, 1e-6);
  EXPECT_NEAR(poses.pose[2].angular_velocity[2], 0.2, 1e-6);
}

TEST(FlightShots, HaveRatesWithoutTheNoiseOfSingleRecords) {
  auto trajectory = straight();
  const trajectories::Interpolation clean(trajectory);
  const FlightShots shots = some_shots();
  const ShotPoses expected = poses_of(shots, clean, 0);
  for (std::size_t i = 0; i < trajectory.size(); ++i) {  // 1e-4 rad at 100 Hz: 1e-2 rad/s
    trajectory.attitude[i] =
        Eigen::Quaterniond(Eigen::AngleAxisd(i % 2 == 0 ? 1e-4 : -1e-4, Eigen::Vector3d::UnitX())) *
        trajectory.attitude[i];
  }
  const trajectories::Interpolation noisy(trajectory);
  const ShotPoses found = poses_of(shots, noisy, 0);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.pose[i].angular_velocity[k], expected.pose[i].angular_velocity[k], 1e-3);
    }
  }
}

TEST(FlightShots, WithoutPoseAreNamed) {
  const FlightShots shots = some_shots();
  const auto trajectory = straight();
  const trajectories::Interpolation interpolation(trajectory);
  EXPECT_EQ(rows_with_pose(shots, interpolation, 0, 0.05), (std::vector<std::size_t>{0, 1, 2}));
  // The second one then is in the gap, for some offset within the margin.
  EXPECT_EQ(rows_with_pose(shots, interpolation, 0.08, 0.05), (std::vector<std::size_t>{0, 2}));
  EXPECT_NE(refusal([&] { poses_of(shots, interpolation, 0.2); }).find("shot 1 has no pose"),
            std::string::npos);
  auto geocentric = straight();
  geocentric.frame = trajectories::Frame::geocentric;
  for (auto& position : geocentric.position) position.x() += 6378137;
  const trajectories::Interpolation other(geocentric);
  EXPECT_EQ(refusal([&] { poses_of(shots, other, 0); }),
            "frame of the trajectory = geocentric, expected local");
  EXPECT_NE(refusal([&] { poses_of(shots, interpolation, 1e9); }), "");
}

TEST(FlightShots, OfSomeRowsKeepTheirColumns) {
  FlightShots shots = some_shots();
  shots.beam = {3, 4, 5};
  const FlightShots some = rows_of(shots, {0, 2});
  EXPECT_EQ(some.range, (std::vector<double>{80, 82}));
  EXPECT_EQ(some.beam, (std::vector<std::uint8_t>{3, 5}));
  EXPECT_EQ(some.rotation_angle[1], (std::vector<double>{1, 3}));
  EXPECT_EQ(some.strips(), 2U);
  EXPECT_NE(refusal([&] { rows_of(shots, {3}); }), "");
  EXPECT_NE(refusal([&] { rows_of(shots, {1, 1}); }), "");
}

}  // namespace risley::calibration::flight_shots_test
