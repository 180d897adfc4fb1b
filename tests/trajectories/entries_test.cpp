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

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TEST(Entries, PlacesLieOnTheEarth) {
  EXPECT_THAT(refusal([] {
                geocentric_from_geodetic({37.7, 0, 0});
              }),
              HasSubstr("latitude = 37.7 rad, allowed -1.5"));
  EXPECT_THAT(refusal([] { geocentric_from_geodetic({0, 120, 0}); }), HasSubstr("longitude = 120"));
  EXPECT_THAT(refusal([] { geocentric_from_geodetic({0, 0, kNan}); }), HasSubstr("height = nan m"));
  EXPECT_THAT(refusal([] { geocentric_from_ned({kNan, 0, 0}); }), HasSubstr("latitude = nan"));
  EXPECT_THAT(refusal([] {
                geodetic_from_geocentric({0, 0, 0});
              }),
              HasSubstr("distance from the centre of the Earth = 0 m"));
  EXPECT_THAT(refusal([] {
                geodetic_from_geocentric({kNan, 0, 0});
              }),
              HasSubstr("position.x = nan m, allowed finite"));
  EXPECT_THAT(refusal([] { ned_axes(Frame::geocentric, {1, 2, 3}); }), HasSubstr("centre"));
}

TEST(Entries, AttitudesAreRotations) {
  EXPECT_THAT(refusal([] { ned_from_body({kNan, 0, 0}); }), HasSubstr("roll = nan rad"));
  EXPECT_THAT(refusal([] { ned_from_body({0, kNan, 0}); }), HasSubstr("pitch = nan rad"));
  EXPECT_THAT(refusal([] { ned_from_body({0, 0, kNan}); }), HasSubstr("heading = nan rad"));
  EXPECT_THAT(refusal([] { roll_pitch_heading(Eigen::Quaterniond(2, 0, 0, 0)); }),
              HasSubstr("attitude has length 2"));
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
  EXPECT_THAT(refused([](Trajectory& t) { t.velocity.resize(1); }), HasSubstr("velocity has 1"));
  EXPECT_THAT(refused([](Trajectory& t) { t.accuracy.resize(3); }), HasSubstr("accuracy has 3"));
  EXPECT_EQ(refused([](Trajectory& t) { t.time_ns[1] = 0; }),
            "time_ns[1] = 0, allowed later than time_ns[0] = 0");
  EXPECT_THAT(refused([](Trajectory& t) {
                t.time_ns = {-5'000'000'000'000'000'000, 5'000'000'000'000'000'000};
              }),
              HasSubstr("within 146 years"));
  EXPECT_EQ(refused([](Trajectory& t) { t.position[1].y() = kNan; }),
            "position[1] = (1, nan, 0) m, allowed finite");
  EXPECT_THAT(refused([](Trajectory& t) { t.attitude[1].w() = 0.5; }),
              HasSubstr("unit quaternion"));
  EXPECT_THAT(refused([](Trajectory& t) { t.attitude[1].w() = kNan; }), HasSubstr("attitude[1]"));
  EXPECT_THAT(refused([](Trajectory& t) { t.frame = Frame::geocentric; }),
              HasSubstr("position[0] is 0 m from the centre"));
  EXPECT_THAT(refused([](Trajectory& t) {
                t.velocity.assign(2, {0, 0, kNan});
              }),
              HasSubstr("velocity[0] = (0, 0, nan) m/s"));
  EXPECT_THAT(refused([](Trajectory& t) {
                t.accuracy.resize(2);
                t.accuracy[1].heading = kNan;
              }),
              HasSubstr("accuracy.attitude[1] = (0, 0, nan) rad"));
  EXPECT_THAT(refused([](Trajectory& t) {
                t.accuracy.resize(2);
                t.accuracy[1].position.z() = -1;
              }),
              HasSubstr("accuracy[1] has -1, allowed 0 and more"));
  EXPECT_THAT(refusal([] {
                Trajectory t = sound();
                t.attitude.pop_back();
                order_by_time(t);
              }),
              HasSubstr("attitude has 1"));
}

TEST(Entries, GapsAreLongerThanSteps) {
  const Trajectory t = sound();
  EXPECT_EQ(refusal([&] { Interpolation(t, {.gap_steps = 1}); }), "gap_steps = 1, allowed above 1");
  EXPECT_THAT(refusal([&] { Interpolation(t, {.gap_steps = kNan}); }),
              HasSubstr("gap_steps = nan"));
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
  EXPECT_THAT(run([](Mount& m) { m.nominal(0, 0) = -1; }), HasSubstr("right-handed rotation"));
  EXPECT_THAT(run([](Mount& m) { m.nominal(0, 0) = kNan; }), HasSubstr("right-handed rotation"));
  EXPECT_THAT(run([](Mount& m) { m.boresight[1].value = 3; }), HasSubstr("boresight[1] = 3 rad"));
  EXPECT_THAT(run([](Mount& m) { m.boresight[1].sigma = -1; }),
              HasSubstr("sigma of boresight[1] = -1 rad"));
  EXPECT_THAT(run([](Mount& m) { m.lever_arm[2].value = kNan; }),
              HasSubstr("lever_arm[2] = nan m"));
  EXPECT_THAT(run([](Mount& m) { m.clock_offset.value = 1e11; }), HasSubstr("clock_offset = 1"));
  const auto covariance = [](double sigma, double variance) {
    return [=](Mount& m) {
      m.clock_offset.sigma = sigma;
      m.covariance = {{"clock_offset_s"}, Eigen::MatrixXd::Constant(1, 1, variance)};
    };
  };
  EXPECT_EQ(run(covariance(0.5, 0.25)), "");
  EXPECT_THAT(run(covariance(0.5, 0.26)), HasSubstr("clock_offset_s has a sigma of 0.5099"));
  EXPECT_THAT(run(covariance(0, 0)), HasSubstr("covariance[0][0]: a variance must be above 0"));
  EXPECT_THAT(run(covariance(kNan, kNan)), HasSubstr("sigma of clock_offset = nan"));
  EXPECT_THAT(run([](Mount& m) { m.covariance.names = {"clock_offset_s"}; }),
              HasSubstr("covariance is 0 x 0, expected 1 x 1"));
}

}  // namespace risley::trajectories::entries_test
