// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/angle_noise.hpp"

#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley::estimation::angle_noise_test {

/// Residuals of noise and of rounding, which half of the shots have coarsely.
struct Residuals {
  AngleSeries series;
  std::vector<double> azimuth, zenith;
  std::vector<unsigned char> outlier;

  Residuals(std::size_t shots, const AngleNoise& noise, float fine_step, float coarse_step,
            unsigned seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    for (std::size_t i = 0; i < shots; ++i) {
      const float step = i % 2 == 0 ? fine_step : coarse_step;
      const float variance = step * step / 12.0F;
      series.append(static_cast<std::int64_t>(i), 0, 0, 0, variance, variance);
      azimuth.push_back(noise.azimuth * normal(generator) +
                        static_cast<double>(step) * uniform(generator));
      zenith.push_back(noise.zenith * normal(generator) +
                       static_cast<double>(step) * uniform(generator));
      outlier.push_back(0);
    }
  }
  NoiseEstimate components(double used_share = 0.0) const {
    SquaredAngles squares;
    squares.add(series, azimuth, zenith, outlier);
    return noise_components(squares, used_share, 1.0);
  }
};

TEST(NoiseComponents, AreThoseOfTheDataAndTheirSigmasAreTrue) {
  const AngleNoise truth{7e-5, 3e-5};
  for (const auto& [fine, coarse] :
       {std::pair(0.0F, 0.0F), std::pair(1e-4F, 1e-4F), std::pair(2e-5F, 1e-3F)}) {
    double squares = 0, largest = 0;
    constexpr int kSeeds = 100;
    for (unsigned seed = 0; seed < kSeeds; ++seed) {
      const NoiseEstimate found = Residuals(4000, truth, fine, coarse, seed).components();
      for (const double z : {(found.value.azimuth - truth.azimuth) / found.sigma.azimuth,
                             (found.value.zenith - truth.zenith) / found.sigma.zenith}) {
        squares += z * z;
        largest = std::max(largest, std::abs(z));
      }
    }
    EXPECT_NEAR(squares / (2.0 * kSeeds), 1.0, 0.25) << coarse;
    EXPECT_LT(largest, 4.5) << coarse;
  }
}

TEST(NoiseComponents, RoundingAloneLeavesNone) {
  const NoiseEstimate found = Residuals(4000, {0.0, 0.0}, 1e-4F, 1e-4F, 3).components();
  EXPECT_LT(found.value.azimuth, 3.0 * found.sigma.azimuth);
  EXPECT_GT(found.sigma.azimuth, 0.0);
  EXPECT_LT(found.sigma.azimuth, 1e-5);
}

TEST(NoiseComponents, WhatTheEstimateUsedUpIsAdded) {
  const Residuals r(4000, {7e-5, 3e-5}, 0.0F, 0.0F, 4);
  const NoiseEstimate all = r.components(0.0), less = r.components(0.19);
  EXPECT_NEAR(less.value.azimuth / all.value.azimuth, 1.0 / 0.9, 1e-9);
}

TEST(NoiseComponents, OutliersPlayNoPart) {
  Residuals r(4000, {7e-5, 3e-5}, 0.0F, 1e-4F, 5);
  const NoiseEstimate clean = r.components();
  for (std::size_t i = 0; i < 100; ++i) r.outlier[i] = 1;
  const NoiseEstimate without = r.components();
  for (std::size_t i = 0; i < 100; ++i) r.azimuth[i] = r.zenith[i] = 0.3;
  const NoiseEstimate marked = r.components();
  EXPECT_EQ(marked.value.azimuth, without.value.azimuth);
  EXPECT_NEAR(without.value.azimuth / clean.value.azimuth, 1.0, 0.05);
}

TEST(RobustNoise, SurvivesManyGrossErrors) {
  const AngleNoise truth{7e-5, 3e-5};
  Residuals r(20000, truth, 2e-5F, 5e-5F, 6);
  const AngleNoise clean = robust_noise(r.series, r.azimuth, r.zenith);
  EXPECT_NEAR(clean.azimuth / truth.azimuth, 1.0, 0.06);
  EXPECT_NEAR(clean.zenith / truth.zenith, 1.0, 0.06);
  for (std::size_t i = 0; i < 1000; ++i) r.azimuth[19 * i + i % 7] = 0.2;
  for (std::size_t i = 0; i < 1000; ++i) {
    r.zenith[19 * i + i % 11] = std::numeric_limits<double>::quiet_NaN();
  }
  const AngleNoise dirty = robust_noise(r.series, r.azimuth, r.zenith);
  EXPECT_NEAR(dirty.azimuth / truth.azimuth, 1.0, 0.2);
  EXPECT_NEAR(dirty.zenith / truth.zenith, 1.0, 0.2);
}

TEST(RobustNoise, IsNeverZero) {
  const Residuals r(100, {0.0, 0.0}, 0.0F, 0.0F, 7);
  const AngleNoise none = robust_noise(r.series, r.azimuth, r.zenith);
  EXPECT_GE(none.azimuth, 0.99 * kLeastAngleNoise);
  EXPECT_LT(none.zenith, 2.0 * kLeastAngleNoise);
}

TEST(AngleNoise, MustBePositive) {
  EXPECT_NO_THROW(check_noise({1e-5, 2e-5}));
  EXPECT_THROW(check_noise({0.0, 1e-5}), InvalidArgument);
  EXPECT_THROW(check_noise({1e-5, -1.0}), InvalidArgument);
  EXPECT_THROW(check_noise({1e-5, std::numeric_limits<double>::quiet_NaN()}), InvalidArgument);
}

}  // namespace risley::estimation::angle_noise_test
