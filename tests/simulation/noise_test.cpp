// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/noise.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"

#include "refusal.hpp"

namespace risley::simulation::noise_test {

constexpr std::size_t kMany = 100000;

double standard_deviation(const std::vector<double>& values, double around) {
  double square = 0;
  for (const double v : values) {
    square += (v - around) * (v - around) / static_cast<double>(values.size());
  }
  return std::sqrt(square);
}

TEST(ObservationNoise, HasTheStandardDeviationsAskedFor) {
  const double sigma = radians_from_degrees(0.01);
  const ObservationNoise noise({sigma, 0.02, 0, 0}, 1);
  std::vector<double> azimuth(kMany, 0.3), zenith(kMany, 1.5), range(kMany, 30.0);
  noise.apply_to_angles(0, azimuth, zenith);
  noise.apply_to_ranges(0, range);
  const double four_sigma = 4.0 / std::sqrt(2.0 * kMany);
  EXPECT_NEAR(standard_deviation(azimuth, 0.3) / sigma, 1.0, four_sigma);
  EXPECT_NEAR(standard_deviation(zenith, 1.5) / sigma, 1.0, four_sigma);
  EXPECT_NEAR(standard_deviation(range, 30.0) / 0.02, 1.0, four_sigma);
  double product = 0;
  for (std::size_t i = 0; i < kMany; ++i) product += (azimuth[i] - 0.3) * (zenith[i] - 1.5);
  EXPECT_LT(std::abs(product) / (kMany * sigma * sigma), 4.0 / std::sqrt(1.0 * kMany));
}

TEST(ObservationNoise, RoundsToTheGridOfTheSensor) {
  const double step = radians_from_degrees(0.01);
  const ObservationNoise noise({radians_from_degrees(0.004), 0.02, step, 0.001}, 3);
  std::vector<double> azimuth(1000), zenith(1000), range(1000);
  for (std::size_t i = 0; i < azimuth.size(); ++i) {
    azimuth[i] = -0.3 + 0.0006 * static_cast<double>(i);
    zenith[i] = 1.3 + 0.0005 * static_cast<double>(i);
    range[i] = 1.0 + 0.1 * static_cast<double>(i);
  }
  noise.apply_to_angles(0, azimuth, zenith);
  noise.apply_to_ranges(0, range);
  for (std::size_t i = 0; i < azimuth.size(); ++i) {
    EXPECT_NEAR(azimuth[i] / step, std::round(azimuth[i] / step), 1e-9);
    EXPECT_NEAR(zenith[i] / step, std::round(zenith[i] / step), 1e-9);
    EXPECT_NEAR(range[i] / 0.001, std::round(range[i] / 0.001), 1e-9);
  }
}

TEST(ObservationNoise, RoundingGoesToTheNearestStep) {
  const ObservationNoise noise({0, 0, 0.01, 0.001}, 0);
  std::vector<double> azimuth{0.0149, 0.0151, -0.0149}, zenith{1.0, 1.0049, 1.0051};
  std::vector<double> range{5.0004, 5.0006, 0.0004};
  noise.apply_to_angles(0, azimuth, zenith);
  noise.apply_to_ranges(0, range);
  const std::vector<double> azimuth_out{0.01, 0.02, -0.01}, zenith_out{1.0, 1.0, 1.01};
  const std::vector<double> range_out{5.0, 5.001, 0.0};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(azimuth[i], azimuth_out[i], 1e-15);
    EXPECT_NEAR(zenith[i], zenith_out[i], 1e-15);
    EXPECT_NEAR(range[i], range_out[i], 1e-15);
  }
}

TEST(ObservationNoise, AnglesStayInTheirRangeAndKeepTheirDirection) {
  const ObservationNoise noise({0.2, 0, 0, 0}, 7);
  std::vector<double> azimuth(2000), zenith(2000);
  for (std::size_t i = 0; i < azimuth.size(); ++i) {
    azimuth[i] = i % 2 == 0 ? kPi : -3.1;
    zenith[i] = i % 4 < 2 ? 0.05 : kPi - 0.05;
  }
  const std::vector<double> azimuth_before = azimuth, zenith_before = zenith;
  noise.apply_to_angles(0, azimuth, zenith);
  std::vector<double> added_azimuth(2000, 0.0), added_zenith(2000, 1.5);
  noise.apply_to_angles(0, added_azimuth, added_zenith);
  for (std::size_t i = 0; i < azimuth.size(); ++i) {
    EXPECT_GT(azimuth[i], -kPi);
    EXPECT_LE(azimuth[i], kPi);
    EXPECT_GE(zenith[i], 0.0);
    EXPECT_LE(zenith[i], kPi);
    const Vector3<double> expected = direction_from_angles<double>(
        {azimuth_before[i] + added_azimuth[i], zenith_before[i] + added_zenith[i] - 1.5});
    const Vector3<double> found = direction_from_angles<double>({azimuth[i], zenith[i]});
    EXPECT_LT(norm(expected - found), 1e-14);
  }
}

TEST(ObservationNoise, MissingValuesStayMissing) {
  const ObservationNoise noise({0.1, 0.02, 0.001, 0.001}, 7);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> azimuth{nan}, zenith{nan}, range{nan};
  noise.apply_to_angles(0, azimuth, zenith);
  noise.apply_to_ranges(0, range);
  EXPECT_TRUE(std::isnan(azimuth[0]) && std::isnan(zenith[0]) && std::isnan(range[0]));
  std::vector<double> no_return(100, 0.0);
  noise.apply_to_ranges(0, no_return);
  EXPECT_EQ(no_return, std::vector<double>(100, 0.0));
}

TEST(ObservationNoise, DependsOnTheNumberOfTheShotAlone) {
  const ObservationNoise noise({0.01, 0.02, 0, 0}, 5);
  std::vector<double> a1(100, 0.0), z1(100, 1.0), r1(100, 9.0), a2(60, 0.0), z2(60, 1.0),
      r2(60, 9.0);
  noise.apply_to_angles(0, a1, z1);
  noise.apply_to_ranges(0, r1);
  noise.apply_to_angles(40, a2, z2);
  noise.apply_to_ranges(40, r2);
  for (std::size_t i = 0; i < 60; ++i) {
    EXPECT_EQ(a1[i + 40], a2[i]);
    EXPECT_EQ(z1[i + 40], z2[i]);
    EXPECT_EQ(r1[i + 40], r2[i]);
  }
}

}  // namespace risley::simulation::noise_test
