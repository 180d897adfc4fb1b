// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/diagnostics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

namespace risley::estimation::diagnostics_test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Residuals of regular shots where each keeps a share of the one before, both axes by themselves.
struct Residuals {
  std::vector<std::int64_t> time_ns;
  std::vector<double> azimuth, zenith;
  std::vector<unsigned char> skip;

  Residuals(std::size_t shots, double share, unsigned seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal(0.0, 1e-4);
    double a = normal(generator), z = normal(generator);
    for (std::size_t i = 0; i < shots; ++i) {
      time_ns.push_back(5'000'000'000 + static_cast<std::int64_t>(i) * 10'000);
      azimuth.push_back(a);
      zenith.push_back(z);
      skip.push_back(0);
      const double fresh = std::sqrt(1.0 - share * share);
      a = share * a + fresh * normal(generator);
      z = share * z + fresh * normal(generator);
    }
  }
  /// Leaves out rows of a predicate.
  template <class Predicate>
  void remove(const Predicate& gone) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < time_ns.size(); ++i) {
      if (gone(i)) continue;
      time_ns[kept] = time_ns[i];
      azimuth[kept] = azimuth[i];
      zenith[kept] = zenith[i];
      skip[kept++] = skip[i];
    }
    time_ns.resize(kept);
    azimuth.resize(kept);
    zenith.resize(kept);
    skip.resize(kept);
  }
  Autocorrelation autocorrelation() const {
    return estimation::autocorrelation(time_ns, azimuth, zenith, skip);
  }
};

void expect_share(const Autocorrelation& found, double share) {
  const double factor = (1.0 + share) / (1.0 - share);
  EXPECT_NEAR(found.factor, factor, 0.1 * factor);
  double sum = 1.0;
  for (const double rho : found.rho) sum += 2.0 * rho;
  // One standard deviation above the sum, which so many residuals know to a few per cent.
  EXPECT_GE(found.factor, sum);
  EXPECT_LE(found.factor, 1.05 * sum);
  ASSERT_GE(found.rho.size(), 10u);
  for (std::size_t lag = 1; lag <= 10; ++lag) {
    EXPECT_NEAR(found.rho[lag - 1], std::pow(share, static_cast<double>(lag)), 0.03) << lag;
  }
}

TEST(Autocorrelation, NoiseWithMemoryGivesItsFactor) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    expect_share(Residuals(400'000, 0.9, seed).autocorrelation(), 0.9);  // factor 19
    expect_share(Residuals(60'000, 0.75, seed).autocorrelation(), 0.75);
  }
}

TEST(Autocorrelation, WhiteNoiseGivesOne) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const double factor = Residuals(100'000, 0.0, seed).autocorrelation().factor;
    EXPECT_GE(factor, 1.0);
    EXPECT_LT(factor, 1.02);
  }
}

TEST(Autocorrelation, MissingAndSkippedShotsKeepTheLags) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> uniform;
  Residuals r(400'000, 0.9, 5);
  for (std::size_t i = 0; i < r.skip.size(); ++i) {
    const double what = uniform(generator);
    if (what < 0.05) {
      r.skip[i] = 1;  // an outlier
      r.azimuth[i] = 3.0;
    } else if (what < 0.08) {
      r.zenith[i] = kNan;  // a beam that does not get through
    }
    r.time_ns[i] += static_cast<std::int64_t>(4000.0 * (uniform(generator) - 0.5));  // jitter
  }
  const double kept = 0.7;
  r.remove([&](std::size_t i) {
    const bool gap = i % 10'000 < 900;  // shorter than a thousand shots, so it is bridged
    return gap || uniform(generator) > kept;
  });
  expect_share(r.autocorrelation(), 0.9);
}

TEST(Autocorrelation, ALongGapAndAClockResetEndABlock) {
  Residuals r(400'000, 0.9, 6);
  r.remove([](std::size_t i) { return i >= 30'000 && i < 32'000; });
  for (std::size_t i = 200'000; i < r.time_ns.size(); ++i) r.time_ns[i] -= 5'000'000'000;
  expect_share(r.autocorrelation(), 0.9);
}

// The shots behind the gap are many, but nothing of them is used: found.factor is 1.
TEST(Autocorrelation, ALongGapEarlyInABlockDoesNotHideTheRest) {
  Residuals r(400'000, 0.9, 6);  // so many that the factor itself is known to 3 %
  r.remove([](std::size_t i) { return i >= 50 && i < 2050; });
  expect_share(r.autocorrelation(), 0.9);
}

TEST(Autocorrelation, NeverMakesResidualsBetterThanIndependent) {
  const Autocorrelation turning = Residuals(100'000, -0.5, 8).autocorrelation();
  EXPECT_EQ(turning.factor, 1.0);
  EXPECT_TRUE(turning.rho.empty());
  EXPECT_EQ(Residuals(99, 0.9, 9).autocorrelation().factor, 1.0);  // too few to decide
  EXPECT_EQ(Residuals(0, 0.9, 9).autocorrelation().factor, 1.0);
  Residuals nothing(1000, 0.9, 9);
  std::fill(nothing.azimuth.begin(), nothing.azimuth.end(), kNan);
  EXPECT_EQ(nothing.autocorrelation().factor, 1.0);
  Residuals perfect(1000, 0.9, 9);
  for (auto* column : {&perfect.azimuth, &perfect.zenith}) {
    std::fill(column->begin(), column->end(), 0.0);
  }
  EXPECT_EQ(perfect.autocorrelation().factor, 1.0);
}

/// Normal pairs of which a share is replaced.
struct Pairs {
  std::vector<double> azimuth, zenith;

  Pairs(std::size_t count, double sigma, double share, double instead, unsigned seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal(0.0, sigma);
    for (std::size_t i = 0; i < count; ++i) {
      // Evenly spread, so that the share is exact wherever rows are picked.
      const double place = static_cast<double>(i) * 0.6180339887498949;
      const bool gross = place - std::floor(place) < share;
      azimuth.push_back(gross ? instead : normal(generator));
      zenith.push_back(normal(generator));
    }
  }
  double scale() const { return robust_scale(azimuth, zenith); }
};

TEST(RobustScale, IsTheSigmaOfNormalPairs) {
  for (const std::size_t count : {20'000u, 19'999u, 100'000u}) {
    EXPECT_NEAR(Pairs(count, 2e-4, 0.0, 0.0, 1).scale() / 2e-4, 1.0, 0.015) << count;
  }
}

TEST(RobustScale, GrossErrorsShiftItOnlyAsFarAsTheyShiftTheMedian) {
  for (const double share : {0.1, 0.3, 0.45}) {
    const double expected = std::sqrt(std::log(1.0 - 0.5 / (1.0 - share)) / std::log(0.5));
    for (const double instead : {1.0, 1e200, kNan}) {
      EXPECT_NEAR(Pairs(20'000, 2e-4, share, instead, 2).scale() / 2e-4, expected, 0.02 * expected)
          << share << " " << instead;
    }
  }
}

TEST(RobustScale, IsInfiniteWhenHalfOfThePairsAreGone) {
  EXPECT_TRUE(std::isfinite(Pairs(10'000, 2e-4, 0.49, kNan, 3).scale()));
  EXPECT_TRUE(std::isinf(Pairs(10'000, 2e-4, 0.51, kNan, 3).scale()));
  EXPECT_TRUE(std::isinf(robust_scale({}, {})));
}

TEST(AngleProfile, OfASinusoidIsTheSinusoid) {
  constexpr std::size_t kBins = 72, kPerBin = 5, kPoints = kBins * kPerBin;
  constexpr int kTurns = 40;
  constexpr double kAzimuth = 3e-4, kZenith = 2e-4;
  AngleProfiler profiler(kBins);
  const double step = kTwoPi / kPoints;
  for (int turn = -kTurns / 2; turn < kTurns / 2; ++turn) {
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double angle = (static_cast<double>(i) + 0.5) * step;
      profiler.add(turn * kTwoPi + angle, kAzimuth * std::sin(angle),
                   kZenith * std::cos(2.0 * angle));
    }
  }
  const AngleProfile profile = profiler.result();
  ASSERT_EQ(profile.count.size(), kBins);
  ASSERT_EQ(profile.mean_azimuth.size(), kBins);
  ASSERT_EQ(profile.mean_zenith.size(), kBins);
  // What the mean of the points of a bin leaves of a sinusoid of so many periods.
  const auto kept = [&](double periods) {
    return std::sin(0.5 * kPerBin * periods * step) / (kPerBin * std::sin(0.5 * periods * step));
  };
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const double middle = (static_cast<double>(bin) + 0.5) * kTwoPi / kBins;
    EXPECT_EQ(profile.count[bin], kPerBin * kTurns);
    EXPECT_NEAR(profile.mean_azimuth[bin], kAzimuth * kept(1) * std::sin(middle), 1e-15);
    EXPECT_NEAR(profile.mean_zenith[bin], kZenith * kept(2) * std::cos(2.0 * middle), 1e-15);
  }
  EXPECT_NEAR(profile.sigma_azimuth, kAzimuth / std::sqrt(2.0), 1e-15);
  EXPECT_NEAR(profile.sigma_zenith, kZenith / std::sqrt(2.0), 1e-15);
  const double chi2 = 0.5 * kPerBin * kTurns * (kept(1) * kept(1) + kept(2) * kept(2));
  EXPECT_NEAR(profile.chi2_per_bin, chi2, 1e-9 * chi2);
}

TEST(AngleProfile, OfWhiteNoiseHasAChi2OfOne) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1e3, 1e3);
  AngleProfiler profiler;
  for (int i = 0; i < 200'000; ++i) {
    profiler.add(uniform(generator), 2e-4 * normal(generator), 3e-4 * normal(generator));
  }
  const AngleProfile profile = profiler.result();
  EXPECT_EQ(profile.count.size(), 72u);
  EXPECT_NEAR(profile.sigma_azimuth, 2e-4, 2e-6);
  EXPECT_NEAR(profile.sigma_zenith, 3e-4, 3e-6);
  EXPECT_NEAR(profile.chi2_per_bin, 1.0, 3.0 * std::sqrt(2.0 / 144.0));
}

TEST(AngleProfile, BinsWithoutShotsAreNan) {
  AngleProfiler profiler(4);
  EXPECT_EQ(profiler.result().chi2_per_bin, 0.0);
  profiler.add(0.0, 1.0, 2.0);
  profiler.add(kTwoPi * 1000, 3.0, 4.0);  // the same angle
  profiler.add(-1e-20, 5.0, 6.0);         // so little below a full turn that rounding makes it one
  const AngleProfile profile = profiler.result();
  EXPECT_EQ(profile.count, (std::vector<std::uint64_t>{2, 0, 0, 1}));
  EXPECT_EQ(profile.mean_azimuth[0], 2.0);
  EXPECT_EQ(profile.mean_zenith[0], 3.0);
  EXPECT_EQ(profile.mean_azimuth[3], 5.0);
  EXPECT_EQ(profile.mean_zenith[3], 6.0);
  for (const std::size_t empty : {1u, 2u}) {
    EXPECT_TRUE(std::isnan(profile.mean_azimuth[empty]));
    EXPECT_TRUE(std::isnan(profile.mean_zenith[empty]));
  }
  EXPECT_TRUE(std::isfinite(profile.chi2_per_bin));
}

TEST(Autocorrelation, AClockThatStandsStillTellsNothing) {
  const std::vector<std::int64_t> times(1000, 5);
  const std::vector<double> residuals(1000, 1e-4);
  const std::vector<unsigned char> skip(1000, 0);
  const Autocorrelation found = autocorrelation(times, residuals, residuals, skip);
  EXPECT_EQ(found.factor, 1.0);
  EXPECT_TRUE(found.rho.empty());
}

}  // namespace risley::estimation::diagnostics_test
