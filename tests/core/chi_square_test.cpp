// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/chi_square.hpp"

#include <gtest/gtest.h>

namespace risley::chi_square_test {

// Tables of chi-square: 0.05 % and 99.95 % of 8 degrees of freedom are 0.710 and 27.868.
TEST(ChiSquare, QuantilesAreThoseOfTables) {
  EXPECT_NEAR(8 * chi_square_per_degree(8, 3.2905), 27.868, 0.6);
  EXPECT_NEAR(8 * chi_square_per_degree(8, -3.2905), 0.710, 0.15);
  EXPECT_NEAR(160 * chi_square_per_degree(160, 0.0), 159.3, 0.1);
}

}  // namespace risley::chi_square_test
