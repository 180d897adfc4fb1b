// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/algebra/named_covariance.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "refusal.hpp"

namespace risley::algebra::named_covariance_test {

using Eigen::MatrixXd;
using ::testing::AllOf;

TEST(NamedCovariance, GivesPartsInTheOrderThatIsAskedFor) {
  const NamedCovariance all{{"a", "b", "c"},
                            (MatrixXd(3, 3) << 1, 2, 3, 2, 10, 6, 3, 6, 20).finished()};
  EXPECT_EQ(all.find("c"), 2);
  EXPECT_EQ(all.find("d"), -1);
  const NamedCovariance part = all.part(std::vector<std::string>{"c", "d", "a"});
  EXPECT_EQ(part.names, (std::vector<std::string>{"c", "a"}));
  EXPECT_EQ(part.matrix, (MatrixXd(2, 2) << 20, 3, 3, 1).finished());
  EXPECT_TRUE(all.part(std::vector<std::string>{"d"}).empty());
}

TEST(CovarianceFault, IsFoundWhereItShows) {
  const auto fault = [](double a, double b, double c, double d) {
    const auto found = covariance_fault((MatrixXd(2, 2) << a, b, c, d).finished());
    return found ? *found : CovarianceFault{-2, ""};
  };
  EXPECT_EQ(fault(1, 0.5, 0.5, 1e-12).words.substr(0, 16), " is not positive");
  EXPECT_EQ(fault(1, 0.5e-6, 0.5e-6, 1e-12).row, -2);
  EXPECT_EQ(fault(1, 1, 1, 1).row, -2) << "one quantity may decide another";
  EXPECT_EQ(fault(1, 2, 2, 1).row, -1);
  EXPECT_EQ(fault(1, 0.5, 0.5, 0).row, 1);
  EXPECT_THAT(fault(1, 0.5, 0.5, 0).words, NamesField("[1][1]"));
  EXPECT_EQ(fault(1, 0.5, 0.4, 1).row, 1);
  EXPECT_THAT(fault(1, 0.5, 0.4, 1).words, AllOf(NamesField("[1][0]"), NamesField("[0][1]")));
  EXPECT_EQ(fault(1, 0.5, 0.5 + 1e-14, 1).row, -2) << "rounding";
}

}  // namespace risley::algebra::named_covariance_test
