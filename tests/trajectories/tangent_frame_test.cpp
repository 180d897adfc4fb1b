// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/tangent_frame.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "risley/trajectories/geodesy.hpp"

#include "refusal.hpp"

namespace risley::trajectories::tangent_frame_test {

Trajectory geocentric_flight() {
  Trajectory flight;
  flight.frame = Frame::geocentric;
  for (int i = 0; i < 5; ++i) {
    const Geodetic place{0.85 + 1e-6 * i, 0.2 + 2e-6 * i, 450.0 + i};
    flight.time_ns.push_back(i * 5'000'000);
    flight.position.push_back(geocentric_from_geodetic(place));
    flight.attitude.emplace_back(Eigen::Quaterniond(geocentric_from_ned(place)) *
                                 ned_from_body({0.01 * i, -0.02, 1.5}));
    flight.velocity.push_back(geocentric_from_ned(place) * Eigen::Vector3d(1, 2, 3));
  }
  return flight;
}

TEST(TangentFrame, HasEastNorthAndUp) {
  const Trajectory flight = geocentric_flight();
  const TangentFrame tangent = tangent_frame(flight);
  EXPECT_LT((tangent.axes.transpose() * tangent.axes - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_GT(tangent.axes.determinant(), 0);
  const Trajectory local = in_tangent_frame(flight, tangent);
  EXPECT_EQ(local.frame, Frame::local);
  // The flight goes 6.4 m to the north and 8.4 m to the east of its first record, and up.
  const Eigen::Vector3d moved = local.position[1] - local.position[0];
  EXPECT_NEAR(moved.x(), 2e-6 * 6.39e6 * std::cos(0.85), 0.02);
  EXPECT_NEAR(moved.y(), 1e-6 * 6.38e6, 0.02);
  EXPECT_NEAR(moved.z(), 1, 1e-3);
  EXPECT_LT((local.velocity[2] - Eigen::Vector3d(2, 1, -3)).norm(), 1e-4);
  const RollPitchHeading angles =
      roll_pitch_heading(Frame::local, local.position[2], local.attitude[2]);
  EXPECT_NEAR(angles.roll, 0.02, 1e-9);
  EXPECT_NEAR(angles.pitch, -0.02, 1e-9);
  EXPECT_NEAR(angles.heading, 1.5, 1e-9);
}

TEST(TangentFrame, LeadsThereAndBack) {
  const Trajectory flight = geocentric_flight();
  const TangentFrame tangent = tangent_frame(flight);
  const Trajectory back = from_tangent_frame(in_tangent_frame(flight, tangent), tangent);
  EXPECT_EQ(back.frame, Frame::geocentric);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    EXPECT_LT((back.position[i] - flight.position[i]).norm(), 2e-9);
    EXPECT_LT(back.attitude[i].angularDistance(flight.attitude[i]), 1e-14);
    EXPECT_LT((back.velocity[i] - flight.velocity[i]).norm(), 1e-14);
  }
}

TEST(TangentFrame, OfALocalTrajectoryIsShiftedOnly) {
  Trajectory flight = geocentric_flight();
  flight.frame = Frame::local;
  flight.position = {{500000, 5000000, 80},
                     {500002, 5000000, 80},
                     {500004, 5000000, 80},
                     {500006, 5000000, 80},
                     {500008, 5000000, 80}};
  const TangentFrame tangent = tangent_frame(flight);
  EXPECT_EQ(tangent.axes, Eigen::Matrix3d::Identity());
  EXPECT_EQ(tangent.origin, Eigen::Vector3d(500004, 5000000, 80));
}

TEST(TangentFrame, RefusesATrajectoryOfAnotherFrame) {
  const Trajectory flight = geocentric_flight();
  const TangentFrame tangent = tangent_frame(flight);
  const Trajectory local = in_tangent_frame(flight, tangent);
  EXPECT_EQ(refusal([&] { in_tangent_frame(local, tangent); }),
            "frame = local, expected geocentric");
  EXPECT_EQ(refusal([&] { from_tangent_frame(flight, tangent); }),
            "frame = geocentric, expected local");
  EXPECT_NE(refusal([] { tangent_frame({}); }), "");
}

}  // namespace risley::trajectories::tangent_frame_test
