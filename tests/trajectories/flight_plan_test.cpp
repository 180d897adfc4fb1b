// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/flight_plan.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/trajectories/interpolation.hpp"

#include "refusal.hpp"
#include "source_tree.hpp"

namespace risley::trajectories::flight_plan_test {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// On a map of its own, from second 0 on.
FlightPlan bundled() {
  FlightPlan plan = load_flight_plan(in_source_tree("data/flight-v4.yaml"));
  EXPECT_TRUE(plan.origin);
  plan.origin.reset();
  plan.start = 0;
  return plan;
}

FlightPlan smooth(FlightPlan plan) {
  plan.attitude = {};
  plan.velocity = {};
  return plan;
}

double seconds(std::int64_t ns) { return 1e-9 * static_cast<double>(ns); }

TEST(FlightPlan, TheBundledOneIsFourStripsThroughTheOrigin) {
  const FlightPlan plan = bundled();
  ASSERT_EQ(plan.strips.size(), 4u);
  const Flight flight = fly(smooth(plan));
  ASSERT_EQ(flight.strips.size(), 4u);
  // 2 s, 4 x 32 s, 3 x 20 s, 2 s at 200 Hz.
  EXPECT_EQ(flight.trajectory.size(), 192u * 200u + 1);
  EXPECT_NO_THROW(require_trajectory(flight.trajectory));
  const Interpolation poses(flight.trajectory);
  EXPECT_TRUE(poses.gaps().empty());
  const double headings_deg[] = {90, 270, 0, 180};
  for (std::size_t i = 0; i < 4; ++i) {
    const StripTimes& strip = flight.strips[i];
    EXPECT_EQ(strip.name, "strip " + std::to_string(i + 1));
    EXPECT_DOUBLE_EQ(seconds(strip.begin_ns), 2.0 + 52.0 * static_cast<double>(i));
    EXPECT_DOUBLE_EQ(seconds(strip.end_ns), 34.0 + 52.0 * static_cast<double>(i));
    const double heading = radians_from_degrees(headings_deg[i]);
    const Eigen::Vector3d along{std::sin(heading), std::cos(heading), 0};
    const Eigen::Vector3d height{0, 0, 80};
    EXPECT_LT((poses.at(strip.begin_ns)->position - (height - 80 * along)).norm(), 1e-9);
    EXPECT_LT((poses.at(strip.end_ns)->position - (height + 80 * along)).norm(), 1e-9);
    const auto middle = poses.at((strip.begin_ns + strip.end_ns) / 2);
    EXPECT_LT((middle->position - height).norm(), 1e-9);
    EXPECT_LT((middle->velocity - 5 * along).norm(), 1e-6);
    const auto angles = roll_pitch_heading(Frame::local, middle->position, middle->attitude);
    EXPECT_NEAR(wrap_to_pi(angles.heading - heading), 0, 1e-12);
    EXPECT_NEAR(angles.roll, 0, 1e-12);
    EXPECT_NEAR(angles.pitch, 0, 1e-12);
  }
}

// Positions are the integral of the velocities and do not jump, attitudes turn slowly, over turns
// and with motion.
TEST(FlightPlan, EverythingIsContinuous) {
  FlightPlan plan = bundled();
  plan.strips[2].height = 50;
  plan.strips[3].speed = 12;
  const Trajectory flight = fly(plan).trajectory;
  const double step = 1 / plan.rate;
  for (std::size_t i = 1; i + 1 < flight.size(); ++i) {
    const Eigen::Vector3d derivative =
        (flight.position[i + 1] - flight.position[i - 1]) / (2 * step);
    ASSERT_LT((derivative - flight.velocity[i]).norm(), 2e-4) << i;  // step^2 / 6 of the jerk
    ASSERT_LT((flight.velocity[i] - flight.velocity[i - 1]).norm(), 5 * step) << i;  // 5 m/s2
    ASSERT_LT(flight.attitude[i].angularDistance(flight.attitude[i - 1]),
              radians_from_degrees(70) * step)
        << i;
  }
}

TEST(FlightPlan, TurnsGoTheShorterWay) {
  const Flight flight = fly(smooth(bundled()));
  const Interpolation poses(flight.trajectory);
  // 90 to 270 degrees: to the right, over 180; 270 to 0: over 315.
  const auto heading_deg = [&](std::size_t turn, double part) {
    const std::int64_t begin = flight.strips[turn].end_ns, end = flight.strips[turn + 1].begin_ns;
    const auto pose =
        poses.at(begin + static_cast<std::int64_t>(part * static_cast<double>(end - begin)));
    return degrees_from_radians(
        roll_pitch_heading(Frame::local, pose->position, pose->attitude).heading);
  };
  EXPECT_NEAR(heading_deg(0, 0.5), 180, 1e-6);
  EXPECT_NEAR(heading_deg(1, 0.5), 315, 1e-6);
  EXPECT_NEAR(heading_deg(2, 0.5), 90, 1e-6);
}

TEST(FlightPlan, MotionHasTheStatedSizeAndBand) {
  FlightPlan plan = bundled();
  plan.strips = {{"long", {0, 0}, 0, 10000, 80, 5}};
  plan.rate = 20;
  const Trajectory still = fly(smooth(plan)).trajectory, moved = fly(plan).trajectory;
  ASSERT_EQ(still.size(), moved.size());
  double roll = 0, pitch = 0, heading = 0;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero(), sway = velocity;
  int crossings = 0;
  double before = 0;
  for (std::size_t i = 0; i < still.size(); ++i) {
    const auto angles = roll_pitch_heading(Frame::local, moved.position[i], moved.attitude[i]);
    roll += angles.roll * angles.roll;
    pitch += angles.pitch * angles.pitch;
    heading += std::pow(wrap_to_pi(angles.heading), 2);
    velocity += (moved.velocity[i] - still.velocity[i]).cwiseAbs2();
    sway += (moved.position[i] - still.position[i]);
    crossings += angles.roll * before < 0 ? 1 : 0;
    before = angles.roll;
  }
  const auto n = static_cast<double>(still.size());
  const auto rms_deg = [&](double sum) { return degrees_from_radians(std::sqrt(sum / n)); };
  EXPECT_NEAR(rms_deg(roll), 2, 0.02);
  EXPECT_NEAR(rms_deg(pitch), 2, 0.02);
  EXPECT_NEAR(rms_deg(heading), 2, 0.02);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(velocity[axis] / n), 0.15, 0.003);
    EXPECT_LT(std::abs(sway[axis] / n), 0.02);
  }
  const double crossings_per_s = crossings / seconds(still.time_ns.back());
  EXPECT_GT(crossings_per_s, 2 * 0.15);
  EXPECT_LT(crossings_per_s, 2 * 1.2);
  // Axes and seeds have motions of their own.
  FlightPlan other = plan;
  other.seed += 1;
  const Trajectory another = fly(other).trajectory;
  EXPECT_GT(another.attitude[50].angularDistance(moved.attitude[50]), 1e-3);
  const auto first = roll_pitch_heading(Frame::local, moved.position[9], moved.attitude[9]);
  EXPECT_GT(std::abs(first.roll - first.pitch), 1e-4);
  EXPECT_EQ(fly(plan).trajectory.position, moved.position);
}

// x = R(latitude, longitude) p + x0, written out in long double.
TEST(FlightPlan, OnTheEarthItIsTheSameFlightAroundItsOrigin) {
  FlightPlan plan = bundled();
  plan.rate = 10;
  const Trajectory local = fly(plan).trajectory;
  const long double latitude = 0.87L, longitude = -1.3L, height = 210;
  plan.origin = Geodetic{0.87, -1.3, 210};
  plan.time_scale = TimeScale::gps_second_of_week;
  plan.gps_week = 2400;
  plan.start = 208800.25;
  const Flight flight = fly(plan);
  const Trajectory& earth = flight.trajectory;
  EXPECT_EQ(earth.frame, Frame::geocentric);
  EXPECT_EQ(earth.time_scale, TimeScale::gps_second_of_week);
  EXPECT_EQ(earth.gps_week, 2400);
  EXPECT_EQ(earth.time_ns.front(), 208800250000000);
  EXPECT_EQ(flight.strips.front().begin_ns, 208802250000000);
  const long double a = 6378137.0L, f = 1 / 298.257223563L, e2 = f * (2 - f);
  const long double slat = std::sin(latitude), clat = std::cos(latitude);
  const long double slon = std::sin(longitude), clon = std::cos(longitude);
  const long double n = a / std::sqrt(1 - e2 * slat * slat);
  const long double x0[] = {(n + height) * clat * clon, (n + height) * clat * slon,
                            (n * (1 - e2) + height) * slat};
  const long double axes[3][3] = {{-slon, -slat * clon, clat * clon},
                                  {clon, -slat * slon, clat * slon},
                                  {0, clat, slat}};  // columns east, north, up
  for (std::size_t i = 0; i < local.size(); i += 7) {
    for (int row = 0; row < 3; ++row) {
      long double x = x0[row], v = 0;
      for (int column = 0; column < 3; ++column) {
        x += axes[row][column] * static_cast<long double>(local.position[i][column]);
        v += axes[row][column] * static_cast<long double>(local.velocity[i][column]);
      }
      ASSERT_NEAR(earth.position[i][row], static_cast<double>(x), 2e-9);
      ASSERT_NEAR(earth.velocity[i][row], static_cast<double>(v), 1e-12);
    }
    // The body's forward axis: map axes from the local flight, turned in the same way.
    const Eigen::Vector3d forward = local.attitude[i] * Eigen::Vector3d::UnitX();
    const Eigen::Vector3d on_earth = earth.attitude[i] * Eigen::Vector3d::UnitX();
    for (int row = 0; row < 3; ++row) {
      long double x = 0;
      for (int column = 0; column < 3; ++column) {
        x += axes[row][column] * static_cast<long double>(forward[column]);
      }
      ASSERT_NEAR(on_earth[row], static_cast<double>(x), 1e-14);
    }
  }
}

const std::string kText = R"(
risley_flight: 1
name: test
start: {scale: gps-second-of-week, time_s: 100.5, gps_week: 2300}
origin: {latitude_deg: 45, longitude_deg: 9, ellipsoidal_height_m: 100}
rate_hz: 100
height_m: 60
speed_m_per_s: 4
turn_duration_s: 10
lead_s: 1
strips:
  - {name: cross, headings_deg: [90, 0], length_m: 100}
  - {heading_deg: 90, count: 3, spacing_m: 20, length_m: 50, center_m: [10, 5], height_m: 40, speed_m_per_s: 8}
  - {name: last, heading_deg: 45, length_m: 70}
motion:
  seed: 9
  attitude: {roll_deg: 1, pitch_deg: 2, heading_deg: 3, lowest_hz: 0.2, highest_hz: 1, sinusoids: 4}
)";

TEST(FlightPlan, IsRead) {
  const FlightPlan plan = parse_flight_plan(kText, "plan.yaml");
  EXPECT_EQ(plan.name, "test");
  EXPECT_EQ(plan.time_scale, TimeScale::gps_second_of_week);
  EXPECT_EQ(plan.gps_week, 2300);
  EXPECT_EQ(plan.start, 100.5);
  EXPECT_DOUBLE_EQ(plan.origin->latitude, kPi / 4);
  EXPECT_EQ(plan.seed, 9u);
  EXPECT_DOUBLE_EQ(plan.attitude.rms[2], radians_from_degrees(3));
  EXPECT_EQ(plan.velocity.rms[0], 0);
  ASSERT_EQ(plan.strips.size(), 6u);
  EXPECT_EQ(plan.strips[0].name, "cross 1");
  EXPECT_EQ(plan.strips[1].name, "cross 2");
  EXPECT_EQ(plan.strips[2].name, "strip 3");
  EXPECT_EQ(plan.strips[5].name, "last");
  // Heading east, from left (north) to right (south), to and fro.
  for (std::size_t i = 0; i < 3; ++i) {
    const Strip& strip = plan.strips[2 + i];
    EXPECT_NEAR(strip.center[0], 10, 1e-12);
    EXPECT_NEAR(strip.center[1], 25 - 20 * static_cast<double>(i), 1e-12);
    EXPECT_NEAR(std::sin(strip.heading), i % 2 == 0 ? 1 : -1, 1e-12);
    EXPECT_EQ(strip.height, 40);
    EXPECT_EQ(strip.speed, 8);
  }
  EXPECT_EQ(plan.strips[5].height, 60);
  EXPECT_NO_THROW(fly(plan));
}

TEST(FlightPlan, MistakesAreToldWithTheirLine) {
  const auto message = [](const std::string& from, const std::string& to) {
    return line_and_problem([&] { parse_flight_plan(replaced(kText, from, to), "plan.yaml"); });
  };
  EXPECT_THAT(message("rate_hz", "rate"), AllOf(NamesField("rate", 6), NamesField("rate_hz")));
  EXPECT_THAT(message("risley_flight: 1", "risley_flight: 2"), NamesField("risley_flight", 2));
  EXPECT_THAT(message("gps-second-of-week", "gps-second-of-weak"),
              AllOf(NamesField("start.scale", 4), NamesField("gps-second-of-week")));
  EXPECT_THAT(message("scale: gps-second-of-week", "scale: gps"), NamesField("start.gps_week"));
  EXPECT_THAT(message("height_m: 60", "height_m: up"), NamesField("height_m", 7));
  EXPECT_THAT(message("headings_deg: [90, 0]", "heading_deg: 1, headings_deg: [90, 0]"),
              AllOf(NamesField("heading_deg"), NamesField("headings_deg")));
  EXPECT_THAT(message("headings_deg: [90, 0], ", ""), NamesField("strips[0].headings_deg", 12));
  EXPECT_THAT(message("headings_deg: [90, 0]", "headings_deg: []"),
              NamesField("strips[0].headings_deg"));
  EXPECT_THAT(message("spacing_m: 20, ", ""),
              AllOf(NamesField("strips[1].count", 13), NamesField("strips[1].spacing_m")));
  EXPECT_THAT(message("length_m: 70", "length_m: 0.5"), NamesField("strips[2].length_m", 14));
  EXPECT_THAT(message("name: last", "name: strip 3"), NamesField("\"strip 3\""));
  EXPECT_THAT(message("highest_hz: 1,", "highest_hz: 0.1,"),
              NamesField("motion.attitude.highest_hz"));
  EXPECT_EQ(message("length_m: 70", "length_m: 1, speed_m_per_s: 0.01"), "");
  EXPECT_THAT(message("length_m: 70", "length_m: 100000, speed_m_per_s: 0.01"),
              NamesField("records of the flight"));
  EXPECT_THAT(message("strips:\n", "strips: none\nx:\n"), NamesField("x"));
}

TEST(FlightPlan, StripTimesAreWritten) {
  const std::vector<StripTimes> strips{{"a: \"b\", {c}", -5, 1'700'000'000'123'456'789}};
  EXPECT_THAT(
      strip_times_text(strips, TimeScale::utc_unix),
      HasSubstr("risley_strips: 1\ntime_scale: utc-unix\nstrips:\n  - {name: \"a: \\\"b\\\", "
                "{c}\", begin_ns: -5, end_ns: 1700000000123456789}\n"));
  EXPECT_THAT(strip_times_text({}, TimeScale::gps), HasSubstr("strips: []\n"));
}

TEST(FlightPlan, RefusesPlansThatMakeNoSense) {
  const auto refused = [](auto&& change) {
    FlightPlan plan = bundled();
    change(plan);
    return refusal([&] { fly(plan); });
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refused([](auto& p) { p.strips.resize(1); }), "");
  EXPECT_THAT(refused([](auto& p) { p.strips.clear(); }), NamesField("strips of the flight"));
  EXPECT_THAT(refused([](auto& p) { p.strips[1].speed = 0; }),
              NamesField("speed of strip \"strip 2\""));
  EXPECT_THAT(refused([](auto& p) { p.strips[1].heading = kNan; }),
              NamesField("heading of strip \"strip 2\""));
  EXPECT_THAT(refused([](auto& p) { p.rate = 0; }), NamesField("rate"));
  EXPECT_THAT(refused([](auto& p) { p.turn_duration = 0; }), NamesField("turn_duration"));
  EXPECT_THAT(refused([](auto& p) { p.attitude.rms[0] = 2; }), NamesField("attitude motion rms"));
  EXPECT_THAT(refused([](auto& p) { p.velocity.sinusoids = 0; }),
              NamesField("velocity motion sinusoids"));
  EXPECT_THAT(refused([](auto& p) { p.origin = Geodetic{2, 0, 0}; }), NamesField("latitude"));
  EXPECT_THAT(refused([](auto& p) {
                p.strips[0].length = 1e5;
                p.strips[0].speed = 0.5;
              }),
              NamesField("records of the flight"));
}

}  // namespace risley::trajectories::flight_plan_test
