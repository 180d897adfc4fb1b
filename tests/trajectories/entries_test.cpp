// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "risley/trajectories/geodesy.hpp"
#include "risley/trajectories/interpolation.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory.hpp"

#include "refusal.hpp"

namespace risley::trajectories::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Entries, PlacesLieOnTheEarth) {
  EXPECT_THAT(refusal([] { geocentric_from_geodetic({37.7, 0, 0}); }), NamesField("latitude"));
  EXPECT_THAT(refusal([] { geocentric_from_geodetic({0, 120, 0}); }), NamesField("longitude"));
  EXPECT_THAT(refusal([] { geocentric_from_geodetic({0, 0, kNan}); }), NamesField("height"));
  EXPECT_THAT(refusal([] { geocentric_from_ned({kNan, 0, 0}); }), NamesField("latitude"));
  EXPECT_THAT(refusal([] {
                geodetic_from_geocentric({0, 0, 0});
              }),
              NamesField("distance from the centre of the Earth"));
  EXPECT_THAT(refusal([] { geodetic_from_geocentric({kNan, 0, 0}); }), NamesField("position.x"));
  EXPECT_THAT(refusal([] { ned_axes(Frame::geocentric, {1, 2, 3}); }), NamesField("centre"));
}

TEST(Entries, AttitudesAreRotations) {
  EXPECT_THAT(refusal([] { ned_from_body({kNan, 0, 0}); }), NamesField("roll"));
  EXPECT_THAT(refusal([] { ned_from_body({0, kNan, 0}); }), NamesField("pitch"));
  EXPECT_THAT(refusal([] { ned_from_body({0, 0, kNan}); }), NamesField("heading"));
  EXPECT_THAT(refusal([] { roll_pitch_heading(Eigen::Quaterniond(2, 0, 0, 0)); }),
              NamesField("attitude has length 2"));
}

Trajectory sound() {
  Trajectory t;
  t.time_ns = {0, 10};
  t.position = {{0, 0, 0}, {1, 0, 0}};
  t.attitude.assign(2, Eigen::Quaterniond::Identity());
  return t;
}

template <class Change>
std::string refused(Change&& change) {
  Trajectory t = sound();
  change(t);
  const std::string message = refusal([&] { Interpolation{t}; });
  EXPECT_EQ(message, refusal([&] { require_trajectory(t); }));
  return message;
}

TEST(Entries, TrajectoriesAreSound) {
  EXPECT_EQ(refused([](Trajectory&) {}), "");
  EXPECT_EQ(refused([](Trajectory& t) { t = {}; }), "records = 0, allowed 1 or more");
  EXPECT_EQ(refused([](Trajectory& t) { t.position.pop_back(); }),
            "position has 1 values, expected 2");
  EXPECT_EQ(refused([](Trajectory& t) { t.attitude.pop_back(); }),
            "attitude has 1 values, expected 2");
  EXPECT_THAT(refused([](Trajectory& t) { t.velocity.resize(1); }), NamesField("velocity"));
  EXPECT_THAT(refused([](Trajectory& t) { t.accuracy.resize(3); }), NamesField("accuracy"));
  EXPECT_EQ(refused([](Trajectory& t) { t.time_ns[1] = 0; }),
            "time_ns[1] = 0, allowed later than time_ns[0] = 0");
  EXPECT_THAT(refused([](Trajectory& t) {
                t.time_ns = {-5'000'000'000'000'000'000, 5'000'000'000'000'000'000};
              }),
              NamesField("146 years"));
  EXPECT_EQ(refused([](Trajectory& t) { t.position[1].y() = kNan; }),
            "position[1] = (1, nan, 0) m, allowed finite");
  EXPECT_THAT(refused([](Trajectory& t) { t.attitude[1].w() = 0.5; }),
              NamesField("unit quaternion"));
  EXPECT_THAT(refused([](Trajectory& t) { t.attitude[1].w() = kNan; }), NamesField("attitude[1]"));
  EXPECT_THAT(refused([](Trajectory& t) { t.frame = Frame::geocentric; }),
              NamesField("position[0] is 0 m"));
  EXPECT_THAT(refused([](Trajectory& t) {
                t.velocity.assign(2, {0, 0, kNan});
              }),
              NamesField("velocity[0]"));
  EXPECT_THAT(refused([](Trajectory& t) {
                t.accuracy.resize(2);
                t.accuracy[1].heading = kNan;
              }),
              NamesField("accuracy.attitude[1]"));
  EXPECT_THAT(refused([](Trajectory& t) {
                t.accuracy.resize(2);
                t.accuracy[1].position.z() = -1;
              }),
              NamesField("accuracy[1]"));
  EXPECT_THAT(refusal([] {
                Trajectory t = sound();
                t.attitude.pop_back();
                order_by_time(t);
              }),
              NamesField("attitude"));
}

TEST(Entries, GapsAreLongerThanSteps) {
  const Trajectory t = sound();
  EXPECT_EQ(refusal([&] { Interpolation(t, {.gap_steps = 1}); }), "gap_steps = 1, allowed above 1");
  EXPECT_THAT(refusal([&] { Interpolation(t, {.gap_steps = kNan}); }), NamesField("gap_steps"));
}

TEST(Entries, MountsHoldWhatCanBeWritten) {
  const auto run = [](auto&& change) {
    Mount mount;
    change(mount);
    const std::string message = refusal([&] { require_mount(mount); });
    EXPECT_EQ(message, refusal([&] { body_from_sensor(mount); }));
    EXPECT_EQ(message, refusal([&] { lever_arm(mount); }));
    EXPECT_EQ(message, refusal([&] { mount_text(mount); }));
    return message;
  };
  EXPECT_EQ(run([](Mount&) {}), "");
  EXPECT_THAT(run([](Mount& m) { m.nominal(0, 0) = -1; }), NamesField("right-handed rotation"));
  EXPECT_THAT(run([](Mount& m) { m.nominal(0, 0) = kNan; }), NamesField("right-handed rotation"));
  EXPECT_THAT(run([](Mount& m) { m.boresight[1].value = 3; }), NamesField("boresight[1]"));
  EXPECT_THAT(run([](Mount& m) { m.boresight[1].sigma = -1; }),
              NamesField("sigma of boresight[1]"));
  EXPECT_THAT(run([](Mount& m) { m.lever_arm[2].value = kNan; }), NamesField("lever_arm[2]"));
  EXPECT_THAT(run([](Mount& m) { m.clock_offset.value = 1e11; }), NamesField("clock_offset"));
  const auto covariance = [](double sigma, double variance) {
    return [=](Mount& m) {
      m.clock_offset.sigma = sigma;
      m.covariance = {{"clock_offset_s"}, Eigen::MatrixXd::Constant(1, 1, variance)};
    };
  };
  EXPECT_EQ(run(covariance(0.5, 0.25)), "");
  EXPECT_THAT(run(covariance(0.5, 0.26)), NamesField("clock_offset_s"));
  EXPECT_THAT(run(covariance(0, 0)), NamesField("covariance[0][0]"));
  EXPECT_THAT(run(covariance(kNan, kNan)), NamesField("sigma of clock_offset"));
  EXPECT_THAT(run([](Mount& m) { m.covariance.names = {"clock_offset_s"}; }), NamesField("1 x 1"));
}

}  // namespace risley::trajectories::entries_test
