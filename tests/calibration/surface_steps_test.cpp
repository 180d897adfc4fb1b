// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/surface_steps.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/optics/batch.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::calibration::surface_steps_test {

constexpr double kNoise = 0.02;
constexpr double kHalfField = 19.2 * kRadiansPerDegree;

/// Residuals of a wall across the beam at X = 10 m. Shots are those of a Mid-40, evenly spread over
/// so many.
struct Surface {
  std::vector<double> azimuth, zenith, distance, sigma;
  std::vector<bool> in_step;

  explicit Surface(std::size_t shots, std::uint64_t seed = 1)
      : azimuth(shots), zenith(shots), distance(shots), sigma(shots, kNoise), in_step(shots) {
    const sensors::Sensor sensor = sensors::load_sensor("mid-40");
    std::vector<std::vector<double>> angles(2, std::vector<double>(shots));
    for (std::size_t i = 0; i < shots; ++i) {
      for (std::size_t rotor : {0, 1}) {
        const double time = 1e-3 * static_cast<double>(i) + 0.01 * static_cast<double>(seed);
        angles[rotor][i] = wrap_to_pi(time * sensor.angular_velocity[rotor]);
      }
    }
    const std::vector<std::span<const double>> columns(angles.begin(), angles.end());
    DirectionColumns out;
    out.azimuth = azimuth;
    out.zenith = zenith;
    observe_batch(sensor.train, columns, out);
    RandomStream(seed, 1).fill_normal(0, distance);
    for (double& value : distance) value *= kNoise;
  }

  SurfaceReport inspect() const { return inspect_surface({azimuth, zenith, distance, sigma}); }

  /// Where the beam meets the wall, in half widths of the field of view.
  double left(std::size_t i) const { return azimuth[i] / kHalfField; }
  double up(std::size_t i) const { return (0.5 * kPi - zenith[i]) / kHalfField; }

  /// Moves a rectangle, in half widths of the field of view. @return the part of the points in it
  double add_step(double height, double left_from, double left_to, double up_from, double up_to) {
    double inside = 0;
    for (std::size_t i = 0; i < distance.size(); ++i) {
      if (left(i) < left_from || left(i) > left_to || up(i) < up_from || up(i) > up_to) continue;
      distance[i] += height;
      in_step[i] = true;
      inside += 1.0;
    }
    return inside / static_cast<double>(distance.size());
  }
  /// Adds what calibration parameters leave behind: a tilt and a bend of so many metres.
  void add_bend(double size) {
    for (std::size_t i = 0; i < distance.size(); ++i) {
      const double x = left(i), y = up(i);
      distance[i] += size * (0.3 + 0.8 * x - 0.5 * y + x * x - 0.7 * x * y - 0.4 * y * y);
    }
  }
};

/// A square of a twentieth of the field of view: its side in half widths.
const double kSide = std::sqrt(0.05 * kPi);

TEST(SurfaceSteps, NoiseAloneIsEvenAndHasNoStep) {
  for (const std::size_t shots : {10000u, 60000u, 1000000u}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const SurfaceReport report = Surface(shots, seed).inspect();
      EXPECT_TRUE(report.steps.empty()) << shots << " shots, seed " << seed;
      EXPECT_NEAR(report.unevenness, 1.0, 0.15);
      EXPECT_GT(report.cells, 700u);
    }
  }
}

/// A step, where it is in half widths of the field of view, and what the wall is like besides.
struct StepCase {
  std::size_t shots;
  double height, left, up, bend;
};

class SurfaceStepSizes : public ::testing::TestWithParam<StepCase> {};

TEST_P(SurfaceStepSizes, AStepIsFoundWithItsHeightAndPlace) {
  const StepCase& c = GetParam();
  Surface surface(c.shots);
  surface.add_step(c.height, c.left - 0.5 * kSide, c.left + 0.5 * kSide, c.up - 0.5 * kSide,
                   c.up + 0.5 * kSide);
  surface.add_bend(c.bend);
  const SurfaceReport report = surface.inspect();
  ASSERT_EQ(report.steps.size(), 1u);
  const StepRegion& step = report.steps[0];
  EXPECT_NEAR(step.height, c.height, 0.2 * std::abs(c.height));
  EXPECT_NEAR(step.azimuth, c.left * kHalfField, 0.06 * kHalfField);
  EXPECT_NEAR(0.5 * kPi - step.zenith, c.up * kHalfField, 0.06 * kHalfField);
  EXPECT_NEAR(step.solid_angle, 0.05 * kPi * kHalfField * kHalfField, 0.0035);
  EXPECT_GT(step.significance, 20.0);
  EXPECT_EQ(step.points, step.rows.size());
  EXPECT_TRUE(std::ranges::is_sorted(step.rows));
  double hits = 0;
  for (std::size_t row : step.rows) hits += surface.in_step[row];
  const auto all = std::ranges::count(surface.in_step, true);
  const bool high = std::abs(c.height) > 4 * kNoise;
  EXPECT_GT(hits / static_cast<double>(step.rows.size()), high ? 0.9 : 0.65);
  EXPECT_GT(hits / static_cast<double>(all), 0.9);
  if (c.bend == 0) {
    EXPECT_NEAR(report.unevenness, 1.0, 0.2);
  } else {
    EXPECT_GT(report.unevenness, 1.2);
  }
  RecordProperty("height_m", std::to_string(step.height));
}

INSTANTIATE_TEST_SUITE_P(
    Sizes, SurfaceStepSizes,
    ::testing::Values(
        // A million shots.
        StepCase{1000000, 0.1, 0.1, 0.05, 0.0}, StepCase{1000000, 0.1, -0.5, 0.4, 0.005},
        StepCase{1000000, 0.05, 0.6, 0.0, 0.005}, StepCase{1000000, -0.05, 0.0, -0.65, 0.0},
        StepCase{1000000, 0.02, 0.1, 0.05, 0.005}, StepCase{1000000, 0.02, -0.5, 0.4, 0.0},
        StepCase{1000000, -0.02, 0.6, 0.0, 0.005},
        // Ten seconds at 1 kHz.
        StepCase{10000, 0.1, 0.1, 0.05, 0.0}, StepCase{10000, 0.1, -0.5, 0.4, 0.005},
        StepCase{10000, -0.1, 0.6, 0.0, 0.0}, StepCase{10000, 0.1, 0.0, -0.65, 0.005}));

TEST(SurfaceSteps, TwoStepsAreTold) {
  Surface surface(100000);
  surface.add_step(0.06, -0.7, -0.2, -0.3, 0.3);
  surface.add_step(-0.04, 0.3, 0.6, 0.1, 0.5);
  const SurfaceReport report = surface.inspect();
  ASSERT_EQ(report.steps.size(), 2u);
  EXPECT_NEAR(report.steps[0].height, 0.06, 0.006);
  EXPECT_NEAR(report.steps[1].height, -0.04, 0.004);
  EXPECT_GT(report.steps[0].solid_angle, report.steps[1].solid_angle);
}

TEST(SurfaceSteps, ALargeStepDoesNotBendTheSmoothSurface) {
  Surface surface(100000);
  surface.add_step(0.05, -1.0, -0.62, -1.0, 1.0);  // a seventh of the field, at its border
  const SurfaceReport report = surface.inspect();
  ASSERT_EQ(report.steps.size(), 1u);
  EXPECT_NEAR(report.steps[0].height, 0.05, 0.005);
  EXPECT_NEAR(report.unevenness, 1.0, 0.15);
}

TEST(SurfaceSteps, StepsTooLowToMatterAreNone) {
  Surface surface(1000000);
  surface.add_step(0.003, -0.2, 0.2, -0.2, 0.2);
  EXPECT_TRUE(surface.inspect().steps.empty());
}

TEST(SurfaceSteps, ABendIsNoStep) {
  Surface surface(1000000);
  surface.add_bend(0.02);
  const SurfaceReport report = surface.inspect();
  EXPECT_TRUE(report.steps.empty());
  EXPECT_GT(report.unevenness, 10.0);
}

TEST(SurfaceSteps, WavesAreUnevenAndNoSteps) {
  for (const double amplitude : {0.002, 0.015}) {
    Surface surface(1000000);
    for (std::size_t i = 0; i < surface.distance.size(); ++i) {
      surface.distance[i] += amplitude * std::sin(kTwoPi * 10.0 * std::tan(surface.azimuth[i]) / 2);
    }
    const SurfaceReport report = surface.inspect();
    EXPECT_TRUE(report.steps.empty());
    EXPECT_GT(report.unevenness, 2.0);
  }
}

TEST(SurfaceSteps, NoiseOfEveryPointCountsByItself) {
  Surface surface(100000);
  for (std::size_t i = 0; i < surface.distance.size(); ++i) {
    const double factor = i % 3 == 0 ? 10.0 : 0.5 + surface.up(i) * surface.up(i);
    surface.distance[i] *= factor;
    surface.sigma[i] *= factor;
  }
  const SurfaceReport report = surface.inspect();
  EXPECT_TRUE(report.steps.empty());
  EXPECT_NEAR(report.unevenness, 1.0, 0.15);
}

TEST(SurfaceSteps, LeavesOutRowsThatAreNoNumbers) {
  Surface surface(30000);
  surface.add_step(0.1, -0.2, 0.2, -0.2, 0.2);
  const SurfaceReport before = surface.inspect();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Surface spoilt = surface;
  for (auto* column : {&spoilt.azimuth, &spoilt.zenith, &spoilt.distance, &spoilt.sigma}) {
    column->insert(column->begin() + 1, nan);
  }
  const SurfaceReport report = spoilt.inspect();
  EXPECT_EQ(report.unevenness, before.unevenness);
  ASSERT_EQ(report.steps.size(), 1u);
  ASSERT_EQ(before.steps.size(), 1u);
  ASSERT_EQ(report.steps[0].points, before.steps[0].points);
  for (std::size_t k = 0; k < before.steps[0].points; ++k) {
    const std::size_t row = before.steps[0].rows[k];
    EXPECT_EQ(report.steps[0].rows[k], row < 1 ? row : row + 1);
  }
}

TEST(SurfaceSteps, AFieldOfViewAcrossTheBackIsNotTornApart) {
  Surface surface(100000);
  surface.add_step(0.1, -0.2, 0.2, -0.2, 0.2);
  const SurfaceReport before = surface.inspect();
  for (double& azimuth : surface.azimuth) azimuth = wrap_to_pi(azimuth + kPi);
  const SurfaceReport report = surface.inspect();
  EXPECT_EQ(report.cells, before.cells);
  ASSERT_EQ(report.steps.size(), 1u);
  EXPECT_NEAR(std::abs(report.steps[0].azimuth), kPi, 0.01);
}

TEST(SurfaceSteps, FewPointsTellNothing) {
  EXPECT_EQ(inspect_surface({}).cells, 0u);
  EXPECT_EQ(inspect_surface({}).unevenness, 1.0);
  for (const std::size_t shots : {1u, 4u, 50u, 300u}) {
    const SurfaceReport report = Surface(shots).inspect();
    EXPECT_TRUE(report.steps.empty());
    EXPECT_TRUE(std::isfinite(report.unevenness));
  }
  // A strip of cells fixes no surface of both variables.
  Surface strip(20000);
  for (double& zenith : strip.zenith) zenith = 0.5 * kPi;
  const SurfaceReport report = strip.inspect();
  EXPECT_TRUE(report.steps.empty());
  EXPECT_NEAR(report.unevenness, 1.0, 0.8);
}

TEST(SurfaceSteps, RefusesColumnsOfDifferentLength) {
  const std::vector<double> two{1.0, 1.0}, three{1.0, 1.0, 1.0};
  EXPECT_THROW(inspect_surface({two, two, two, three}), InvalidArgument);
  EXPECT_THROW(inspect_surface({two, three, two, two}), InvalidArgument);
}

}  // namespace risley::calibration::surface_steps_test
