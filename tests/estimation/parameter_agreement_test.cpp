// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/parameter_agreement.hpp"

#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley::estimation::parameter_agreement_test {

TEST(ParameterAgreement, CountsSigmasAlongTheCovariance) {
  Eigen::Matrix2d covariance;
  covariance << 4.0, 1.8, 1.8, 1.0;
  // Twice the long half-axis of the ellipse and next to nothing of the short one.
  const Eigen::Vector2d along = 2.0 * Eigen::Vector2d(2.0, 0.9);
  EXPECT_NEAR(disagreement(along, covariance).chi2_per_parameter, 2.0, 1e-12);
  EXPECT_TRUE(disagreement(along, covariance).same_sensor());
  const Eigen::Vector2d across(2.0, -0.9);  // one sigma of each, and not to be believed together
  const Disagreement apart = disagreement(across, covariance);
  EXPECT_NEAR(apart.chi2_per_parameter, 6.86 / 0.76, 1e-12);
  EXPECT_EQ(apart.worst, 0);
  EXPECT_NEAR(apart.worst_over_sigma, 1.0, 1e-12);
  EXPECT_FALSE(apart.same_sensor());
  EXPECT_TRUE(disagreement(0.9 * across, covariance).same_sensor());
}

TEST(ParameterAgreement, SizesMustMatch) {
  EXPECT_THROW(disagreement(Eigen::VectorXd(0), Eigen::MatrixXd(0, 0)), InvalidArgument);
  EXPECT_THROW(disagreement(Eigen::VectorXd::Zero(2), Eigen::MatrixXd::Identity(3, 3)),
               InvalidArgument);
}

}  // namespace risley::estimation::parameter_agreement_test
