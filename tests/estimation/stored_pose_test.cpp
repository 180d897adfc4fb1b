// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/stored_pose.hpp"

#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/estimation/frame_turn.hpp"

#include "estimation/series.hpp"

namespace risley::estimation::stored_pose_test {

const sensors::Sensor& sensor() {
  static const sensors::Sensor mid_40 = sensors::load_sensor("mid-40");
  return mid_40;
}

/// A second of shots in the sensor's frame.
AngleSeries second_of_shots() {
  return risley::testing::constant_speed_series(sensor(), 0.3, 1.1, 1.0, 10000.0, 0.02);
}

Eigen::Matrix3d rotation(double yaw_deg, double pitch_deg, double roll_deg) {
  const auto about = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(radians_from_degrees(degrees), axis).toRotationMatrix();
  };
  return about(yaw_deg, Eigen::Vector3d::UnitZ()) * about(pitch_deg, Eigen::Vector3d::UnitY()) *
         about(roll_deg, Eigen::Vector3d::UnitX());
}

/// What the shots say of a stored pose when `applied` was applied to them.
StoredPoseVerdict verdict_of(AngleSeries shots, const Eigen::Matrix3d& stored,
                             const Eigen::Matrix3d& applied) {
  turn(shots, applied);
  AngleSeries back = shots;
  turn(back, stored.transpose());
  return judge_stored_pose(shots, back, sensor().field_of_view);
}

TEST(StoredPose, ShotsTellWhetherItWasApplied) {
  const AngleSeries shots = second_of_shots();
  const double poses[][3] = {{90, 0, 0},    {180, 0, 0}, {0, -90, 0}, {0, 90, 30}, {10, -5, 180},
                             {-120, 40, 7}, {3, 0, 0},   {0, -4, 90}, {0, 179, 0}};
  for (const auto& pose : poses) {
    SCOPED_TRACE(::testing::Message() << pose[0] << " " << pose[1] << " " << pose[2]);
    const Eigen::Matrix3d stored = rotation(pose[0], pose[1], pose[2]);
    const StoredPoseVerdict moved = verdict_of(shots, stored, stored);
    EXPECT_EQ(moved.use, StoredPoseUse::applied);
    EXPECT_EQ(moved.outside_turned_back, 0.0);
    EXPECT_GT(moved.outside_as_recorded, 0.01);
    const StoredPoseVerdict kept = verdict_of(shots, stored, Eigen::Matrix3d::Identity());
    EXPECT_EQ(kept.use, StoredPoseUse::not_applied);
    EXPECT_EQ(kept.outside_as_recorded, 0.0);
  }
}

TEST(StoredPose, AnAxisThatStaysTellsNothing) {
  const AngleSeries shots = second_of_shots();
  for (const Eigen::Matrix3d& stored :
       {rotation(0, 0, 90), rotation(0, 0, 180), rotation(0.9, 0, 0), rotation(0.5, -0.7, 45)}) {
    for (const Eigen::Matrix3d& applied : {stored, rotation(0, 0, 0)}) {
      EXPECT_EQ(verdict_of(shots, stored, applied).use, StoredPoseUse::undecided);
    }
  }
}

TEST(StoredPose, WhatFitsNeitherWayOrCannotBeJudgedIsUndecided) {
  const AngleSeries shots = second_of_shots();
  const Eigen::Matrix3d stored = rotation(90, 0, 0);
  // The points were moved by something else.
  EXPECT_EQ(verdict_of(shots, stored, rotation(-40, 20, 0)).use, StoredPoseUse::undecided);
  EXPECT_EQ(verdict_of(rows_of(shots, 0, 9), stored, stored).use, StoredPoseUse::undecided);
  EXPECT_EQ(verdict_of({}, stored, stored).use, StoredPoseUse::undecided);
  AngleSeries back = shots;
  turn(back, stored.transpose());
  EXPECT_EQ(judge_stored_pose(shots, back, 0.0).use, StoredPoseUse::undecided);
}

TEST(StoredPose, GrossErrorsDoNotTurnTheVerdict) {
  AngleSeries shots = second_of_shots();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (std::size_t i = 0; i < shots.size(); i += 10) {
    const auto anywhere =
        angles_from_direction(Vector3<double>{normal(random), normal(random), normal(random)});
    shots.azimuth[i] = anywhere.azimuth;
    shots.zenith[i] = anywhere.zenith;
  }
  const Eigen::Matrix3d stored = rotation(20, 10, 0);
  EXPECT_EQ(verdict_of(shots, stored, stored).use, StoredPoseUse::applied);
  EXPECT_EQ(verdict_of(shots, stored, rotation(0, 0, 0)).use, StoredPoseUse::not_applied);
}

}  // namespace risley::estimation::stored_pose_test
