// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/trajectories/interpolation.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/random.hpp"

namespace risley::trajectories::interpolation_test {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr std::int64_t kStep_ns = 5'000'000;

using Angles = std::function<RollPitchHeading(double)>;

Trajectory sampled(const Angles& angles, int records, std::int64_t step_ns = kStep_ns) {
  Trajectory t;
  for (int i = 0; i < records; ++i) {
    t.time_ns.push_back(400'000'000'000'000 + i * step_ns);
    const double time = 1e-9 * static_cast<double>(i * step_ns);
    t.position.emplace_back(5 * time, std::sin(time), 80 + 0.1 * std::cos(3 * time));
    t.attitude.push_back(ned_from_body(angles(time)));
  }
  return t;
}

/// Largest error of an attitude between records, deg.
double worst_deg(const Trajectory& t, const Angles& angles, double from_s, double to_s) {
  const Interpolation interpolation(t);
  Interpolation::Cursor cursor = interpolation.cursor();
  double worst = 0;
  for (double time = from_s; time <= to_s; time += 0.00037) {
    const auto pose = cursor.at(t.time_ns.front() + std::llround(time * 1e9));
    EXPECT_TRUE(pose) << time;
    if (!pose) return 360;
    const double exact_time = 1e-9 * static_cast<double>(std::llround(time * 1e9));
    worst = std::max(worst, pose->attitude.angularDistance(ned_from_body(angles(exact_time))));
  }
  return degrees_from_radians(worst);
}

/// Motion of 50 deg/s at most about one axis.
Angles shaking(double hertz, int axis) {
  return [=](double time) {
    const double angle =
        radians_from_degrees(50) / (kTwoPi * hertz) * std::sin(kTwoPi * hertz * time);
    return RollPitchHeading{axis == 0 ? angle : 0.02, axis == 1 ? angle : -0.03,
                            1.0 + (axis == 2 ? angle : 0)};
  };
}

TEST(Interpolation, KeepsAttitudesOfShakingPlatforms) {
  for (const double hertz : {1.0, 2.0, 5.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Angles angles = shaking(hertz, axis);
      const Trajectory t = sampled(angles, 401);
      // The stated error of the method, 5 Hz: 1.2e-7 deg inside; a cubic spline's is 2.5e-6.
      const double amplitude_deg = 50 / (kTwoPi * hertz), phase = kTwoPi * hertz * 0.005;
      const double stated = 0.0049 * amplitude_deg * std::pow(phase, 6);
      EXPECT_LT(worst_deg(t, angles, 0.02, 1.98), 1.1 * stated + 2e-6 * 1e-3) << hertz << axis;
      EXPECT_LT(worst_deg(t, angles, 0, 2), 3e-6) << hertz << axis;  // ends included
    }
  }
}

TEST(Interpolation, ThreeAxesAtOnceAndBothWays) {
  const Angles angles = [](double time) {
    return RollPitchHeading{0.3 * std::sin(6 * time), 0.2 * std::cos(5 * time), 4 + 0.8 * time};
  };
  EXPECT_LT(worst_deg(sampled(angles, 301), angles, 0, 1.5), 3e-6);
}

TEST(Interpolation, VelocitiesAreDerivatives) {
  const Angles angles = [](double time) {
    return RollPitchHeading{0.3 * std::sin(6 * time), 0.2 * std::cos(5 * time), 4 + 0.8 * time};
  };
  const Trajectory t = sampled(angles, 301);
  const Interpolation interpolation(t);
  for (double time = 0.001; time < 1.49; time += 0.0127) {
    const std::int64_t at = t.time_ns.front() + std::llround(time * 1e9);
    const double exact = 1e-9 * static_cast<double>(std::llround(time * 1e9));
    const Pose pose = interpolation.at(at).value();
    const Vector3d velocity(5, std::cos(exact), -0.3 * std::sin(3 * exact));
    EXPECT_LT((pose.velocity - velocity).norm(), 1e-9);
    constexpr double kApart = 1e-5;
    const Eigen::Matrix3d change = (ned_from_body(angles(exact + kApart)).toRotationMatrix() -
                                    ned_from_body(angles(exact - kApart)).toRotationMatrix()) /
                                   (2 * kApart);
    const Eigen::Matrix3d spin = change * pose.attitude.toRotationMatrix().transpose();
    EXPECT_LT((pose.angular_velocity - Vector3d(spin(2, 1), spin(0, 2), spin(1, 0))).norm(), 1e-7);
  }
}

TEST(Interpolation, HeadingsCrossNorthTheShortWay) {
  const Angles angles = [](double time) {
    return RollPitchHeading{0, 0, wrap_to_two_pi(radians_from_degrees(359.9 + 40 * time))};
  };
  const Trajectory t = sampled(angles, 5);
  const Pose pose = Interpolation(t).at(t.time_ns.front() + kStep_ns / 2).value();
  EXPECT_NEAR(degrees_from_radians(roll_pitch_heading(pose.attitude).heading), 0.0, 1e-9);
  EXPECT_NEAR(degrees_from_radians(pose.angular_velocity.z()), 40, 1e-9);
}

TEST(Interpolation, SignsOfQuaternionsDoNotMatter) {
  const Angles angles = shaking(2, 1);
  const Trajectory plain = sampled(angles, 60);
  Trajectory flipped = plain;
  for (std::size_t i = 0; i < flipped.size(); i += 1 + i % 3) {
    flipped.attitude[i].coeffs() = -flipped.attitude[i].coeffs();
  }
  const Interpolation one(plain), other(flipped);
  for (std::int64_t time = plain.time_ns.front(); time <= plain.time_ns.back(); time += 777'777) {
    const Pose a = one.at(time).value(), b = other.at(time).value();
    EXPECT_LT(a.attitude.angularDistance(b.attitude), 1e-14);
    EXPECT_LT((a.angular_velocity - b.angular_velocity).norm(), 1e-12);
  }
}

TEST(Interpolation, LoopsThroughTheVerticalStaySmooth) {
  const Angles loop = [](double time) { return RollPitchHeading{0, 1.5 + 0.6 * time, 1}; };
  const Trajectory t = sampled(loop, 101);
  EXPECT_LT(worst_deg(t, loop, 0, 0.5), 3e-6);
}

TEST(Interpolation, WholeTurnsWithinTheRecordsOfAPolynomial) {
  // 100 degrees per step: six records turn by more than a whole turn.
  const Angles spinning = [](double time) {
    return RollPitchHeading{0, 0, radians_from_degrees(20000 * time)};
  };
  const Trajectory t = sampled(spinning, 12);
  EXPECT_LT(worst_deg(t, spinning, 0, 0.055), 1e-9);
}

TEST(Interpolation, GoesThroughEveryRecord) {
  const Trajectory t = sampled(shaking(5, 0), 40);
  const Interpolation interpolation(t);
  for (std::size_t i = 0; i < t.size(); ++i) {
    const Pose pose = interpolation.at(t.time_ns[i]).value();
    EXPECT_LT((pose.position - t.position[i]).norm(), 1e-12);
    EXPECT_LT(pose.attitude.angularDistance(t.attitude[i]), 1e-14);
  }
}

TEST(Interpolation, NothingBeyondTheEnds) {
  const Trajectory t = sampled(shaking(1, 0), 40);
  const Interpolation interpolation(t);
  EXPECT_FALSE(interpolation.at(t.time_ns.front() - 1));
  EXPECT_TRUE(interpolation.at(t.time_ns.front()));
  EXPECT_TRUE(interpolation.at(t.time_ns.back()));
  EXPECT_FALSE(interpolation.at(t.time_ns.back() + 1));
  EXPECT_FALSE(interpolation.at(std::numeric_limits<std::int64_t>::min()));
  EXPECT_FALSE(interpolation.at(std::numeric_limits<std::int64_t>::max()));
}

/// Without records [begin, end).
Trajectory without(Trajectory t, std::size_t begin, std::size_t end) {
  const auto cut = [&](auto& column) {
    column.erase(column.begin() + begin, column.begin() + end);
  };
  cut(t.time_ns);
  cut(t.position);
  cut(t.attitude);
  return t;
}

TEST(Interpolation, NothingAcrossGaps) {
  const Angles angles = shaking(1, 2);
  const Trajectory whole = sampled(angles, 100);
  const Trajectory t = without(whole, 50, 70);
  const Interpolation interpolation(t);
  ASSERT_EQ(interpolation.gaps().size(), 1U);
  EXPECT_EQ(interpolation.gaps()[0].row, 49U);
  EXPECT_EQ(interpolation.gaps()[0].begin_ns, whole.time_ns[49]);
  EXPECT_EQ(interpolation.gaps()[0].end_ns, whole.time_ns[70]);
  EXPECT_EQ(interpolation.median_step_ns(), kStep_ns);
  Interpolation::Cursor cursor = interpolation.cursor();
  EXPECT_TRUE(cursor.at(whole.time_ns[49]));
  EXPECT_FALSE(cursor.at(whole.time_ns[49] + 1));
  EXPECT_FALSE(cursor.at(whole.time_ns[70] - 1));
  EXPECT_TRUE(cursor.at(whole.time_ns[70]));
  // The poses next to the gap are those of the whole trajectory to the accuracy of its end, so
  // nothing from the other side went in.
  const Interpolation of_whole(whole);
  for (const std::int64_t time : {whole.time_ns[48] + 1'000'000, whole.time_ns[70] + 4'000'000}) {
    const Pose a = cursor.at(time).value(), b = of_whole.at(time).value();
    EXPECT_LT(degrees_from_radians(a.attitude.angularDistance(b.attitude)), 3e-6);
    EXPECT_LT((a.position - b.position).norm(), 1e-9);
  }
}

TEST(Interpolation, OtherSideOfAGapChangesNothing) {
  Trajectory t = without(sampled(shaking(1, 2), 100), 50, 70);
  const std::int64_t time = t.time_ns[49] - 1'500'000;
  const Pose before = Interpolation(t).at(time).value();
  for (std::size_t i = 50; i < t.size(); ++i) t.position[i] += Vector3d(1000, 0, 0);
  EXPECT_EQ(Interpolation(t).at(time).value().position, before.position);
}

TEST(Interpolation, TwoLostRecordsAreNoGapAndThreeAre) {
  const Trajectory whole = sampled(shaking(1, 2), 100);
  EXPECT_TRUE(Interpolation(without(whole, 50, 52)).gaps().empty());
  EXPECT_EQ(Interpolation(without(whole, 50, 53)).gaps().size(), 1U);
  EXPECT_EQ(Interpolation(without(whole, 50, 52), {.gap_steps = 2.5}).gaps().size(), 1U);
  EXPECT_LT(worst_deg(without(whole, 50, 52), shaking(1, 2), 0, 0.49), 3e-6);
}

TEST(Interpolation, ARecordBetweenTwoGapsHasNoPose) {
  Trajectory t = without(sampled(shaking(1, 2), 100), 50, 60);
  t = without(t, 51, 60);
  const Interpolation interpolation(t);
  EXPECT_EQ(interpolation.gaps().size(), 2U);
  EXPECT_FALSE(interpolation.at(t.time_ns[50]));
  EXPECT_TRUE(interpolation.at(t.time_ns[49]));
  EXPECT_TRUE(interpolation.at(t.time_ns[51]));
}

TEST(Interpolation, FewRecordsGiveWhatTheyCan) {
  const Trajectory one = sampled(shaking(1, 2), 1);
  EXPECT_FALSE(Interpolation(one).at(one.time_ns[0]));
  EXPECT_EQ(Interpolation(one).median_step_ns(), 0);
  const Trajectory two = sampled(shaking(1, 2), 2);
  const Pose pose = Interpolation(two).at(two.time_ns[0] + kStep_ns / 2).value();
  EXPECT_LT((pose.position - 0.5 * (two.position[0] + two.position[1])).norm(), 1e-12);
  EXPECT_LT(pose.attitude.angularDistance(two.attitude[0].slerp(0.5, two.attitude[1])), 1e-12);
  for (int records = 3; records < 7; ++records) {
    EXPECT_LT(worst_deg(sampled(shaking(1, 2), records), shaking(1, 2), 0, 0.005 * (records - 1)),
              4e-3 / records);
  }
}

TEST(Interpolation, AlmostDoubledTimesDoNotShakeTheNeighbours) {
  Trajectory t = sampled(shaking(1, 2), 60);
  // A record 100 ns after another one, 1 mm off.
  const auto at = static_cast<std::ptrdiff_t>(30);
  t.time_ns.insert(t.time_ns.begin() + at + 1, t.time_ns[30] + 100);
  t.position.insert(t.position.begin() + at + 1, t.position[30] + Vector3d(0.001, 0, 0));
  t.attitude.insert(t.attitude.begin() + at + 1, t.attitude[30]);
  const Trajectory plain = sampled(shaking(1, 2), 60);
  const Interpolation disturbed(t), clean(plain);
  for (std::int64_t time = plain.time_ns.front(); time <= plain.time_ns.back(); time += 333'333) {
    const double off =
        (disturbed.at(time).value().position - clean.at(time).value().position).norm();
    EXPECT_LT(off, 0.0013) << time - plain.time_ns.front();
  }
}

TEST(Interpolation, CursorsTakeTimesInAnyOrder) {
  const Trajectory t = without(sampled(shaking(5, 1), 200), 90, 99);
  const Interpolation interpolation(t);
  Interpolation::Cursor cursor = interpolation.cursor();
  const RandomStream random(2, 3);
  const auto span = static_cast<double>(t.time_ns.back() - t.time_ns.front());
  std::int64_t time = t.time_ns.front();
  for (std::uint64_t i = 0; i < 5000; ++i) {
    // Mostly forward in small steps, sometimes anywhere, sometimes on a record.
    const double which = random.uniform(3 * i);
    if (which < 0.8)
      time += std::llround(2e6 * random.uniform(3 * i + 1));
    else if (which < 0.9)
      time = t.time_ns.front() + std::llround(span * random.uniform(3 * i + 1));
    else
      time = t.time_ns[static_cast<std::size_t>(random.uniform(3 * i + 1) * 191)];
    const auto a = cursor.at(time), b = interpolation.at(time);
    ASSERT_EQ(a.has_value(), b.has_value()) << i;
    if (!a) continue;
    // A record between two intervals is given by either.
    EXPECT_LT((a->position - b->position).norm(), 1e-12) << i;
    EXPECT_LT(a->attitude.angularDistance(b->attitude), 1e-14) << i;
  }
}

}  // namespace risley::trajectories::interpolation_test
