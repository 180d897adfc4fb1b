// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/initialisation.hpp"

#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/estimation/rotor_track.hpp"
#include "risley/estimation/spectral_lines.hpp"

#include "estimation/series.hpp"
#include "refusal.hpp"

namespace risley::estimation::initialisation_test {

/// A Mid-40 with random errors, speeds and combination.
sensors::Sensor random_sensor(std::mt19937_64& generator, double error_deg, double speed_share) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  auto sensor = sensors::load_sensor(uniform(generator) < 0 ? "mid-40" : "mid-40-reversed");
  for (const std::string& name : default_free_names({2})) {
    const double step = name == "refractive_index" ? 0.002 : radians_from_degrees(error_deg);
    sensor.set(name, sensor.get(name) + step * normal(generator));
  }
  for (double& speed : sensor.angular_velocity) speed *= 1.0 + speed_share * uniform(generator);
  return sensor;
}

class StartOfRandomSensors : public ::testing::TestWithParam<double> {};  // rate, Hz

TEST_P(StartOfRandomSensors, AlwaysFindsCombinationSpeedsAndAngles) {
  const auto nominal = sensors::load_sensor("mid-40");
  const auto free = free_parameters(default_free_names({2}), {2});
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> phase(-kPi, kPi);
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(i);
    const auto sensor = random_sensor(generator, 0.3, 0.01);
    const double a = phase(generator), b = phase(generator);
    const auto head = testing::constant_speed_series(sensor, a, b, 1.0, GetParam(), 0.01,
                                                     static_cast<unsigned>(i));
    const Start start = find_start(head, nominal, {free, radians_from_degrees(0.01), false, false});
    ASSERT_EQ(start.combination, sensor.combination);
    EXPECT_LT(degrees_from_radians(start.residual_rms), 0.02);
    const double t = 1e-9 * static_cast<double>(start.time_ns - head.time_ns[0]);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(degrees_from_radians(start.angular_velocity[k]),
                  degrees_from_radians(sensor.angular_velocity[k]), 15.0);
      const double truth = (k == 0 ? a : b) + t * sensor.angular_velocity[k];
      EXPECT_LT(degrees_from_radians(std::abs(wrap_to_pi(start.rotation_angle[k] - truth))), 1.0);
    }
    const auto found_mirrored = [&](const AngleSeries& shots) {
      return find_start(shots, nominal, {free, radians_from_degrees(0.01), std::nullopt, {}})
          .mirrored;
    };
    EXPECT_FALSE(found_mirrored(head));
    AngleSeries turned = head;
    mirror(turned, false);
    EXPECT_TRUE(found_mirrored(turned));
  }
}

INSTANTIATE_TEST_SUITE_P(Rates, StartOfRandomSensors, ::testing::Values(1000.0, 100000.0),
                         [](const auto& rate) { return fmt::format("{:.0f}Hz", rate.param); });

/// Which shots of a recording found something to return from.
struct Coverage {
  const char* name;
  bool (*returns)(const SphericalAngles<double>& shot, std::size_t number);
};

constexpr double kDegree = radians_from_degrees(1.0);
constexpr Coverage kCoverages[] = {
    {"below", [](const SphericalAngles<double>& s,
                 std::size_t) { return s.zenith > kPi / 2 + 2 * kDegree; }},
    {"above", [](const SphericalAngles<double>& s, std::size_t) { return s.zenith < kPi / 2; }},
    {"left", [](const SphericalAngles<double>& s, std::size_t) { return s.azimuth > 0; }},
    {"window",
     [](const SphericalAngles<double>& s, std::size_t) {
       return std::abs(s.azimuth - 5 * kDegree) < 6 * kDegree &&
              std::abs(s.zenith - kPi / 2 - 4 * kDegree) < 6 * kDegree;
     }},
    {"fifth",
     [](const SphericalAngles<double>&, std::size_t number) { return number * 7919 % 10 < 2; }},
};

class StartUnderTheSky : public ::testing::TestWithParam<Coverage> {};

TEST_P(StartUnderTheSky, FindsCombinationAndAnglesWhereShotsAreMissing) {
  const auto nominal = sensors::load_sensor("mid-40");
  const auto free = free_parameters(default_free_names({2}), {2});
  std::mt19937_64 generator(11);
  std::uniform_real_distribution<double> phase(-kPi, kPi);
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(i);
    const auto sensor = random_sensor(generator, 0.3, 0.01);
    const double a = phase(generator), b = phase(generator);
    const double duration = i % 3 == 0 ? 0.05 : 0.1;
    const auto whole = testing::constant_speed_series(sensor, a, b, duration, 100000.0, 0.002,
                                                      static_cast<unsigned>(i));
    AngleSeries head;
    for (std::size_t k = 0; k < whole.size(); ++k) {
      if (GetParam().returns({whole.azimuth[k], whole.zenith[k]}, k)) head.append(whole, k);
    }
    const Start start = find_start(head, nominal, {free, 0.01 * kDegree, std::nullopt, {}});
    ASSERT_EQ(start.combination, sensor.combination);
    EXPECT_FALSE(start.mirrored);
    EXPECT_FALSE(start.frame);
    EXPECT_LT(degrees_from_radians(start.residual_rms), 0.02);
    const double t = 1e-9 * static_cast<double>(start.time_ns - whole.time_ns[0]);
    for (std::size_t k = 0; k < 2; ++k) {
      const double truth = (k == 0 ? a : b) + t * sensor.angular_velocity[k];
      EXPECT_LT(degrees_from_radians(std::abs(wrap_to_pi(start.rotation_angle[k] - truth))), 3.0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Coverages, StartUnderTheSky, ::testing::ValuesIn(kCoverages),
                         [](const auto& coverage) { return coverage.param.name; });

TEST(Initialisation, ATurnedFrameIsFoundAboutItsOpticalAxis) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  const auto whole = testing::constant_speed_series(sensor, 2.0, -1.0, 0.1, 100000.0, 0.002, 3);
  for (const bool sky : {false, true}) {
    for (const FrameTurn& turned :
         {FrameTurn{0.45, 0.0}, FrameTurn{-2.8, 0.3}, FrameTurn{0.0, radians_from_degrees(60.0)},
          FrameTurn{radians_from_degrees(5.0), 0.0}}) {
      AngleSeries head;
      for (std::size_t i = 0; i < whole.size(); ++i) {
        if (!sky || whole.zenith[i] > kPi / 2) head.append(whole, i);
      }
      turn(head, recording_from_sensor(turned));
      const Start start = find_start(head, sensors::load_sensor("mid-40"),
                                     {free_parameters(default_free_names({2}), {2}), 1e-4, {}, {}});
      EXPECT_EQ(start.combination, sensor.combination);
      EXPECT_FALSE(start.mirrored);
      ASSERT_TRUE(start.frame) << turned.yaw;
      // The incident beam's error and the axis are one to first order.
      EXPECT_NEAR(wrap_to_pi(start.frame->yaw - turned.yaw), 0.0, radians_from_degrees(1.0));
      EXPECT_NEAR(start.frame->pitch, turned.pitch, radians_from_degrees(1.0));
      EXPECT_LT(degrees_from_radians(start.residual_rms), 0.02);
    }
  }
}

TEST(Initialisation, WhatTwoAnswersDescribeEquallyWellIsRefused) {
  // A patch of the field so small that the optics leave no mark in it.
  const auto sensor = sensors::load_sensor("mid-40");
  const auto whole = testing::constant_speed_series(sensor, 0.5, 2.5, 0.1, 100000.0, 0.1, 5);
  AngleSeries head;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (std::abs(whole.azimuth[i]) < 2 * kDegree &&
        std::abs(whole.zenith[i] - kPi / 2) < 2 * kDegree) {
      head.append(whole, i);
    }
  }
  try {
    find_start(head, sensor, {free_parameters(default_free_names({2}), {2}), 1e-3, {}, {}});
    FAIL() << "decided between combinations and mirror images in the noise";
  } catch (const EstimationError& error) {
    EXPECT_NE(std::string(error.what()).find("undecided"), std::string::npos) << error.what();
  }
}

TEST(Initialisation, LinesCarryTheSpeedsOfTheRotors) {
  const auto sensor = sensors::load_sensor("mid-40");
  const auto series = testing::constant_speed_series(sensor, 0.3, 1.0, 0.1, 100000.0);
  const LineSearch search(series);
  const std::vector<double> nearly{sensor.angular_velocity[0] * 1.02,
                                   sensor.angular_velocity[1] * 0.98};
  for (const auto& found :
       {search.near(nearly, 0.06, 3), search.anywhere(2.1 * sensor.angular_velocity[1], 3)}) {
    ASSERT_FALSE(found.empty());
    const auto& lines = found.front().lines;
    ASSERT_EQ(lines.size(), 2u);
    EXPECT_NEAR(lines[0].angular_velocity / sensor.angular_velocity[0], 1.0, 1e-3);
    EXPECT_NEAR(lines[1].angular_velocity / sensor.angular_velocity[1], 1.0, 1e-3);
    // At rotation angle zero the beam leans to -Z.
    const double t = 1e-9 * static_cast<double>(search.time_ns() - series.time_ns[0]);
    const double angles[] = {0.3 + t * sensor.angular_velocity[0],
                             1.0 + t * sensor.angular_velocity[1]};
    EXPECT_NEAR(wrap_to_pi(lines[0].phase + kPi / 2 - angles[0]), 0.0, 0.02);
    EXPECT_NEAR(wrap_to_pi(lines[1].phase + kPi / 2 - angles[1]), 0.0, 0.02);
  }
}

TEST(Initialisation, LinesOfThreeRotorsAndSixEmittersAreToldApart) {
  const std::vector<double> speeds{radians_from_degrees(44112.0), radians_from_degrees(-44112.0),
                                   radians_from_degrees(3714.0)};
  const Complex amplitudes[] = {{0.2, 0.05}, {0.15, -0.1}, {0.0, 0.12}};
  AngleSeries series;
  for (int i = 0; i < 24000; ++i) {
    const double t = i / 240000.0;
    Complex w(0.01, -0.004 + 0.0157 * ((i % 6) - 2.5));
    for (std::size_t k = 0; k < speeds.size(); ++k) {
      w += amplitudes[k] * std::polar(1.0, speeds[k] * t);
    }
    if (w.imag() > 0.05) continue;  // sky
    const Vector3<double> v{std::sqrt(1.0 - std::norm(w)), w.real(), w.imag()};
    const auto angles = angles_from_direction(v);
    series.append(std::llround(1e9 * t), angles.azimuth, angles.zenith,
                  static_cast<std::uint8_t>(i % 6));
  }
  const LineSearch search(series);
  const std::vector<double> nearly{speeds[0] * 1.02, speeds[1] * 0.985, speeds[2] * 1.03};
  const auto found = search.near(nearly, 0.06, 3);
  ASSERT_FALSE(found.empty());
  const RotorLines& best = found.front();
  ASSERT_EQ(best.lines.size(), 3u);
  const double t = 1e-9 * static_cast<double>(search.time_ns());
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    EXPECT_NEAR(best.lines[k].angular_velocity, speeds[k], radians_from_degrees(2.0));
    EXPECT_NEAR(best.lines[k].amplitude, std::abs(amplitudes[k]), 1e-3);
    EXPECT_NEAR(wrap_to_pi(best.lines[k].phase - std::arg(amplitudes[k]) - speeds[k] * t), 0.0,
                1e-2);
  }
  EXPECT_NEAR(best.constant.real(), 0.01, 1e-3);
  EXPECT_LT(best.unexplained, 1e-6);
}

TEST(Initialisation, FiftyMillisecondsWithAGapAreEnough) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  const auto nominal = sensors::load_sensor("mid-40");
  const auto free = free_parameters(default_free_names({2}), {2});
  for (const double rate : {2000.0, 100000.0}) {
    const auto whole = testing::constant_speed_series(sensor, 2.0, -1.0, 0.0505, rate, 0.01, 3);
    AngleSeries holed;
    for (std::size_t i = 0; i < whole.size(); ++i) {
      if (whole.time(i) < 0.018 || whole.time(i) > 0.028) holed.append(whole, i);
    }
    const Start start =
        find_start(holed, nominal, {free, radians_from_degrees(0.01), false, false});
    EXPECT_EQ(start.combination, 2);
    const double t = 1e-9 * static_cast<double>(start.time_ns - whole.time_ns[0]);
    for (std::size_t k = 0; k < 2; ++k) {
      const double truth = (k == 0 ? 2.0 : -1.0) + t * sensor.angular_velocity[k];
      EXPECT_LT(degrees_from_radians(std::abs(wrap_to_pi(start.rotation_angle[k] - truth))), 0.5);
      EXPECT_NEAR(degrees_from_radians(start.angular_velocity[k] - sensor.angular_velocity[k]), 0.0,
                  30.0);
    }
  }
}

TEST(Initialisation, TheBestCoveredWindowIsTaken) {
  // 30 ms of shots, nothing for 0.3 s, then a whole second: the beginning alone could not answer.
  const auto sensor = sensors::load_sensor("mid-40");
  const auto whole = testing::constant_speed_series(sensor, 0.5, 2.5, 1.0, 1000.0, 0.01, 4);
  AngleSeries holed;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (whole.time(i) < 0.03 || whole.time(i) > 0.33) holed.append(whole, i);
  }
  const LineSearch found(holed);
  EXPECT_GT(found.time_ns(), 330'000'000);
  EXPECT_GT(found.shots().size(), 200u);
}

TEST(Initialisation, ATenthOfGrossErrorsDoesNotMatter) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  auto head = testing::constant_speed_series(sensor, 2.0, -1.0, 0.5, 1000.0, 0.01, 5);
  std::mt19937_64 generator(6);
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  for (std::size_t i = 0; i < head.size(); i += 10) {
    head.azimuth[i] = uniform(generator);
    head.zenith[i] = kPi / 2 + uniform(generator);
  }
  const Start start = find_start(
      head, sensors::load_sensor("mid-40"),
      {free_parameters(default_free_names({2}), {2}), radians_from_degrees(0.01), {}, {}});
  EXPECT_FALSE(start.mirrored);
  EXPECT_LT(degrees_from_radians(start.residual_rms), 0.02);
  const double t = 1e-9 * static_cast<double>(start.time_ns - head.time_ns[0]);
  EXPECT_LT(degrees_from_radians(std::abs(
                wrap_to_pi(start.rotation_angle[0] - 2.0 - t * sensor.angular_velocity[0]))),
            0.5);
}

TEST(Initialisation, AClockInAnotherUnitIsNamed) {
  const auto sensor = sensors::load_sensor("mid-40");
  auto head = testing::constant_speed_series(sensor, 0.5, 2.5, 0.5, 10000.0);
  for (auto& time : head.time_ns) time *= 2;
  try {
    find_start(head, sensor, {free_parameters(default_free_names({2}), {2}), 1e-4, false, {}});
    FAIL() << "accepted rotors at half their speed";
  } catch (const EstimationError& error) {
    EXPECT_NE(std::string(error.what()).find("0.5 times as fast"), std::string::npos)
        << error.what();
  }
}

TEST(Initialisation, TooFewShotsASecondToFollowTheRotorsAreRefused) {
  const auto sensor = sensors::load_sensor("mid-40");
  const auto head = testing::constant_speed_series(sensor, 0.5, 2.5, 1.0, 200.0);
  EXPECT_THROW(
      find_start(head, sensor, {free_parameters(default_free_names({2}), {2}), 1e-4, {}, {}}),
      EstimationError);
}

TEST(Initialisation, TrackedPhasesFollowAWanderingRotorOverAGap) {
  const auto sensor = sensors::load_sensor("mid-40");
  // Speeds as wander: a slow sine of 5 deg/s.
  const auto motion = [&](double t, std::size_t k) {
    const double swing = radians_from_degrees(5.0), rate = kTwoPi / 2.0;
    return (k == 0 ? 0.5 : 2.5) + t * sensor.angular_velocity[k] +
           swing / rate * (1.0 - std::cos(rate * t));
  };
  AngleSeries series;
  const auto train =
      prepare<double, 2>(parameter_array<2>(sensor.train), face_order_array<2>(sensor.train));
  for (int i = 0; i < 6000; ++i) {
    if (i > 2500 && i < 3700) continue;
    const double t = 1e-3 * i;
    const auto angles = angles_from_direction(trace(train, {motion(t, 0), motion(t, 1)}).direction);
    series.append(1'000'000LL * i, angles.azimuth, angles.zenith);
  }
  const Start start = find_start(series, sensor, {{}, 1e-4, false, false});
  const ShotRange all{0, series.size()};
  RotorTrajectory knots = make_knots(series, {&all, 1}, 2);
  track_rotors(series, all, start, equal_noise(1e-4), knots, 0, knots.size());
  double squares = 0;
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    for (std::size_t k = 0; k < 2; ++k) {
      const double miss = wrap_to_pi(knots.state_of(knot)[3 * k] -
                                     motion(1e-9 * static_cast<double>(knots.time_ns[knot]), k));
      EXPECT_LT(std::abs(miss), radians_from_degrees(15.0)) << knot;
      squares += miss * miss;
    }
  }
  EXPECT_LT(std::sqrt(squares / (2.0 * static_cast<double>(knots.size()))),
            radians_from_degrees(1.5));
}

TEST(Initialisation, TooLittleDataIsSaidInNumbers) {
  const auto sensor = sensors::load_sensor("mid-40");
  const auto series = testing::constant_speed_series(sensor, 0, 0, 0.019, 10000.0);
  EXPECT_THAT(refusal<EstimationError>([&] { const LineSearch search(series); }),
              ::testing::HasSubstr("0.0190 s"));
}

TEST(Initialisation, SpeedsOfAnotherSensorAreRefused) {
  auto sensor = sensors::load_sensor("mid-40");
  sensor.angular_velocity = {-2 * kPi * 30, 2 * kPi * 200};
  const auto head = testing::constant_speed_series(sensor, 0, 0, 0.2, 10000.0);
  EXPECT_THROW(find_start(head, sensors::load_sensor("mid-40"),
                          {free_parameters(default_free_names({2}), {2}), 1e-4, false, {}}),
               EstimationError);
}

}  // namespace risley::estimation::initialisation_test
