// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/golden_section.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace risley::golden_section_test {

TEST(GoldenSection, FindsTheMinimumToHalfTheTolerance) {
  for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
    for (double c = -1.9; c < 3.0; c += 0.17) {
      const auto parabola = [&](double x) { return 3.0 * (x - c) * (x - c) - 7.0; };
      const auto cusp = [&](double x) { return x < c ? 5.0 * (c - x) : x - c; };
      const auto skew = [&](double x) { return std::exp(x - c) - (x - c); };
      EXPECT_LE(std::abs(golden_section_minimum(parabola, -2.0, 3.0, tolerance) - c),
                0.5 * tolerance);
      EXPECT_LE(std::abs(golden_section_minimum(cusp, -2.0, 3.0, tolerance) - c), 0.5 * tolerance);
      EXPECT_LE(std::abs(golden_section_minimum(skew, -2.0, 3.0, tolerance) - c), 0.5 * tolerance);
    }
  }
}

TEST(GoldenSection, AMonotoneFunctionIsSmallestAtAnEnd) {
  const auto cube = [](double x) { return x * x * x; };
  const auto falling = [](double x) { return -x; };
  EXPECT_LE(golden_section_minimum(cube, -4.0, 1.0, 1e-6), -4.0 + 0.5e-6);
  EXPECT_GE(golden_section_minimum(falling, -4.0, 1.0, 1e-6), 1.0 - 0.5e-6);
}

TEST(GoldenSection, StaysInsideAndEvaluatesOncePerStep) {
  const double width = 5.0, tolerance = 1e-5;
  int evaluations = 0;
  golden_section_minimum(
      [&](double x) {
        ++evaluations;
        EXPECT_GT(x, -2.0);
        EXPECT_LT(x, 3.0);
        return std::cosh(x - 0.3);
      },
      -2.0, 3.0, tolerance);
  const double share = 0.5 * (std::sqrt(5.0) - 1.0);
  EXPECT_EQ(evaluations,
            2 + static_cast<int>(std::ceil(std::log(tolerance / width) / std::log(share))));
}

}  // namespace risley::golden_section_test
