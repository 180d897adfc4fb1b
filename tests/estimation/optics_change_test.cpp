// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "estimation/optics_change.hpp"

#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace risley::estimation {
namespace {

constexpr Eigen::Index kConstants = 6;

/// Estimates of constants that are 0, with errors that hang together.
class Pieces {
 public:
  explicit Pieces(unsigned seed) : generator_(seed) {
    Eigen::MatrixXd factor(kConstants, kConstants);
    for (Eigen::Index i = 0; i < factor.size(); ++i) factor.data()[i] = 0.02 * normal_(generator_);
    covariance_ = factor * factor.transpose();
    covariance_.diagonal().array() += 1e-5;
  }

  /// @param scale  of the errors over their stated sigmas
  ConstantsEstimate draw(double scale = 1) {
    Eigen::VectorXd noise(kConstants);
    for (double& one : noise) one = scale * normal_(generator_);
    return {covariance_.llt().matrixL() * noise, covariance_};
  }
  const Eigen::MatrixXd& covariance() const { return covariance_; }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
  Eigen::MatrixXd covariance_;
};

const Eigen::MatrixXd kNothing = Eigen::MatrixXd::Zero(kConstants, kConstants);

TEST(OpticsChange, PooledPiecesHaveTheCovarianceOfTheirMean) {
  Pieces source(1);
  std::deque<ConstantsEstimate> pieces;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(kConstants);
  for (int i = 0; i < 8; ++i) {
    pieces.push_back(source.draw());
    if (i >= 4) sum += pieces.back().mean;
  }
  const ConstantsEstimate last = pooled(pieces, 4);
  const Eigen::MatrixXd expected = 0.25 * source.covariance();
  // The prior, which each piece has, counts once: 1 against information of 1e2 and more.
  EXPECT_TRUE(last.covariance.isApprox(expected, 2e-2)) << last.covariance << "\n" << expected;
  EXPECT_LT((last.mean - 0.25 * sum).norm(), 2e-2 * sum.norm());
  EXPECT_TRUE(pooled(pieces, 1).mean.isApprox(pieces.back().mean, 1e-9));
}

TEST(OpticsChange, AProbabilityIsThatOfChance) {
  Pieces source(2);
  constexpr int kDraws = 4000;
  int below_tenth = 0, below_hundredth = 0, single = 0, either = 0;
  for (int i = 0; i < kDraws; ++i) {
    const auto difference = difference_of(source.draw(), source.draw(), kNothing, {});
    EXPECT_EQ(difference.combinations, kConstants);
    below_tenth += difference.joint_p_value < 0.1 ? 1 : 0;
    below_hundredth += difference.joint_p_value < 0.01 ? 1 : 0;
    single += difference.single_p_value < 0.01 ? 1 : 0;
    either += difference.p_value < 0.01 ? 1 : 0;
  }
  EXPECT_NEAR(below_tenth, 0.1 * kDraws, 4 * std::sqrt(0.09 * kDraws));
  EXPECT_NEAR(below_hundredth, 0.01 * kDraws, 4 * std::sqrt(0.0099 * kDraws));
  // Bounds: constants hang together, and so do both tests.
  EXPECT_LT(single, 0.01 * kDraws + 3 * std::sqrt(0.0099 * kDraws));
  EXPECT_GT(single, 0.001 * kDraws);
  EXPECT_LT(either, 0.01 * kDraws + 3 * std::sqrt(0.0099 * kDraws));
  EXPECT_GT(either, 0.002 * kDraws);
}

TEST(OpticsChange, TheConstantThatChangedAloneIsNamedWithItsChange) {
  Pieces source(6);
  constexpr int kDraws = 2000;
  const Eigen::MatrixXd information = (2 * source.covariance()).inverse();
  for (Eigen::Index changed = 0; changed < kConstants; ++changed) {
    const double sigma = 1 / std::sqrt(information(changed, changed));
    int named = 0, sooner = 0;
    double squares = 0;
    for (int i = 0; i < kDraws; ++i) {
      ConstantsEstimate a = source.draw(), b = source.draw();
      b.mean[changed] += 7 * sigma;
      const auto difference = difference_of(a, b, kNothing, {});
      sooner += difference.single_p_value < difference.joint_p_value ? 1 : 0;
      if (difference.constant != changed) continue;
      ++named;
      EXPECT_NEAR(difference.change_sigma[changed], sigma, 1e-6 * sigma);
      squares += std::pow((difference.change[changed] - 7 * sigma) / sigma, 2);
    }
    EXPECT_GT(named, 0.5 * kDraws) << changed;
    EXPECT_GT(sooner, 0.8 * kDraws) << changed;
    // Chosen for fitting best, it scatters by a little less than the sigma.
    EXPECT_NEAR(squares / named, 1, 0.2) << changed;
  }
}

TEST(OpticsChange, SigmasThatAreTooSmallAreFoundOutInTheBeginning) {
  Pieces source(3);
  constexpr int kDraws = 3000;
  constexpr double kScale = 2.5;
  int below_hundredth = 0, without = 0;
  for (int i = 0; i < kDraws; ++i) {
    std::deque<ConstantsEstimate> pieces;
    for (int piece = 0; piece < 8; ++piece) pieces.push_back(source.draw(kScale));
    const PieceScatter scatter = piece_scatter(pieces);
    EXPECT_EQ(scatter.degrees_of_freedom, 7.0 * kConstants);
    const ConstantsEstimate beginning = pooled(pieces, 8), recent = source.draw(kScale);
    below_hundredth +=
        difference_of(beginning, recent, kNothing, scatter).joint_p_value < 0.01 ? 1 : 0;
    without += difference_of(beginning, recent, kNothing, {}).joint_p_value < 0.01 ? 1 : 0;
  }
  EXPECT_NEAR(below_hundredth, 0.01 * kDraws, 4 * std::sqrt(0.0099 * kDraws));
  EXPECT_GT(without, kDraws / 2);
}

TEST(OpticsChange, CombinationsThatNobodyMeasuredDoNotCount) {
  Pieces source(4);
  ConstantsEstimate a = source.draw(), b = source.draw();
  for (ConstantsEstimate* one : {&a, &b}) {
    one->covariance.row(2).setZero();
    one->covariance.col(2).setZero();
    one->covariance(2, 2) = 1;
  }
  a.mean[2] = 0;
  b.mean[2] = 50;
  const auto difference = difference_of(a, b, kNothing, {});
  EXPECT_EQ(difference.combinations, kConstants - 1);
  EXPECT_TRUE(std::isnan(difference.change[2]));
  EXPECT_GT(difference.p_value, 1e-6);
}

TEST(OpticsChange, WhatTheOtherSideMayBeOffByCounts) {
  Pieces source(5);
  const ConstantsEstimate exact{Eigen::VectorXd::Zero(kConstants), kNothing};
  ConstantsEstimate recent = source.draw();
  recent.mean[0] += 0.5;
  EXPECT_LT(difference_of(exact, recent, kNothing, {}).p_value, 1e-12);
  const Eigen::MatrixXd wide = Eigen::MatrixXd::Identity(kConstants, kConstants);
  EXPECT_GT(difference_of(exact, recent, wide, {}).p_value, 0.1);
}

}  // namespace
}  // namespace risley::estimation
