// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What the entries of the layer refuse, and that they say what would be right.
#include <cstdint>
#include <limits>
#include <vector>

#include <gmock/gmock.h>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/noise.hpp"
#include "risley/simulation/scanner.hpp"

#include "refusal.hpp"

namespace risley::simulation::entries_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(Entries, NoiseAsksForSigmasAndSteps) {
  const auto run = [](const NoiseSettings& settings) {
    return refusal([&] { return ObservationNoise(settings, 0); });
  };
  EXPECT_EQ(run({radians_from_degrees(-1), 0, 0, 0}), "angle noise = -1 deg, allowed 0 and above");
  EXPECT_EQ(run({0, kNan, 0, 0}), "range noise = nan m, allowed 0 and above");
  EXPECT_EQ(run({0, 0, kInfinite, 0}), "angle resolution = inf deg, allowed 0 and above");
  EXPECT_EQ(run({0, 0, 0, -1}), "range resolution = -1 m, allowed 0 and above");
}

TEST(Entries, NoiseAsksForColumnsOfOneLength) {
  const ObservationNoise noise({1e-4, 0, 0, 0}, 1);
  std::vector<double> azimuth(4), zenith(3);
  EXPECT_EQ(refusal([&] { noise.apply_to_angles(0, azimuth, zenith); }),
            "zenith has 3 values, expected 4");
}

TEST(Entries, RotorSettingsAskForPrisms) {
  EXPECT_EQ(refusal([] { return rotor_settings(RotorKind::hunting, 0); }),
            "number of prisms = 0, allowed 1 to 4");
  EXPECT_EQ(refusal([] { return rotor_settings(RotorKind::hunting, 5); }),
            "number of prisms = 5, allowed 1 to 4");
}

TEST(Entries, RotorsAskForAPrismAndSettings) {
  const RotorSettings good = rotor_settings(RotorKind::sinusoidal, 2);
  const auto run = [&](int prism, double angle, double speed, std::int64_t last_time_ns,
                       const RotorSettings& settings) {
    return refusal([&] { return RotorMotion(settings, prism, angle, speed, last_time_ns, 0); });
  };
  EXPECT_EQ(run(0, 0, 1, 0, good), "");
  EXPECT_EQ(run(-1, 0, 1, 0, good), "prism = -1, allowed 0 to 3");
  EXPECT_EQ(run(4, 0, 1, 0, {}), "prism = 4, allowed 0 to 3");
  EXPECT_EQ(run(2, 0, 1, 0, good), "values of oscillation_period = 2, allowed 3 or more");
  EXPECT_EQ(run(0, kNan, 1, 0, good), "start_angle = nan rad, allowed finite");
  EXPECT_EQ(run(0, 0, kInfinite, 0, good), "angular_velocity = inf rad/s, allowed finite");
  EXPECT_EQ(run(0, 0, 1, -1, good), "last_time_ns = -1, allowed 0 or more");
  RotorSettings settings = good;
  settings.oscillation_period[1] = kInfinite;
  EXPECT_EQ(run(1, 0, 1, 0, settings), "oscillation_period[1] = inf s, allowed above 0");
  settings.oscillation_speed_std = kNan;
  EXPECT_EQ(run(1, 0, 1, 0, settings), "oscillation_speed_std = nan rad/s, allowed 0 and above");
  settings = good;
  settings.acceleration_noise = -1;
  EXPECT_EQ(run(1, 0, 1, 0, settings),
            "acceleration_noise = -1 rad/s/sqrt(s), allowed 0 and above");
}

TEST(Entries, MotionsAskForAscendingTimesAndColumnsOfTheirLength) {
  const RotorMotion motion({}, 0, 0, 1, 1000, 0);
  std::vector<double> two(2), three(3);
  using Times = std::vector<std::int64_t>;
  EXPECT_EQ(refusal([&] {
              motion.evaluate(Times{0, 1}, three, two);
            }),
            "angle has 3 values, expected 2");
  EXPECT_EQ(refusal([&] {
              motion.evaluate(Times{0, 1}, two, three);
            }),
            "speed has 3 values, expected 2");
  EXPECT_EQ(refusal([&] {
              motion.evaluate(Times{2, 1}, two, two);
            }),
            "time_ns[1] = 1 ns, allowed ascending from 0 to 1000");
  EXPECT_EQ(refusal([&] {
              motion.evaluate(Times{0, 1001}, two, two);
            }),
            "time_ns[1] = 1001 ns, allowed ascending from 0 to 1000");
}

TEST(Entries, ScannersAskForSettingsThatMakeARecording) {
  const auto run = [](auto&& change) {
    SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40");
    settings.duration = 1e-3;
    change(settings);
    return refusal([&] { return Scanner(settings); });
  };
  using Settings = SimulationSettings;
  EXPECT_EQ(run([](Settings&) {}), "");
  EXPECT_EQ(run([](Settings& s) { s.duration = kNan; }),
            "duration = nan s, allowed 1e-09 to 10000000");
  EXPECT_EQ(run([](Settings& s) { s.rate = 0.0; }), "rate = 0 Hz, allowed 0.001 to 1000000000");
  EXPECT_EQ(run([](Settings& s) { s.rate = -5.0; }), "rate = -5 Hz, allowed 0.001 to 1000000000");
  EXPECT_EQ(run([](Settings& s) { s.rate = 1.0; }),
            "duration times rate = 0.001 shots, allowed 0.5 to 1000000000000");
  EXPECT_EQ(run([](Settings& s) { s.threads = -1; }), "threads = -1, allowed 0 to 4096");
  EXPECT_EQ(run([](Settings& s) { s.angle_noise = kNan; }),
            "angle noise = nan deg, allowed 0 and above");
  EXPECT_EQ(run([](Settings& s) { s.start_angles = {0.0}; }),
            "start_angles has 1 values, expected 2");
  EXPECT_EQ(run([](Settings& s) {
              s.start_angles = {0.0, kNan};
            }),
            "start_angle = nan rad, allowed finite");
  EXPECT_EQ(run([](Settings& s) { s.station = "roof"; }), "station \"roof\" needs a scene");
  EXPECT_EQ(run([](Settings& s) {
              s.reported = s.truth;
              s.reported->train = PrismTrain(parse_face_order("PA-AP-AP"));
            }),
            "the reported sensor has 3 prisms and 1 emitters, the true one 2 and 1");
  EXPECT_EQ(run([](Settings& s) { s.scene.emplace(); }),
            "surfaces of the scene = 0, allowed 1 or more");
}

TEST(Entries, ScannersAskForASensorThatFits) {
  const auto run = [](auto&& change) {
    SimulationSettings settings;
    settings.truth = sensors::load_sensor("mid-40");
    settings.duration = 1e-3;
    change(settings.truth);
    return refusal([&] { return Scanner(settings); });
  };
  using sensors::Sensor;
  EXPECT_EQ(run([](Sensor& s) { s.train = {}; }), "number of prisms = 0, allowed 1 to 4");
  EXPECT_EQ(run([](Sensor& s) { s.angular_velocity.pop_back(); }),
            "angular_velocity of the sensor has 1 values, expected 2");
  EXPECT_EQ(run([](Sensor& s) { s.angular_velocity[1] = kNan; }),
            "angular_velocity = nan rad/s, allowed finite");
  EXPECT_EQ(run([](Sensor& s) { s.device_type = 256; }), "device_type = 256, allowed 0 to 255");
  EXPECT_EQ(run([](Sensor& s) { s.geometry.thickness = {kNan}; }),
            "thickness = nan m, allowed finite");
  EXPECT_EQ(run([](Sensor& s) { s.range_minimum = -1; }),
            "range_minimum = -1 m, allowed 0 and above");
  EXPECT_EQ(run([](Sensor& s) { s.range_maximum = kNan; }),
            "range_maximum = nan m, allowed 0 and above");
  EXPECT_EQ(run([](Sensor& s) { s.range_offset = kNan; }), "range_offset = nan m, allowed finite");
  EXPECT_EQ(run([](Sensor& s) { s.range_errors.incidence = kNan; }),
            "range_incidence = nan 1, allowed finite");
  EXPECT_EQ(run([](Sensor& s) {
              s.range_errors.emitter = {0.0, 0.0};
            }),
            "emitter of range_errors has 2 values, expected 1 or none");
  EXPECT_EQ(run([](Sensor& s) { s.beam_divergence_vertical = -1; }),
            "beam_divergence_vertical = -1 rad, allowed 0 and above");
}

TEST(Entries, ScannersAskForRowsToRead) {
  SimulationSettings settings;
  settings.truth = sensors::load_sensor("mid-40");
  settings.duration = 1e-3;
  Scanner scanner(settings);
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  EXPECT_EQ(refusal([&] { return scanner.read(chunk, truth, 0); }),
            "max_rows = 0, allowed 1 or more");
  EXPECT_EQ(scanner.shots_done(), 0U);
}

}  // namespace risley::simulation::entries_test
