// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/rotor_trajectory.hpp"

#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley::estimation::rotor_trajectory_test {

using ::testing::ElementsAre;
using Sizes = std::vector<std::size_t>;

/// Shots at some times, distinguished by their azimuth.
AngleSeries series_at(const std::vector<std::int64_t>& time_ns) {
  AngleSeries series;
  for (const std::int64_t time : time_ns) {
    series.append(time, static_cast<double>(series.size()), 0);
  }
  return series;
}

std::vector<std::pair<std::size_t, std::size_t>> pairs(const std::vector<ShotRange>& ranges) {
  std::vector<std::pair<std::size_t, std::size_t>> result;
  for (const ShotRange& range : ranges) result.emplace_back(range.begin, range.end);
  return result;
}

TEST(Stretches, AreCutAtClockResetsAndLongGaps) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const AngleSeries series =
      series_at({7, 8, 5 * kSecond + 8, 10 * kSecond + 9, 10 * kSecond + 10, 3, 4, 4, 5});
  EXPECT_THAT(pairs(stretches(series)), ElementsAre(std::pair(0u, 3u), std::pair(3u, 5u),
                                                    std::pair(5u, 7u), std::pair(7u, 9u)));
  EXPECT_THAT(pairs(stretches(series, 1.0)),
              ElementsAre(std::pair(0u, 2u), std::pair(2u, 3u), std::pair(3u, 5u),
                          std::pair(5u, 7u), std::pair(7u, 9u)));
  EXPECT_TRUE(stretches({}).empty());
}

TEST(MakeKnots, TimesMayBeAsLateAsTheyAreStored) {
  constexpr std::int64_t kLate = 9'200'000'000'000'000'000;
  const AngleSeries series = series_at({kLate, kLate + 10, kLate + 20});
  const std::vector<ShotRange> all{{0, 3}};
  const RotorTrajectory knots = make_knots(series, all, 1, 1e8);
  ASSERT_EQ(knots.size(), 1U);
  EXPECT_EQ(knots.last_shot[0], 3U);
}

TEST(Thinned, TakesTheFirstShotOfEveryTickOfEachStretch) {
  std::vector<std::int64_t> times;
  for (std::int64_t i = 0; i < 1000; ++i) times.push_back(5'000 + i * 10'000);  // 100 kHz, 10 ms
  for (std::int64_t i = 0; i < 300; ++i) times.push_back(77 + i * 10'000);      // clock reset
  const AngleSeries series = series_at(times);
  std::vector<ShotRange> ranges{{0, 1000}, {1000, 1300}};
  const AngleSeries thin = thinned(series, 1000.0, ranges).rows();
  ASSERT_EQ(thin.size(), 13u);
  EXPECT_THAT(pairs(ranges), ElementsAre(std::pair(0u, 10u), std::pair(10u, 13u)));
  for (std::size_t i = 0; i < 13; ++i) {
    EXPECT_EQ(thin.azimuth[i], static_cast<double>(100 * i));
    EXPECT_EQ(thin.time_ns[i], times[100 * i]);
  }
}

TEST(Thinned, EveryBeamHasItsTurnAtEveryRate) {
  constexpr std::size_t kBeams = 6, kShots = 60000;
  for (const std::size_t every : {1u, 2u, 3u, 4u, 5u, 6u, 8u, 9u, 12u, 24u, 240u}) {
    AngleSeries series;
    for (std::size_t i = 0; i < kShots; ++i) {
      series.append(static_cast<std::int64_t>(i) * 4000, 0.0, 0.5 * kPi,
                    static_cast<std::uint8_t>(i % kBeams));
    }
    std::vector<ShotRange> ranges{{0, kShots}};
    const AngleSeries thin = thinned(series, 250000.0 / static_cast<double>(every), ranges).rows();
    std::vector<std::size_t> count(kBeams);
    for (const std::uint8_t beam : thin.beam) ++count[beam];
    const double expected = static_cast<double>(kShots / every);
    EXPECT_NEAR(static_cast<double>(thin.size()), expected, 0.02 * expected) << every;
    for (const std::size_t one : count) {
      EXPECT_NEAR(static_cast<double>(one * kBeams), static_cast<double>(thin.size()), 12.0)
          << every;
    }
  }
}

TEST(Thinned, RoundedTimesTakeNoTickTwice) {
  AngleSeries series;
  for (std::size_t i = 0; i < 240000; ++i) {  // 240 kHz
    series.append(static_cast<std::int64_t>(i * 12500 / 3), 0.0, 0.5 * kPi);
  }
  std::vector<ShotRange> ranges{{0, series.size()}};
  EXPECT_EQ(thinned(series, 30000.0, ranges).size(), 30000u);
}

TEST(Thinned, ABeamThatStaysAwayHoldsNobodyUp) {
  AngleSeries series;
  for (std::size_t i = 0; i < 60000; ++i) {
    if (i % 6 == 2) continue;  // no return
    series.append(static_cast<std::int64_t>(i) * 4000, 0.0, 0.5 * kPi,
                  static_cast<std::uint8_t>(i % 6));
  }
  std::vector<ShotRange> ranges{{0, series.size()}};
  const AngleSeries thin = thinned(series, 25000.0, ranges).rows();
  std::vector<std::size_t> count(6);
  for (const std::uint8_t beam : thin.beam) ++count[beam];
  EXPECT_NEAR(static_cast<double>(thin.size()), 6000.0, 300.0);
  for (const std::size_t beam : {0u, 1u, 3u, 4u, 5u}) EXPECT_GT(count[beam], 700u) << beam;
}

TEST(Thinned, TicksStayWhereTheyAreOverGapsAndJitter) {
  // Ticks of 1 ms from 500 ns on: each takes its first shot, late or not, and never two.
  const AngleSeries series = series_at({500, 990'000, 1'000'499, 1'000'500, 1'400'000, 2'700'000,
                                        2'990'000, 3'000'600, 7'999'000, 8'000'000, 8'000'500});
  std::vector<ShotRange> ranges{{0, 11}};
  EXPECT_THAT(thinned(series, 1000.0, ranges).rows().azimuth, ElementsAre(0, 3, 5, 7, 8, 10));
  // Only what was asked for, and all of it where there is less than a shot per tick.
  ranges = {{2, 5}, {8, 11}};
  EXPECT_THAT(thinned(series, 1e9, ranges).rows().azimuth, ElementsAre(2, 3, 4, 8, 9, 10));
  EXPECT_THAT(pairs(ranges), ElementsAre(std::pair(0u, 3u), std::pair(3u, 6u)));
}

TEST(MakeKnots, StandOnAGridFromTheFirstShotAndOnlyWhereThereAreShots) {
  const AngleSeries series = series_at({1'000, 1'000'000, 2'000'999,  // slot 0: below 2'001'000
                                        2'001'000, 2'001'003,         // slot 1
                                        8'500'000,                    // slot 4
                                        100, 2'000'099, 2'000'100});  // a new clock
  const std::vector<ShotRange> ranges{{0, 6}, {6, 9}};
  const RotorTrajectory knots = make_knots(series, ranges, 3);
  EXPECT_EQ(knots.prisms, 3);
  EXPECT_EQ(knots.states(), 9);
  ASSERT_EQ(knots.size(), 5u);
  EXPECT_EQ(knots.stretch_begin, (Sizes{0, 3}));
  EXPECT_EQ(knots.first_shot, (Sizes{0, 3, 5, 6, 8}));
  EXPECT_EQ(knots.last_shot, (Sizes{3, 5, 6, 8, 9}));
  EXPECT_THAT(knots.time_ns, ElementsAre(1'000'999, 2'001'001, 8'500'000, 1'000'099, 2'000'100));
  EXPECT_EQ(knots.state, std::vector<double>(45, 0.0));
  EXPECT_TRUE(knots.covariance.empty());
}

TEST(MakeKnots, ServeTheGivenStretchesAlone) {
  std::vector<std::int64_t> times;
  for (std::int64_t i = 0; i < 100; ++i) times.push_back(i * 1'000'000);
  const AngleSeries series = series_at(times);
  const std::vector<ShotRange> ranges{{5, 15}, {20, 20}, {40, 47}};
  const RotorTrajectory knots = make_knots(series, ranges, 1, 0.004);
  EXPECT_EQ(knots.stretch_begin, (Sizes{0, 3}));
  EXPECT_EQ(knots.first_shot, (Sizes{5, 9, 13, 40, 44}));
  EXPECT_EQ(knots.last_shot, (Sizes{9, 13, 15, 44, 47}));
  EXPECT_THAT(knots.time_ns,
              ElementsAre(6'500'000, 10'500'000, 13'500'000, 41'500'000, 45'000'000));
}

TEST(RotorTrajectory, AngleAndSpeedFollowTheParabola) {
  RotorTrajectory t;
  t.prisms = 2;
  t.time_ns = {0, 10};
  t.state = {1, 2, 4, 10, 20, 40, -1, -2, -4, 5, 6, 7};
  EXPECT_DOUBLE_EQ(t.angle(0, 1, 0.5), 10 + 0.5 * 20 + 0.125 * 40);
  EXPECT_DOUBLE_EQ(t.speed(0, 1, 0.5), 20 + 0.5 * 40);
  EXPECT_DOUBLE_EQ(t.angle(1, 0, -0.5), -1 + 0.5 * 2 - 0.125 * 4);
  EXPECT_DOUBLE_EQ(t.speed(1, 0, -0.5), -2 + 0.5 * 4);
}

TEST(RotorTrajectory, CovariancesAreThoseOfTheParabolasDenseCovariance) {
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  constexpr int kKnots = 3;
  for (const int prisms : {1, 2, 3, 4}) {
    const int d = 3 * prisms;
    RotorTrajectory t;
    t.prisms = prisms;
    t.time_ns.assign(kKnots, 0);
    std::vector<Eigen::MatrixXd> dense;
    for (int knot = 0; knot < kKnots; ++knot) {
      Eigen::MatrixXd root(d, d);
      for (double& value : root.reshaped()) value = normal(generator);
      dense.push_back(root * root.transpose());
      for (int i = 0; i < d; ++i) {
        for (int j = i; j < d; ++j) t.covariance.push_back(dense.back()(i, j));
      }
    }
    for (std::size_t knot = 0; knot < kKnots; ++knot) {
      for (const double seconds : {0.0, 0.7, -1.3}) {
        const auto weights = [&](int rotor, const Eigen::Vector3d& own) {
          Eigen::VectorXd b = Eigen::VectorXd::Zero(d);
          b.segment<3>(3 * rotor) = own;
          return b;
        };
        const Eigen::Vector3d angle(1.0, seconds, 0.5 * seconds * seconds), speed(0, 1, seconds);
        for (int a = 0; a < prisms; ++a) {
          const auto rotor = static_cast<std::size_t>(a);
          for (int b = 0; b < prisms; ++b) {
            EXPECT_NEAR(t.angle_covariance(knot, rotor, static_cast<std::size_t>(b), seconds),
                        weights(a, angle).dot(dense[knot] * weights(b, angle)), 1e-12);
          }
          EXPECT_NEAR(polynomial_at(t.speed_variance_terms(knot, rotor), seconds),
                      weights(a, speed).dot(dense[knot] * weights(a, speed)), 1e-12);
        }
      }
    }
  }
}

TEST(Interpolate, CarriesTheNearestKnotOfTheSameStretch) {
  RotorTrajectory from;
  from.prisms = 2;
  from.stretch_begin = {0, 2};
  from.time_ns = {10'000'000, 30'000'000, 5'000'000, 25'000'000};
  std::mt19937_64 generator(2);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 24; ++i) from.state.push_back(normal(generator));
  RotorTrajectory to;
  to.prisms = 2;
  to.stretch_begin = {0, 4};
  to.time_ns = {0, 19'000'000, 21'000'000, 80'000'000, 1'000'000, 14'000'000, 16'000'000};
  to.state.assign(42, 99.0);
  const Sizes nearest{0, 0, 1, 1, 2, 2, 3};
  interpolate(from, to);
  for (std::size_t knot = 0; knot < to.size(); ++knot) {
    const std::size_t near = nearest[knot];
    const double seconds = 1e-9 * static_cast<double>(to.time_ns[knot] - from.time_ns[near]);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto old = from.state_of(near).subspan(3 * k);
      const auto found = to.state_of(knot).subspan(3 * k);
      EXPECT_NEAR(found[0], old[0] + seconds * old[1] + 0.5 * seconds * seconds * old[2], 1e-15);
      EXPECT_NEAR(found[1], old[1] + seconds * old[2], 1e-15);
      EXPECT_EQ(found[2], old[2]);
    }
  }
}

TEST(Interpolate, KeepsAParabolaOnAnyOtherKnots) {
  std::vector<std::int64_t> times;
  for (std::int64_t i = 0; i < 700; ++i) times.push_back(i * 100'000 + (i > 300 ? 20'000'000 : 0));
  const AngleSeries series = series_at(times);
  const std::vector<ShotRange> all{{0, 700}};
  RotorTrajectory coarse = make_knots(series, all, 1, 0.007), fine = make_knots(series, all, 1);
  const auto fill = [](RotorTrajectory& t) {
    for (std::size_t knot = 0; knot < t.size(); ++knot) {
      const double s = 1e-9 * static_cast<double>(t.time_ns[knot]);
      const auto state = t.state_of(knot);
      state[0] = 3.0 + s * (500.0 + 0.5 * s * -800.0);
      state[1] = 500.0 - s * 800.0;
      state[2] = -800.0;
    }
  };
  fill(coarse);
  RotorTrajectory expected = fine;
  fill(expected);
  interpolate(coarse, fine);
  for (std::size_t i = 0; i < fine.state.size(); ++i) {
    EXPECT_NEAR(fine.state[i], expected.state[i], 1e-12 * (1.0 + std::abs(expected.state[i])));
  }
}

TEST(Interpolate, RefusesOtherStretchesAndOtherRotors) {
  const AngleSeries series = series_at({0, 1'000'000, 2'000'000, 3'000'000});
  const std::vector<ShotRange> one{{0, 4}}, two{{0, 2}, {2, 4}};
  RotorTrajectory to = make_knots(series, one, 2);
  EXPECT_THROW(interpolate(make_knots(series, two, 2), to), InvalidArgument);
  EXPECT_THROW(interpolate(make_knots(series, one, 3), to), InvalidArgument);
}

}  // namespace risley::estimation::rotor_trajectory_test
