// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Scan patterns of the presets, against the manufacturer's scan sequences, which only the
// manufacturer may hand out, and against the optics shot by shot.
#include "risley/sensors/scan_pattern.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <ostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/sensors/preset.hpp"

#include "parameter_name.hpp"
#include "refusal.hpp"

namespace risley::sensors::scan_pattern_test {

TEST(SixEmitters, AreARowOfEqualSteps) {
  for (const auto& [name, focal_length_mm] :
       {std::pair{"horizon", 30.0}, {"avia", 30.0}, {"tele-15", 85.0}}) {
    SCOPED_TRACE(name);
    const Sensor sensor = load_sensor(name);
    ASSERT_EQ(sensor.train.emitters(), 6);
    EXPECT_NEAR(sensor.get("incident_beam_1_vertical_deg"),
                std::atan(-2.5 * 0.47 / focal_length_mm), 1e-14);  // as many digits as the file has
    EXPECT_NEAR(sensor.get("incident_beam_5_vertical_deg"), std::atan(1.5 * 0.47 / focal_length_mm),
                1e-14);
  }
  const Sensor horizon = load_sensor("horizon");
  EXPECT_EQ(to_string(horizon.train.face_order()), "AP-PA-AP");
  EXPECT_EQ(horizon.device_type, 3);
  EXPECT_EQ(horizon.angular_velocity[0], -horizon.angular_velocity[1]);
}

/// A scan sequence of the manufacturer and the preset that predicts it.
struct Sequence {
  const char* preset;
  const char* file;
  std::uint64_t every;
  /// Of what is printed, where the file went through single precision, deg; 0: half the last digit.
  double rounding_deg;
};

std::ostream& operator<<(std::ostream& out, const Sequence& sequence) {
  return out << sequence.preset;
}

/// Half of the last digit of a file that prints ten digits, nine of them after the point at most.
double half_digit(double value) {
  const double whole = std::floor(std::log10(std::max(std::abs(value), 1.0)));
  return 0.5 * std::pow(10.0, -std::min(9.0, 9.0 - whole));
}

class MakersSequence : public ::testing::TestWithParam<Sequence> {};

TEST_P(MakersSequence, IsPredictedToThePrintedDigit) {
  const Sequence& sequence = GetParam();
  const char* folder = std::getenv("RISLEY_VENDOR_DATA");
  if (folder == nullptr) GTEST_SKIP() << "RISLEY_VENDOR_DATA names no folder";
  const std::string path = std::string(folder) + "/" + sequence.file;
  std::ifstream file(path);
  if (!file) GTEST_SKIP() << path << " is not there";
  std::vector<double> time, azimuth_deg, zenith_deg;
  std::string line;
  std::getline(file, line);
  ASSERT_EQ(line.substr(0, 4), "Time");
  while (std::getline(file, line)) {
    const char* text = line.c_str();
    char* end = nullptr;
    time.push_back(std::strtod(text, &end));
    azimuth_deg.push_back(std::strtod(end + 1, &end));
    zenith_deg.push_back(std::strtod(end + 1, &end));
  }
  ScanPatternOptions options;
  options.every = sequence.every;
  const ScanPattern own = scan_pattern(load_sensor(sequence.preset), 0, time.size(), options);
  std::size_t equal = 0;
  double squares = 0, worst = 0;
  for (std::size_t i = 0; i < time.size(); ++i) {
    ASSERT_NEAR(own.time[i], time[i], 0.6e-9);
    const double azimuth = degrees_from_radians(own.azimuth[i]) - azimuth_deg[i];
    const double zenith = degrees_from_radians(own.zenith[i]) - zenith_deg[i];
    const bool exact = sequence.rounding_deg == 0;
    const double slack = 1e-3;  // of half a digit: of our own arithmetic
    equal += std::abs(azimuth) <=
                 (1 + slack) * (exact ? half_digit(azimuth_deg[i]) : sequence.rounding_deg) &&
             std::abs(zenith) <=
                 (1 + slack) * (exact ? half_digit(zenith_deg[i]) : sequence.rounding_deg);
    squares += azimuth * azimuth + zenith * zenith;
    worst = std::max({worst, std::abs(azimuth), std::abs(zenith)});
  }
  const double share = static_cast<double>(equal) / static_cast<double>(time.size());
  RecordProperty("rows", std::to_string(time.size()));
  RecordProperty("equal", std::to_string(share));
  EXPECT_GE(share, 0.999);
  EXPECT_LT(worst, sequence.rounding_deg == 0 ? 1e-6 : 2.0 * sequence.rounding_deg);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(time.size())),
            sequence.rounding_deg == 0 ? 2e-8 : sequence.rounding_deg);
}

INSTANTIATE_TEST_SUITE_P(
    Presets, MakersSequence,
    ::testing::Values(Sequence{"mid-40-sequence", "livox-mid-40-sequence.csv", 1, 1.6e-5},
                      Sequence{"avia-sequence", "livox-avia-sequence-every-40th.csv", 40, 0},
                      Sequence{"horizon-sequence", "livox-horizon-sequence-every-40th.csv", 40, 0}),
    [](const auto& sequence) { return parameter_name(sequence.param.preset); });

// The manufacturer prints five digits of azimuth and elevation; the copy at hand keeps two behind
// the point, and which way it rounded a last digit of 5 is unknown.
TEST(MakersSequenceOfTheMid360, IsRepeatedDigitForDigit) {
  const char* folder = std::getenv("RISLEY_VENDOR_DATA");
  if (folder == nullptr) GTEST_SKIP() << "SKIPPED: RISLEY_VENDOR_DATA names no folder";
  const std::string path = std::string(folder) + "/livox-mid-360-sequence-first-second.csv";
  std::ifstream file(path);
  if (!file) GTEST_SKIP() << "SKIPPED: " << path << " is not there";
  std::string line;
  std::getline(file, line);
  const ScanPattern own = scan_pattern(load_sensor("mid-360-sequence"), 0, 200'000);
  const auto five_digits = [](double value) { return std::stod(fmt::format("{:.5g}", value)); };
  const double half_digit = 0.005 + 1e-9;
  std::size_t rows = 0, different = 0;
  for (; std::getline(file, line); ++rows) {
    ASSERT_LT(rows, own.size());
    char* end = nullptr;
    const double row = std::strtod(line.c_str(), &end), azimuth_deg = std::strtod(end + 1, &end);
    const double zenith_deg = std::strtod(end + 1, &end);
    ASSERT_EQ(row, static_cast<double>(rows));
    const double azimuth =
        five_digits(degrees_from_radians(wrap_to_two_pi(own.azimuth[rows]))) - azimuth_deg;
    const double zenith =
        90 - five_digits(90 - degrees_from_radians(own.zenith[rows])) - zenith_deg;
    different += !(std::abs(std::remainder(azimuth, 360.0)) <= half_digit) ||
                 !(std::abs(zenith) <= half_digit);
  }
  EXPECT_EQ(rows, 200'000u);
  EXPECT_EQ(different, 0u);
}

// Real units as the manufacturer's files have them: an Avia the same, a Horizon as its mirror
// image.
TEST(ScanPattern, RealUnitsThatFireTogetherAreTheSequence) {
  ScanPatternOptions together;
  together.firing = Firing::together;
  for (const auto& [type, sign] : {std::pair{"avia", 1.0}, {"horizon", -1.0}}) {
    SCOPED_TRACE(type);
    const ScanPattern unit = scan_pattern(load_sensor(type), 0, 100'000, together);
    const ScanPattern file = scan_pattern(load_sensor(std::string(type) + "-sequence"), 0, 100'000);
    for (std::size_t i = 0; i < unit.size(); ++i) {
      ASSERT_NEAR(unit.azimuth[i], sign * file.azimuth[i], 1e-11) << i;
      ASSERT_NEAR(unit.zenith[i], file.zenith[i], 1e-11) << i;
    }
  }
}

TEST(ScanPattern, IsTheBeamOfEveryShotsTime) {
  for (const char* name : {"mid-70", "avia", "avia-sequence", "tele-15", "horizon"}) {
    SCOPED_TRACE(name);
    const Sensor sensor = load_sensor(name);
    const ScanPattern whole = scan_pattern(sensor, 0, 1000);
    const auto emitters = static_cast<std::size_t>(sensor.train.emitters());
    const auto first = static_cast<std::size_t>(sensor.sequence->first_shot);
    const bool together = sensor.sequence->firing == Firing::together;
    for (const std::size_t shot : {0UL, 1UL, 5UL, 6UL, 7UL, 500UL, 999UL}) {
      const double time = static_cast<double>(first + shot) / sensor.shot_rate;
      const double rotors =
          together ? static_cast<double>((first + shot / emitters) * emitters) / sensor.shot_rate
                   : time;
      std::vector<double> angles;
      for (std::size_t k = 0; k < sensor.angular_velocity.size(); ++k) {
        angles.push_back(sensor.sequence->rotation_angle[k] + sensor.angular_velocity[k] * rotors);
      }
      const Observation beam = observe(sensor.train, angles, static_cast<int>(shot % emitters));
      EXPECT_EQ(whole.time[shot], time);
      EXPECT_EQ(whole.emitter[shot], shot % emitters);
      EXPECT_NEAR(whole.azimuth[shot], beam.azimuth, 1e-13);
      EXPECT_NEAR(whole.zenith[shot], beam.zenith, 1e-13);
    }
    // Pieces and every seventh shot of it.
    const ScanPattern piece = scan_pattern(sensor, 400, 100);
    EXPECT_EQ(piece.azimuth.front(), whole.azimuth[400]);
    ScanPatternOptions seventh;
    seventh.every = 7;
    const ScanPattern thin = scan_pattern(sensor, 10, 3, seventh);
    EXPECT_EQ(thin.time.front(), whole.time[76]);
    EXPECT_EQ(thin.zenith.front(), whole.zenith[76]);
  }
}

TEST(ScanPattern, GivesTheSameDirectionsAsUnitVectorsInBothPrecisions) {
  for (const std::string& name : builtin_preset_names()) {
    SCOPED_TRACE(name);
    const Sensor sensor = load_sensor(name);
    ScanPatternOptions options;
    options.every = 5;
    constexpr std::size_t kRows = 1003;  // neither blocks nor groups of lanes
    const ScanPattern angles = scan_pattern(sensor, 100'000, kRows, options);
    std::vector<double> exact(3 * kRows);
    std::vector<float> single(3 * kRows);
    scan_directions(sensor, 100'000, std::span<double>(exact), options);
    scan_directions(sensor, 100'000, std::span<float>(single), options);
    for (std::size_t i = 0; i < kRows; ++i) {
      const Vector3<double> direction =
          direction_from_angles<double>({angles.azimuth[i], angles.zenith[i]});
      const double expected[] = {direction.x, direction.y, direction.z};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(exact[3 * i + axis], expected[axis], 1e-14);
        EXPECT_NEAR(single[3 * i + axis], expected[axis], 2e-6);
      }
    }
  }
}

TEST(ScanPattern, StaysInTheFieldOfViewAndFillsIt) {
  for (const std::string& name : builtin_preset_names()) {
    const Sensor sensor = load_sensor(name);
    if (!sensor.sequence) continue;
    SCOPED_TRACE(name);
    const ScanPattern pattern = scan_pattern(sensor, 0, 500'000);
    double widest = 0;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      const double cosine = std::sin(pattern.zenith[i]) * std::cos(pattern.azimuth[i]);
      widest = std::max(widest, 2.0 * std::acos(cosine));
    }
    EXPECT_LE(widest, sensor.field_of_view);
    EXPECT_GE(widest, 0.94 * sensor.field_of_view);
  }
}

TEST(ScanPattern, AsksForSensibleNumbers) {
  const Sensor avia = load_sensor("avia");
  const auto refused = [&](const ScanPatternOptions& options) {
    return refusal([&] { return scan_pattern(avia, 0, 10, options); });
  };
  ScanPatternOptions angles, rate, every;
  angles.rotation_angle = {1.0};
  EXPECT_EQ(refused(angles), "rotation_angle has 1 values, expected 2");
  rate.shot_rate = -1;
  EXPECT_EQ(refused(rate), "shot_rate = -1 Hz, allowed 0.001 to 1000000000");
  every.every = 0;
  EXPECT_EQ(refused(every), "every = 0, allowed 1 to 1000000000");
}

TEST(ScanPattern, StartsAtZeroWhereThePresetHasNoSequence) {
  const Sensor unit = load_sensor("mid-40");
  ASSERT_FALSE(unit.sequence);
  ScanPatternOptions zero;
  zero.rotation_angle = {0.0, 0.0};
  const ScanPattern pattern = scan_pattern(unit, 0, 10), expected = scan_pattern(unit, 0, 10, zero);
  EXPECT_EQ(pattern.azimuth, expected.azimuth);
  EXPECT_EQ(pattern.zenith, expected.zenith);
}

}  // namespace risley::sensors::scan_pattern_test
