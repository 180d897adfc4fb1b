// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/trajectory.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/random.hpp"
#include "risley/trajectories/geodesy.hpp"

namespace risley::trajectories::trajectory_test {

using Eigen::Vector3d;

RollPitchHeading degrees(double roll, double pitch, double heading) {
  return {radians_from_degrees(roll), radians_from_degrees(pitch), radians_from_degrees(heading)};
}

TEST(Attitude, HeadingIsClockwisePitchUpRollRightWingDown) {
  const auto turned = [](const RollPitchHeading& angles, const Vector3d& v) -> Vector3d {
    return ned_from_body(angles) * v;
  };
  EXPECT_LT((turned(degrees(0, 0, 90), {1, 0, 0}) - Vector3d(0, 1, 0)).norm(), 1e-15);   // east
  EXPECT_LT((turned(degrees(0, 90, 0), {1, 0, 0}) - Vector3d(0, 0, -1)).norm(), 1e-15);  // up
  EXPECT_LT((turned(degrees(90, 0, 0), {0, 1, 0}) - Vector3d(0, 0, 1)).norm(), 1e-15);   // down
  // The nose stays where heading and pitch put it.
  EXPECT_LT((turned(degrees(33, 20, 40), {1, 0, 0}) - turned(degrees(0, 20, 40), {1, 0, 0})).norm(),
            1e-15);
}

TEST(Attitude, AnglesComeBack) {
  const RandomStream random(1, 1);
  for (std::uint64_t i = 0; i < 2000; ++i) {
    const RollPitchHeading angles{kPi * (2 * random.uniform(3 * i) - 1),
                                  kPi * (random.uniform(3 * i + 1) - 0.5),
                                  kTwoPi * random.uniform(3 * i + 2)};
    const Eigen::Quaterniond q = ned_from_body(angles);
    for (const double sign : {1.0, -1.0}) {
      const RollPitchHeading back =
          roll_pitch_heading(Eigen::Quaterniond(Eigen::Vector4d(sign * q.coeffs())));
      const double level = std::cos(angles.pitch);  // roll and heading meet towards the vertical
      EXPECT_NEAR(wrap_to_pi(back.roll - angles.roll) * level, 0, 2e-15);
      EXPECT_NEAR(back.pitch, angles.pitch, 2e-15);
      EXPECT_NEAR(wrap_to_pi(back.heading - angles.heading) * level, 0, 3e-15);
    }
  }
}

TEST(Attitude, StraightUpKeepsTheRotation) {
  for (const double pitch : {90.0, -90.0}) {
    const Eigen::Quaterniond q = ned_from_body(degrees(25, pitch, 70));
    const RollPitchHeading back = roll_pitch_heading(q);
    EXPECT_EQ(back.roll, 0);
    EXPECT_NEAR(back.pitch, radians_from_degrees(pitch), 1e-12);
    EXPECT_LT(q.angularDistance(ned_from_body(back)), 1e-12);
  }
}

TEST(Attitude, IsToldAmongTheAxesOfThePlace) {
  const Geodetic place{0.8, -2.0, 500};
  const RollPitchHeading angles = degrees(3, -4, 250);
  const Eigen::Quaterniond attitude =
      Eigen::Quaterniond(geocentric_from_ned(place)) * ned_from_body(angles);
  const RollPitchHeading told =
      roll_pitch_heading(Frame::geocentric, geocentric_from_geodetic(place), attitude);
  EXPECT_NEAR(told.roll, angles.roll, 1e-14);
  EXPECT_NEAR(told.pitch, angles.pitch, 1e-14);
  EXPECT_NEAR(told.heading, angles.heading, 1e-14);
  // On a map of its own: a body whose nose points along x looks east.
  const Eigen::Quaterniond flipped(0, 1, 0, 0);  // z down, y to the right of x
  EXPECT_NEAR(roll_pitch_heading(Frame::local, {0, 0, 0}, flipped).heading, kPi / 2, 1e-15);
  EXPECT_NEAR(roll_pitch_heading(Frame::local, {0, 0, 0}, flipped).roll, 0, 1e-15);
}

Trajectory of_times(const std::vector<std::int64_t>& times) {
  Trajectory t;
  t.time_ns = times;
  for (std::size_t i = 0; i < times.size(); ++i) {
    t.position.emplace_back(static_cast<double>(i), 0, 0);
    t.attitude.push_back(Eigen::Quaterniond::Identity());
    t.velocity.emplace_back(0, static_cast<double>(i), 0);
  }
  t.accuracy.resize(times.size());
  return t;
}

TEST(TimeOrder, RowsAreSortedAndRepeatedTimesLeftOut) {
  Trajectory t = of_times({10, 30, 20, 30, 40, 40, 15});
  const TimeOrder done = order_by_time(t);
  EXPECT_EQ(t.time_ns, (std::vector<std::int64_t>{10, 15, 20, 30, 40}));
  EXPECT_EQ(t.position[1].x(), 6);
  EXPECT_EQ(t.position[3].x(), 1);  // the first of its time
  EXPECT_EQ(t.velocity[4].y(), 4);
  EXPECT_EQ(t.accuracy.size(), 5U);
  EXPECT_EQ(done.repeated, 2U);
  EXPECT_EQ(done.moved, 2U);
  EXPECT_EQ(done.largest_back_ns, 25);
  EXPECT_EQ(done.largest_back_at, 6U);
}

TEST(TimeOrder, OrderedRowsStayAsTheyAre) {
  Trajectory t = of_times({10, 20, 30});
  const TimeOrder done = order_by_time(t);
  EXPECT_EQ(done.moved + done.repeated, 0U);
  EXPECT_EQ(t.position[2].x(), 2);
  Trajectory none;
  EXPECT_EQ(order_by_time(none).moved, 0U);
}

}  // namespace risley::trajectories::trajectory_test
