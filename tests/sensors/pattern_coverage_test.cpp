// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// How a scan fills its field of view: counts that must add up, and gaps against every shot.
#include "risley/sensors/pattern_coverage.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/direction.hpp"
#include "risley/sensors/preset.hpp"

#include "refusal.hpp"

namespace risley::sensors::pattern_coverage_test {

TEST(PatternCoverage, CountsEveryShotOnce) {
  for (const char* name : {"mid-40-sequence", "horizon", "mid-360"}) {
    SCOPED_TRACE(name);
    CoverageOptions options;
    options.cell = radians_from_degrees(1.0);
    options.after = {0.05, 0.1, 0.4};
    options.field_after = 2;
    const Sensor sensor = load_sensor(name);
    const PatternCoverage coverage = pattern_coverage(sensor, {}, options);
    ASSERT_EQ(coverage.after.size(), 3U);
    EXPECT_EQ(coverage.cells(), coverage.azimuth.size());
    EXPECT_NEAR(coverage.field_solid_angle,
                static_cast<double>(coverage.cells()) * std::pow(coverage.cell, 2), 1e-12);
    const CoverageAfter* before = nullptr;
    for (const CoverageAfter& after : coverage.after) {
      EXPECT_EQ(after.shots, static_cast<std::uint64_t>(after.time * sensor.shot_rate + 0.5));
      ASSERT_EQ(after.cell_shots.size(), coverage.cells());
      EXPECT_EQ(std::accumulate(after.cell_shots.begin(), after.cell_shots.end(), std::uint64_t{0}),
                after.shots);
      EXPECT_NEAR(after.mean_density * coverage.field_solid_angle, static_cast<double>(after.shots),
                  1e-6);
      const auto reached =
          std::count_if(coverage.first_shot.begin(), coverage.first_shot.end(),
                        [&](double time) { return time <= after.time * (1 + 1e-12); });
      EXPECT_NEAR(after.covered,
                  static_cast<double>(reached) / static_cast<double>(coverage.cells()), 1e-12);
      const double when = coverage.time_to_cover(after.covered);
      EXPECT_LE(when, after.time * (1 + 1e-12));
      EXPECT_GT(when, 0.5 * after.time);
      const auto empty = std::count(after.cell_shots.begin(), after.cell_shots.end(), 0U);
      EXPECT_NEAR(after.covered,
                  1 - static_cast<double>(empty) / static_cast<double>(coverage.cells()), 1e-12);
      if (before != nullptr) {
        EXPECT_GT(after.covered, before->covered);
        EXPECT_LE(after.gap, before->gap);
      }
      before = &after;
    }
    EXPECT_EQ(coverage.time_to_cover(0), 0);
    EXPECT_LT(coverage.time_to_cover(0.3), coverage.time_to_cover(0.6));
    EXPECT_EQ(refusal([&] { coverage.time_to_cover(2); }), "share = 2, allowed 0 to 1");
  }
}

TEST(PatternCoverage, TheFieldOfAMid40IsItsCone) {
  CoverageOptions options;
  options.after = {0.1};
  const PatternCoverage coverage = pattern_coverage(load_sensor("mid-40-sequence"), {}, options);
  EXPECT_EQ(coverage.field_after, 30.0);
  EXPECT_NEAR(degrees_from_radians(coverage.field_half_angle), 19.17, 0.01);
  const double cone = kTwoPi * (1 - std::cos(coverage.field_half_angle));
  EXPECT_GT(coverage.field_solid_angle, cone);
  EXPECT_LT(coverage.field_solid_angle, 1.05 * cone);  // cells on the edge count whole
}

// The band of the elevations that its optics reach, all around, in cells of equal solid angle.
TEST(PatternCoverage, TheFieldOfAMid360IsABandAllAround) {
  CoverageOptions options;
  options.after = {0.1, 1.0};
  const PatternCoverage coverage = pattern_coverage(load_sensor("mid-360"), {}, options);
  EXPECT_TRUE(coverage.all_around);
  EXPECT_NEAR(degrees_from_radians(coverage.field_half_angle), 90 + 7.21, 0.01);
  EXPECT_NEAR(degrees_from_radians(coverage.field_inner_angle), 90 - 52.16, 0.01);
  const double band =
      kTwoPi * (std::cos(coverage.field_inner_angle) - std::cos(coverage.field_half_angle));
  // The row of emitters reaches less far to its sides.
  EXPECT_GT(coverage.field_solid_angle, 0.94 * band);
  EXPECT_LT(coverage.field_solid_angle, band);
  const auto [least, most] = std::minmax_element(coverage.azimuth.begin(), coverage.azimuth.end());
  EXPECT_NEAR(*most - *least, kTwoPi, 2 * coverage.cell);
  EXPECT_GT(coverage.after[1].covered, 0.9);
}

/// No circle in the field of view is empty and larger, and the one that is named is empty.
TEST(PatternCoverage, TheGapIsTheLargestEmptyCircle) {
  for (const auto& [name, time] :
       {std::pair{"tele-15", 0.02}, {"avia", 0.1}, {"mid-70", 0.3}, {"mid-360", 0.1}}) {
    SCOPED_TRACE(name);
    const Sensor sensor = load_sensor(name);
    CoverageOptions options;
    options.after = {time};
    options.field_after = 5;
    const PatternCoverage coverage = pattern_coverage(sensor, {}, options);
    const CoverageAfter& after = coverage.after.front();
    const ScanPattern pattern = scan_pattern(sensor, 0, after.shots);
    std::vector<Vector3<double>> shots;
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      shots.push_back(
          direction_from_angles(SphericalAngles<double>{pattern.azimuth[i], pattern.zenith[i]}));
    }
    const auto radius = [&](double azimuth, double zenith) {
      const auto centre = direction_from_angles(SphericalAngles<double>{azimuth, zenith});
      double most = -1;
      const Vector3<double>* nearest = nullptr;
      for (const auto& shot : shots) {
        const double cosine = dot(shot, centre);
        if (cosine > most) most = cosine, nearest = &shot;
      }
      return angle_between(*nearest, centre);
    };
    EXPECT_NEAR(radius(after.gap_azimuth, after.gap_zenith), 0.5 * after.gap, 1e-9);
    // Directions that the scan reaches later.
    const ScanPattern later = scan_pattern(sensor, 100'000, 300);
    double widest = 0;
    for (std::size_t i = 0; i < later.size(); ++i) {
      widest = std::max(widest, radius(later.azimuth[i], later.zenith[i]));
    }
    EXPECT_LE(widest, 0.5 * after.gap + 0.5 * coverage.cell);
  }
}

// A scan that has closed has no gap: circles about places that it never reaches do not count.
TEST(PatternCoverage, ASingleRingHasNoGapInTheEnd) {
  Sensor sensor = load_sensor("mid-40-sequence");
  sensor.angular_velocity = {kTwoPi * 100, 0};
  CoverageOptions options;
  options.after = {0.0025, 0.01};  // a quarter of a turn, and a whole one
  options.field_after = 1;
  const PatternCoverage coverage = pattern_coverage(sensor, {}, options);
  const double ring = coverage.field_half_angle;
  EXPECT_NEAR(coverage.after[0].covered, 0.25, 0.05);
  EXPECT_GT(coverage.after[0].gap, 0.5 * ring);
  EXPECT_GT(coverage.after[1].covered, 0.98);  // but for shots on the edge of a cell
  EXPECT_LT(coverage.after[1].gap, 1e-9);      // every later turn is the same
}

// A prism that stands still sends every shot to one place: one cell, all of it covered.
TEST(PatternCoverage, OneDirectionIsOneCell) {
  Sensor sensor = load_sensor("mid-40-sequence");
  sensor.angular_velocity = {0, 0};
  CoverageOptions options;
  options.after = {0.01};
  options.field_after = 1;
  const PatternCoverage coverage = pattern_coverage(sensor, {}, options);
  EXPECT_EQ(coverage.cells(), 1U);
  EXPECT_EQ(coverage.after.front().covered, 1.0);
  EXPECT_EQ(coverage.after.front().gap, 0.0);
  EXPECT_NEAR(coverage.time_to_cover(1), 1 / sensor.shot_rate, 1e-15);
}

TEST(PatternCoverage, RefusesWhatIsNoTime) {
  const Sensor sensor = load_sensor("avia");
  const auto refused = [&](const std::vector<double>& after, double cell_deg) {
    return refusal([&] { pattern_coverage(sensor, {}, {after, radians_from_degrees(cell_deg)}); });
  };
  EXPECT_EQ(refused({}, 1), "integration times = 0, allowed 1 or more");
  EXPECT_EQ(refused({0.2, 0.1}, 1), "integration time = 0.1 s, allowed above 0.2");
  EXPECT_EQ(refused({100}, 1), "integration time = 100 s, allowed 0 to 41.666666666666664");
  EXPECT_EQ(refused({0.1}, 0.001), "cell = 0.001 deg, allowed 0.1 to 30");
}

}  // namespace risley::sensors::pattern_coverage_test
