// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/running_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"

#include "parameter_name.hpp"

namespace risley::estimation {
namespace {

using Phase = RunningState::Phase;
constexpr std::size_t kRowsAtOnce = 9600;  // 40 ms of 240 kHz

simulation::SimulationSettings hunting(const std::string& preset, double duration,
                                       std::uint64_t seed = 5) {
  simulation::SimulationSettings settings;
  settings.truth = sensors::load_sensor(preset);
  settings.duration = duration;
  settings.rotor = simulation::RotorKind::hunting;
  settings.seed = seed;
  return settings;
}

RunningOptions watching(const std::string& preset) {
  RunningOptions options;
  options.sensor = sensors::load_sensor(preset);
  return options;
}

/// Shots of a sensor whose optics change while its rotors go on.
class BendingScanner {
 public:
  BendingScanner(const simulation::SimulationSettings& settings, double bend_time,
                 const std::string& parameter, double bend)
      : before_(settings), after_(bent(settings, parameter, bend)), bend_ns_(1e9 * bend_time) {}

  /// @return the next rows, all with a direction; none at the end
  const recordings::Observations& read() {
    recordings::TruthColumns truth;
    if (!before_.read(chunk_, truth, kRowsAtOnce)) chunk_.clear();
    after_.read(other_, truth, kRowsAtOnce);
    recordings::Observations& rows = chunk_.observations;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      rows.valid[i] = 1;
      if (static_cast<double>(rows.time_ns[i]) < bend_ns_) continue;
      rows.azimuth[i] = other_.observations.azimuth[i];
      rows.zenith[i] = other_.observations.zenith[i];
    }
    return rows;
  }

 private:
  static simulation::SimulationSettings bent(simulation::SimulationSettings settings,
                                             const std::string& parameter, double bend) {
    settings.truth.set(parameter, settings.truth.get(parameter) + bend);
    return settings;
  }

  simulation::Scanner before_, after_;
  double bend_ns_;
  recordings::Chunk chunk_, other_;
};

/// Gives a whole scan to an estimate, all shots with a direction.
void follow(const simulation::SimulationSettings& settings, RunningEstimate& running) {
  simulation::Scanner scanner(settings);
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  while (scanner.read(chunk, truth, kRowsAtOnce)) {
    std::fill(chunk.observations.valid.begin(), chunk.observations.valid.end(), 1);
    running.add(chunk.observations);
  }
}

struct Bend {
  const char* preset;
  const char* parameter;
};

class RunningEstimateOf : public ::testing::TestWithParam<Bend> {};

TEST_P(RunningEstimateOf, ABendIsToldOfWithinFiveSeconds) {
  constexpr double kBendTime = 5.3;  // s, within a piece
  const double bend = radians_from_degrees(0.02);
  BendingScanner scanner(hunting(GetParam().preset, kBendTime + 5.0), kBendTime,
                         GetParam().parameter, bend);
  RunningEstimate running(watching(GetParam().preset));
  for (;;) {
    const recordings::Observations& rows = scanner.read();
    if (rows.size() == 0) break;
    running.add(rows);
    if (running.state().alarm) break;
  }
  const RunningState& state = running.state();
  ASSERT_TRUE(state.alarm) << state.reason;
  EXPECT_TRUE(state.alarmed);
  EXPECT_GT(1e-9 * static_cast<double>(state.alarm->time_ns), kBendTime);
  EXPECT_LT(1e-9 * static_cast<double>(state.alarm->time_ns), kBendTime + 5);
  EXPECT_EQ(state.alarm->kind, OpticsAlarmKind::changed);
  EXPECT_LT(state.alarm->p_value, state.alarm_p_value);
  EXPECT_EQ(state.alarm->parameter, GetParam().parameter);
  EXPECT_LT(std::abs(state.alarm->difference - bend), 4.5 * state.alarm->sigma);
  EXPECT_EQ(state.unfit_pieces, 0U);
}

INSTANTIATE_TEST_SUITE_P(Sensors, RunningEstimateOf,
                         ::testing::Values(Bend{"mid-40", "prism_tilt_b_vertical_deg"},
                                           Bend{"mid-40", "prism_tilt_a_vertical_deg"},
                                           Bend{"mid-70", "prism_tilt_b_horizontal_deg"},
                                           Bend{"avia", "prism_tilt_b_vertical_deg"},
                                           Bend{"avia", "bearing_tilt_a_horizontal_deg"},
                                           Bend{"horizon", "prism_tilt_c_horizontal_deg"},
                                           Bend{"horizon", "bearing_tilt_b_vertical_deg"},
                                           Bend{"tele-15", "prism_tilt_b_vertical_deg"},
                                           Bend{"tele-15", "prism_tilt_b_horizontal_deg"}),
                         [](const auto& test) {
                           return parameter_name(test.param.preset) + "_" + test.param.parameter;
                         });

TEST(RunningEstimate, ParametersAndSpeedsAreWithinTheirSigmas) {
  simulation::SimulationSettings settings = hunting("mid-40-table3", 12);
  settings.rate = 20'000;
  RunningEstimate running(watching("mid-40"));
  follow(settings, running);
  const RunningState& state = running.state();
  EXPECT_EQ(state.phase, Phase::watching);
  EXPECT_FALSE(state.alarm);
  ASSERT_EQ(state.parameters.size(), 8U);
  double chi2 = 0;
  for (const RunningParameter& one : state.parameters) {
    const double error = one.value - settings.truth.get(one.name);
    chi2 += error * error / (one.sigma * one.sigma);
    EXPECT_GE(one.sigma, one.sigma_given_held);
    EXPECT_LT(std::abs(one.change), 5 * one.change_sigma) << one.name;
  }
  EXPECT_LT(chi2, 26);  // 8 degrees of freedom: once in a thousand
  ASSERT_EQ(state.speeds.size(), 2U);
  EXPECT_NEAR(state.speeds[0].value, settings.truth.angular_velocity[0],
              radians_from_degrees(20.0));  // they hunt
  EXPECT_NEAR(degrees_from_radians(state.angle_noise),
              degrees_from_radians(settings.truth.angle_noise), 0.001);
}

/// What goes missing on the way: a sky in the upper half, packets, and seconds.
TEST(RunningEstimate, SkyLostPacketsAndPausesRaiseNoAlarm) {
  simulation::Scanner scanner(hunting("mid-40", 30));
  RunningEstimate running(watching("mid-40"));
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  std::size_t packet = 0;
  while (scanner.read(chunk, truth, 100)) {  // packets of the Mid-40
    ++packet;
    const double time = 1e-9 * static_cast<double>(chunk.observations.time_ns.front());
    if (packet % 37 == 0 || (time > 12.2 && time < 13.4) || (time > 20 && time < 20.05)) continue;
    for (std::size_t i = 0; i < chunk.observations.size(); ++i) {
      chunk.observations.valid[i] = chunk.observations.zenith[i] > kPi / 2 ? 1 : 0;
    }
    if (time > 25) {  // the clock began again
      for (auto& ns : chunk.observations.time_ns) ns -= 24'000'000'000;
    }
    running.add(chunk.observations);
  }
  const RunningState& state = running.state();
  EXPECT_EQ(state.phase, Phase::watching);
  EXPECT_FALSE(state.alarm);
  EXPECT_EQ(state.unfit_pieces, 0U) << state.reason;
  EXPECT_GE(state.pieces, 54U);
  EXPECT_LE(state.short_pieces, 2U);
}

/// Directions of coordinates in whole millimetres.
TEST(RunningEstimate, MillimetresRaiseNoAlarmAndHideNoBend) {
  constexpr double kBendTime = 8.1, kRange = 15, kStep = 1e-3;
  BendingScanner scanner(hunting("mid-40", kBendTime + 5), kBendTime, "prism_tilt_b_vertical_deg",
                         radians_from_degrees(0.02));
  RunningOptions options = watching("mid-40");
  options.cartesian = true;
  RunningEstimate running(options);
  for (;;) {
    recordings::Observations rows = scanner.read();
    if (rows.size() == 0 || running.state().alarm) break;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto v = direction_from_angles<double>({rows.azimuth[i], rows.zenith[i]});
      const auto rounded = [&](double x) { return kStep * std::round(kRange * x / kStep); };
      const auto angles =
          angles_from_direction(Vector3<double>{rounded(v.x), rounded(v.y), rounded(v.z)});
      rows.azimuth[i] = angles.azimuth;
      rows.zenith[i] = angles.zenith;
      rows.range[i] = kRange;
      rows.azimuth_resolution[i] = rows.zenith_resolution[i] = static_cast<float>(kStep / kRange);
    }
    running.add(rows);
  }
  ASSERT_TRUE(running.state().alarm);
  EXPECT_GT(1e-9 * static_cast<double>(running.state().alarm->time_ns), kBendTime);
}

TEST(RunningEstimate, AUnitThatIsNotTheSensorIsToldOf) {
  RunningOptions options = watching("mid-40");
  options.is_sensor = true;
  for (const double bend_deg : {0.2, 3.0}) {  // the preset's sigma is 0.3
    simulation::SimulationSettings settings = hunting("mid-40", 6);
    settings.truth.set("prism_tilt_b_vertical_deg", radians_from_degrees(bend_deg));
    RunningEstimate running(options);
    follow(settings, running);
    ASSERT_EQ(running.state().alarm.has_value(), bend_deg > 1) << bend_deg;
    if (!running.state().alarm) continue;
    EXPECT_EQ(running.state().alarm->kind, OpticsAlarmKind::unlike);
    EXPECT_EQ(running.state().alarm->parameter, "prism_tilt_b_vertical_deg");
  }
}

// A piece finds more glass where the wedge that it holds is too small. A calibration that knows
// both together far better than each says so by their correlation.
TEST(RunningEstimate, WhatACalibrationKnowsTogetherCounts) {
  const auto sigma_of_glass = [](double correlation) {
    RunningOptions options = watching("mid-40");
    const double glass = 0.0014, wedge = radians_from_degrees(0.05);
    const double both = correlation * glass * wedge;
    options.sensor.covariance_names = {"refractive_index", "wedge_angle_deg"};
    options.sensor.covariance = Eigen::Matrix2d{{glass * glass, both}, {both, wedge * wedge}};
    simulation::SimulationSettings settings = hunting("mid-40", 1.2);
    settings.rate = 20'000;
    RunningEstimate running(options);
    follow(settings, running);
    const auto& found = running.state().parameters;
    const auto one = std::ranges::find(found, "refractive_index", &RunningParameter::name);
    return one == found.end() ? 0.0 : one->off_sensor_sigma;
  };
  const double opposed = sigma_of_glass(-0.999), alike = sigma_of_glass(0.999);
  EXPECT_GT(opposed, 0);
  EXPECT_LT(opposed, 0.3 * alike);
}

TEST(RunningEstimate, AnotherSensorWaitsAndSaysWhy) {
  RunningEstimate running(watching("mid-40"));
  follow(hunting("avia", 1.2), running);
  EXPECT_EQ(running.state().phase, Phase::waiting);
  EXPECT_GT(running.state().unfit_in_a_row, 0U);
  EXPECT_FALSE(running.state().reason.empty());
}

TEST(RunningEstimate, OptionsOutOfRangeAreRefused) {
  RunningOptions options = watching("mid-40");
  options.piece = 0;
  EXPECT_THROW(RunningEstimate{options}, InvalidArgument);
  options = watching("mid-40");
  options.false_alarms_per_hour = 0;
  EXPECT_THROW(RunningEstimate{options}, InvalidArgument);
  options = watching("mid-40");
  options.beginning = 0;
  EXPECT_THROW(RunningEstimate{options}, InvalidArgument);
}

}  // namespace
}  // namespace risley::estimation
