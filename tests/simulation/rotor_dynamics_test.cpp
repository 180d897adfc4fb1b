// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/rotor_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"

namespace risley::simulation::rotor_dynamics_test {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
const double kNominal = radians_from_degrees(-27984.0);

struct Track {
  std::vector<std::int64_t> time_ns;
  std::vector<double> angle, speed;
};

/// Angle and speed from 0 to the end at equal steps.
Track track(const RotorMotion& motion, std::int64_t end_ns, std::int64_t step_ns) {
  Track t;
  for (std::int64_t now = 0; now <= end_ns; now += step_ns) t.time_ns.push_back(now);
  t.angle.resize(t.time_ns.size());
  t.speed.resize(t.time_ns.size());
  motion.evaluate(t.time_ns, t.angle, t.speed);
  return t;
}

RotorMotion motion_of(RotorKind kind, int prism, std::int64_t end_ns, std::uint64_t seed) {
  return RotorMotion(rotor_settings(kind, 2), prism, 0.5, kNominal, end_ns, seed);
}

const std::vector<RotorKind> kKinds{RotorKind::constant, RotorKind::sinusoidal, RotorKind::hunting,
                                    RotorKind::random_walk};

TEST(RotorMotion, ConstantSpeedIsTheIdealMotion) {
  const Track t = track(motion_of(RotorKind::constant, 0, kSecond_ns, 0), kSecond_ns, 12345678);
  for (std::size_t i = 0; i < t.time_ns.size(); ++i) {
    EXPECT_EQ(t.speed[i], kNominal);
    EXPECT_DOUBLE_EQ(t.angle[i], 0.5 + kNominal * static_cast<double>(t.time_ns[i]) * 1e-9);
  }
}

TEST(RotorMotion, StartsAtTheStartAngleAtNominalSpeedPlusOscillation) {
  for (const RotorKind kind : kKinds) {
    const Track t = track(motion_of(kind, 1, kSecond_ns, 3), 0, 1);
    EXPECT_EQ(t.angle[0], 0.5) << to_string(kind);
    EXPECT_LE(std::abs(t.speed[0] - kNominal), radians_from_degrees(2.2 * std::sqrt(2.0)) + 1e-12);
  }
}

TEST(RotorMotion, SpeedIsTheDerivativeOfTheAngle) {
  constexpr std::int64_t step = 20'000;  // ns; not a divisor of anything but the knots' distance
  for (const RotorKind kind : kKinds) {
    SCOPED_TRACE(to_string(kind));
    const RotorMotion motion = motion_of(kind, 0, 2 * kSecond_ns, 5);
    const Track t = track(motion, 2 * kSecond_ns, step);
    const double h = static_cast<double>(step) * 1e-9;
    double worst = 0;
    for (std::size_t i = 1; i + 1 < t.angle.size(); ++i) {
      // Simpson's rule is exact for the cubics between knots; a step across a knot is left out.
      if (t.time_ns[i] % 1'000'000 == 0) continue;
      const double nominal = 2.0 * h * kNominal;
      const double moved = t.angle[i + 1] - t.angle[i - 1] - nominal;
      const double integral = h / 3.0 * (t.speed[i - 1] + 4.0 * t.speed[i] + t.speed[i + 1]);
      worst = std::max(worst, std::abs(moved - (integral - nominal)));
    }
    EXPECT_LT(worst, 1e-12);  // rad: rounding of angles up to 1000 rad
  }
}

TEST(RotorMotion, AngleAndSpeedDoNotJumpAtKnots) {
  const RotorMotion motion = motion_of(RotorKind::hunting, 0, kSecond_ns, 1);
  for (std::int64_t knot = 1'000'000; knot < kSecond_ns; knot += 37'000'000) {
    const std::vector<std::int64_t> time{knot - 1, knot, knot + 1};
    std::vector<double> angle(3), speed(3);
    motion.evaluate(time, angle, speed);
    EXPECT_NEAR(angle[1] - angle[0], 1e-9 * speed[1], 1e-12);
    EXPECT_NEAR(angle[2] - angle[1], 1e-9 * speed[1], 1e-12);
    EXPECT_NEAR(speed[0], speed[1], 1e-6);
    EXPECT_NEAR(speed[2], speed[1], 1e-6);
  }
}

TEST(RotorMotion, ASwingStartsAtItsFastestAndEndsWhereItBegan) {
  RotorSettings settings = rotor_settings(RotorKind::constant, 2);
  settings.swing = {radians_from_degrees(1080.0), 0.0};
  settings.swing_frequency = kTwoPi * 20;
  for (const int prism : {0, 1}) {
    const RotorMotion motion(settings, prism, 0.5, kNominal, kSecond_ns, 0);
    const Track t = track(motion, kSecond_ns / 20, kSecond_ns / 200);
    const double swing = settings.swing[static_cast<std::size_t>(prism)];
    for (std::size_t i = 0; i < t.angle.size(); ++i) {
      const double turn = kTwoPi * static_cast<double>(i) / 10, time = 0.005 * double(i);
      EXPECT_NEAR(t.speed[i], kNominal + swing * std::cos(turn), 1e-9);
      EXPECT_NEAR(t.angle[i],
                  0.5 + kNominal * time + swing / settings.swing_frequency * std::sin(turn), 1e-9);
    }
  }
  settings.swing = {1.0};
  EXPECT_THROW(RotorMotion(settings, 1, 0, 1, 1, 0), InvalidArgument);
  settings.swing_frequency = 0;
  EXPECT_THROW(RotorMotion(settings, 0, 0, 1, 1, 0), InvalidArgument);
}

TEST(RotorMotion, SinusoidHasThePapersSpread) {
  // Whole periods of 3 s and 4.3 s; without the random walk the spread is exact.
  RotorSettings settings = rotor_settings(RotorKind::sinusoidal, 2);
  for (const double walk : {0.0, settings.acceleration_noise}) {
    settings.acceleration_noise = walk;
    for (int prism = 0; prism < 2; ++prism) {
      const std::int64_t end = prism == 0 ? 30 * kSecond_ns : 43 * kSecond_ns;
      const RotorMotion motion(settings, prism, 0.0, kNominal, end, 2);
      const Track t = track(motion, end, 1'000'000);
      double mean = 0, square = 0;
      for (const double speed : t.speed) {
        mean += (speed - kNominal) / static_cast<double>(t.speed.size());
        square += (speed - kNominal) * (speed - kNominal) / static_cast<double>(t.speed.size());
      }
      const double std = degrees_from_radians(std::sqrt(square - mean * mean));
      EXPECT_NEAR(std, 2.2, walk == 0.0 ? 1e-3 : 0.05 * 2.2) << "prism " << prism;
    }
  }
}

TEST(RotorMotion, RandomWalkHasItsIntensity) {
  const RotorSettings settings = rotor_settings(RotorKind::random_walk, 2);
  constexpr int kWalks = 400;
  constexpr std::int64_t end = 2 * kSecond_ns;
  double speed_square = 0, angle_square = 0, product = 0;
  for (int seed = 0; seed < kWalks; ++seed) {
    const RotorMotion motion(settings, 0, 0.0, 0.0, end, static_cast<std::uint64_t>(seed));
    const std::vector<std::int64_t> time{end};
    std::vector<double> angle(1), speed(1);
    motion.evaluate(time, angle, speed);
    speed_square += speed[0] * speed[0] / kWalks;
    angle_square += angle[0] * angle[0] / kWalks;
    product += angle[0] * speed[0] / kWalks;
  }
  const double q = settings.acceleration_noise * settings.acceleration_noise;
  const double four_sigma = 4.0 * std::sqrt(2.0 / kWalks);
  EXPECT_NEAR(speed_square / (q * 2.0), 1.0, four_sigma);
  EXPECT_NEAR(angle_square / (q * 8.0 / 3.0), 1.0, four_sigma);
  EXPECT_NEAR(product / (q * 2.0), 1.0, four_sigma);
}

TEST(RotorMotion, KnotsHaveTheExactJointDistribution) {
  // Over one step h the angle beyond the mean of both speeds has variance q h^3 / 12.
  const RotorSettings settings = rotor_settings(RotorKind::random_walk, 1);
  const RotorMotion motion(settings, 0, 0.0, 0.0, 20 * kSecond_ns, 9);
  const Track t = track(motion, 20 * kSecond_ns, 1'000'000);
  const double h = 1e-3, q = settings.acceleration_noise * settings.acceleration_noise;
  double speed_square = 0, rest_square = 0, product = 0;
  const auto steps = static_cast<double>(t.angle.size() - 1);
  for (std::size_t i = 0; i + 1 < t.angle.size(); ++i) {
    const double speed_step = t.speed[i + 1] - t.speed[i];
    const double rest = t.angle[i + 1] - t.angle[i] - 0.5 * h * (t.speed[i] + t.speed[i + 1]);
    speed_square += speed_step * speed_step / steps;
    rest_square += rest * rest / steps;
    product += speed_step * rest / steps;
  }
  const double four_sigma = 4.0 * std::sqrt(2.0 / steps);
  EXPECT_NEAR(speed_square / (q * h), 1.0, four_sigma);
  EXPECT_NEAR(rest_square / (q * h * h * h / 12.0), 1.0, four_sigma);
  EXPECT_NEAR(product / (q * h * h / std::sqrt(12.0)), 0.0, four_sigma);
}

TEST(RotorMotion, HuntingDriftsByMoreThanARadianPerMinute) {
  constexpr std::int64_t end = 60 * kSecond_ns;
  for (int prism = 0; prism < 2; ++prism) {
    double square = 0;
    constexpr int kRuns = 20;
    for (int seed = 0; seed < kRuns; ++seed) {
      const RotorMotion motion =
          motion_of(RotorKind::hunting, prism, end, static_cast<std::uint64_t>(seed));
      const std::vector<std::int64_t> time{end};
      std::vector<double> angle(1), speed(1);
      motion.evaluate(time, angle, speed);
      const double drift = angle[0] - (0.5 + kNominal * 60.0);
      square += drift * drift / kRuns;
    }
    EXPECT_GT(std::sqrt(square), 1.0);
    EXPECT_LT(std::sqrt(square), 20.0);
  }
}

TEST(RotorMotion, HuntingOscillatesAFewTimesPerSecond) {
  RotorSettings settings = rotor_settings(RotorKind::hunting, 2);
  settings.acceleration_noise = 0;
  const RotorMotion motion(settings, 0, 0.0, 0.0, 10 * kSecond_ns, 0);
  const Track t = track(motion, 10 * kSecond_ns, 1'000'000);
  int crossings = 0;
  double lowest = 0, highest = 0;
  for (std::size_t i = 1; i < t.speed.size(); ++i) {
    crossings += (t.speed[i] > 0.0) != (t.speed[i - 1] > 0.0);
    lowest = std::min(lowest, t.angle[i]);
    highest = std::max(highest, t.angle[i]);
  }
  EXPECT_NEAR(crossings, 46, 1);  // 2.3 Hz
  EXPECT_NEAR(degrees_from_radians(highest - lowest), 2.0 * 0.2153, 1e-3);
}

TEST(RotorMotion, AnswersDoNotDependOnHowTheyAreAsked) {
  for (const RotorKind kind : kKinds) {
    SCOPED_TRACE(to_string(kind));
    const RotorMotion motion = motion_of(kind, 1, kSecond_ns, 4);
    const Track whole = track(motion, kSecond_ns, 333'333);
    for (const std::size_t size : {1u, 7u, 500u, 1000u}) {
      std::vector<double> angle(whole.angle.size()), speed(whole.angle.size());
      for (std::size_t first = 0; first < angle.size(); first += size) {
        const std::size_t count = std::min(size, angle.size() - first);
        motion.evaluate(std::span(whole.time_ns).subspan(first, count),
                        std::span(angle).subspan(first, count),
                        std::span(speed).subspan(first, count));
      }
      EXPECT_EQ(angle, whole.angle);
      EXPECT_EQ(speed, whole.speed);
    }
    // A longer recording begins with the shorter one, and large gaps between times do not matter.
    const Track longer = track(motion_of(kind, 1, 100 * kSecond_ns, 4), kSecond_ns, 333'333);
    EXPECT_EQ(longer.angle, whole.angle);
    const std::vector<std::int64_t> far{0, whole.time_ns.back()};
    std::vector<double> angle(2), speed(2);
    motion.evaluate(far, angle, speed);
    EXPECT_EQ(angle[1], whole.angle.back());
    EXPECT_EQ(speed[1], whole.speed.back());
  }
}

TEST(RotorMotion, SeedsAndPrismsDiffer) {
  const auto end_of = [](RotorKind kind, int prism, std::uint64_t seed) {
    return track(motion_of(kind, prism, kSecond_ns, seed), kSecond_ns, 1'000'000).angle.back();
  };
  for (const RotorKind kind : {RotorKind::sinusoidal, RotorKind::hunting, RotorKind::random_walk}) {
    EXPECT_NE(end_of(kind, 0, 1), end_of(kind, 0, 2));
    EXPECT_NE(end_of(kind, 0, 1), end_of(kind, 1, 1));
    EXPECT_EQ(end_of(kind, 0, 1), end_of(kind, 0, 1));
  }
}

TEST(RotorMotion, KindsHaveNames) {
  EXPECT_THROW(rotor_kind_from("wobbly"), InvalidArgument);
  for (const std::string& name : rotor_kind_names()) {
    EXPECT_EQ(to_string(rotor_kind_from(name)), name);
  }
}

}  // namespace risley::simulation::rotor_dynamics_test
