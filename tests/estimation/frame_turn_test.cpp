// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/frame_turn.hpp"

#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "estimation/series.hpp"

namespace risley::estimation::frame_turn_test {

TEST(FrameTurn, ItsOpticalAxisPointsToYawAndMinusPitch) {
  for (const double yaw : {-3.0, -0.5, 0.0, 1.2, 3.1}) {
    for (const double pitch : {-1.4, -0.2, 0.0, 0.7}) {
      const Eigen::Matrix3d rotation = recording_from_sensor({yaw, pitch});
      const Eigen::Vector3d axis = rotation.col(0);
      EXPECT_NEAR(std::atan2(axis.y(), axis.x()), yaw, 1e-12);
      EXPECT_NEAR(std::asin(axis.z()), -pitch, 1e-12);
      EXPECT_NEAR(rotation.col(1).z(), 0.0, 1e-15);  // no roll: Y stays level
      const FrameTurn back = turn_of(rotation, false);
      EXPECT_NEAR(back.yaw, yaw, 1e-12);
      EXPECT_NEAR(back.pitch, pitch, 1e-12);
      const Eigen::Matrix3d rolled =
          rotation * Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()).toRotationMatrix();
      EXPECT_NEAR(turn_of(rolled, false).yaw, yaw, 1e-12);  // a roll does not move the axis
    }
  }
}

TEST(FrameTurn, ShotsTurnedThereAndBackAreTheSame) {
  const auto sensor = sensors::load_sensor("mid-40");
  AngleSeries series = testing::constant_speed_series(sensor, 0.3, 1.0, 0.1, 10000.0);
  for (std::size_t i = 0; i < series.size(); ++i) {
    series.azimuth_rounding_variance[i] =
        1e-8F / static_cast<float>(std::pow(std::sin(series.zenith[i]), 2));
    series.zenith_rounding_variance[i] = 1e-8F;
  }
  const AngleSeries before = series;
  const Eigen::Matrix3d rotation = recording_from_sensor({0.5, -0.9});
  turn(series, rotation);
  double moved = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    moved = std::max(moved, std::abs(series.zenith[i] - before.zenith[i]));
    // Coordinates are rounded alike in all directions, in whatever frame.
    EXPECT_NEAR(static_cast<double>(series.zenith_rounding_variance[i]), 1e-8, 1e-13);
    EXPECT_NEAR(static_cast<double>(series.azimuth_rounding_variance[i]) *
                    std::pow(std::sin(series.zenith[i]), 2),
                1e-8, 1e-13);
  }
  EXPECT_GT(moved, 0.5);
  turn(series, rotation.transpose());
  for (std::size_t i = 0; i < series.size(); ++i) {
    EXPECT_NEAR(series.azimuth[i], before.azimuth[i], 1e-14);
    EXPECT_NEAR(series.zenith[i], before.zenith[i], 1e-14);
  }
}

TEST(FrameTurn, SmallFurtherTurnsMoveTheAxisAsTheyShould) {
  const Eigen::Matrix3d first = recording_from_sensor({0.4, 0.3});
  const Eigen::Matrix3d further = turned_further(first, {1e-4, -2e-4}, false);
  // Yaw moves the axis along the sensor's Y, pitch against its Z.
  const Eigen::Vector3d moved = first.transpose() * further.col(0);
  EXPECT_NEAR(moved.y(), 1e-4, 1e-8);
  EXPECT_NEAR(moved.z(), 2e-4, 1e-8);
  EXPECT_NEAR(further.col(1).z(), 0.0, 1e-15);
  EXPECT_EQ(turned_further(first, {0.0, 0.0}, false), first);
}

}  // namespace risley::estimation::frame_turn_test
