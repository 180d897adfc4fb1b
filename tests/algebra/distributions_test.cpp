// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/algebra/distributions.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace risley::algebra::distributions_test {

// Critical values as tables in textbooks print them.
TEST(Distributions, TailsAreThoseOfTables) {
  EXPECT_NEAR(normal_tail(1.644854), 0.05, 1e-7);
  EXPECT_NEAR(normal_tail(-1.644854), 0.95, 1e-7);
  EXPECT_NEAR(chi_square_tail(15.507, 8), 0.05, 1e-5);
  EXPECT_NEAR(chi_square_tail(124.342, 100), 0.05, 1e-5);
  EXPECT_EQ(chi_square_tail(-1e-9, 8), 1);  // rounded below 0
  EXPECT_NEAR(f_tail(3 * 3.7083, 3, 10), 0.05, 1e-5);
  EXPECT_NEAR(two_sided_student_tail(-2.2281, 10), 0.05, 1e-5);
  EXPECT_EQ(two_sided_student_tail(0, 10), 1);
  EXPECT_EQ(two_sided_student_tail(std::numeric_limits<double>::infinity(), 10), 0);
}

TEST(Distributions, QuantilesAreThoseOfTables) {
  EXPECT_NEAR(two_sided_normal_quantile(0.05), 1.959964, 1e-6);
  EXPECT_NEAR(two_sided_normal_quantile(1), 0, 1e-12);
  EXPECT_EQ(two_sided_normal_quantile(0), std::numeric_limits<double>::infinity());
  EXPECT_NEAR(8 * chi_square_per_degree(8, 1.959964), 17.5345, 1e-4);
  EXPECT_NEAR(8 * chi_square_per_degree(8, -1.959964), 2.1797, 1e-4);
  EXPECT_NEAR(8 * chi_square_per_degree(8, 3.290527), 27.868, 1e-3);
  EXPECT_NEAR(8 * chi_square_per_degree(8, -3.290527), 0.710, 1e-3);
  EXPECT_NEAR(160 * chi_square_per_degree(160, 0.0), 159.3, 0.1);
  EXPECT_TRUE(std::isnan(chi_square_per_degree(0, 1)));
}

TEST(Distributions, ManyDegreesOfFreedomAreApproximatedAsStated) {
  for (double z = -3.5; z <= 3.5; z += 0.25) {
    EXPECT_NEAR(chi_square_per_degree(1000.0001, z), chi_square_per_degree(1000, z),
                std::abs(z) <= 2 ? 2e-6 : 3e-5)
        << z;
  }
}

}  // namespace risley::algebra::distributions_test
