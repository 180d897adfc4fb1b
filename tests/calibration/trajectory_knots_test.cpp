// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/trajectory_knots.hpp"

#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "refusal.hpp"

namespace risley::calibration::trajectory_knots_test {

using Eigen::Index;
using Eigen::MatrixXd;

PoseErrorProcess some_process() {
  return {{0.02, 0.03, 0.04, 1e-4, 2e-4, 3e-4}, {100, 60, 30, 10, 5, 2}, 1e-5, 0.005};
}

/// Two strips of 2 s and 1 s, 10 s apart.
FlightShots two_strips() {
  FlightShots shots;
  shots.rotation_angle.resize(2);
  for (int i = 0; i <= 300; ++i) {
    const bool second = i > 200;
    shots.time_ns.push_back(i * 10'000'000LL + (second ? 10'000'000'000 : 0));
    shots.strip.push_back(second ? 4 : 1);
    shots.range.push_back(80);
    for (auto& column : shots.rotation_angle) column.push_back(0.1 * i);
  }
  return shots;
}

TEST(TrajectoryKnots, DivideEveryStripEvenly) {
  const FlightShots shots = two_strips();
  const TrajectoryKnots knots = make_knots(shots, 0.55);
  ASSERT_EQ(knots.intervals.size(), 6U);  // of 0.5 s and of 0.495 s
  EXPECT_EQ(knots.size(), 8U);
  EXPECT_EQ(knots.time_ns[1], 500'000'000);
  EXPECT_EQ(knots.time_ns.back(), shots.time_ns.back());
  std::size_t next = 0;
  for (const auto& interval : knots.intervals) {
    EXPECT_EQ(interval.first_shot, next);
    next = interval.end_shot;
    EXPECT_GE(shots.time_ns[interval.first_shot], interval.begin_ns);
    EXPECT_LE(shots.time_ns[interval.end_shot - 1], interval.end_ns);
    EXPECT_EQ(knots.strip[interval.knot], shots.strip[interval.first_shot]);
  }
  EXPECT_EQ(next, shots.size());
  EXPECT_EQ(make_knots(shots, 1000).size(), 4U);
  EXPECT_NE(refusal([&] { make_knots(shots, 0); }), "");
  EXPECT_NE(refusal([&] { make_knots(shots, 1e-9); }), "");
}

TEST(TrajectoryKnots, KnowTheProcessByTheInverseOfItsCovariance) {
  const TrajectoryKnots knots = make_knots(two_strips(), 0.25);
  const PoseErrorProcess process = some_process();
  const auto n = static_cast<Index>(knots.size());
  for (int c = 0; c < kPoseErrors; ++c) {
    const auto at = static_cast<std::size_t>(c);
    MatrixXd covariance(n, n);
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) {
        const double apart = 1e-9 * static_cast<double>(knots.time_ns[static_cast<std::size_t>(i)] -
                                                        knots.time_ns[static_cast<std::size_t>(j)]);
        covariance(i, j) = process.sigma[at] * process.sigma[at] *
                           std::exp(-std::abs(apart) / process.correlation_time[at]);
      }
    }
    const KnotInformation information = knot_information(knots, process, c);
    MatrixXd all = MatrixXd::Zero(n, n);
    for (Index i = 0; i < n; ++i) {
      all(i, i) = information.diagonal[static_cast<std::size_t>(i)];
      if (i + 1 < n) all(i, i + 1) = all(i + 1, i) = information.next[static_cast<std::size_t>(i)];
    }
    EXPECT_LT((all * covariance - MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(TrajectoryKnots, KnowWhatHappensBetweenThem) {
  // Values at the ends and at the middles of the parts, all at once.
  const PoseErrorProcess process = some_process();
  constexpr int kParts = 5;
  constexpr double kSpacing = 3;
  const auto covariance = [&](double s, double t) {
    return 4e-8 * std::exp(-std::abs(s - t) * kSpacing / 5);
  };
  MatrixXd off = MatrixXd::Zero(kParts, kParts + 2), all(kParts + 2, kParts + 2);
  const auto place = [&](Index i) {
    return i == kParts ? 0.0 : i > kParts ? 1.0 : (static_cast<double>(i) + 0.5) / kParts;
  };
  for (Index i = 0; i < kParts + 2; ++i) {
    for (Index j = 0; j < kParts + 2; ++j) all(i, j) = covariance(place(i), place(j));
    if (i == kParts + 1) break;
    if (i >= kParts) continue;
    off(i, i) = 1;
    off(i, kParts) = place(i) - 1;
    off(i, kParts + 1) = -place(i);
  }
  const MatrixXd expected = off * all * off.transpose();
  const MatrixXd found = covariance_between_knots(process, 4, kSpacing, kParts);
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_GT(found(2, 2), 0);
  // A short interval of a slow process: a random walk tied at both ends, 2 s^2 / T per second.
  const MatrixXd tied = covariance_between_knots(process, 0, 0.25, 1);
  EXPECT_NEAR(tied(0, 0), 2 * 4e-4 / 100 * 0.25 / 4, 1e-3 * tied(0, 0));
}

TEST(TrajectoryKnots, PassCorrectionsOn) {
  const FlightShots shots = two_strips();
  const TrajectoryKnots coarse = make_knots(shots, 1), fine = make_knots(shots, 0.25);
  MatrixXd corrections = MatrixXd::Zero(6, static_cast<Index>(coarse.size()));
  for (Index k = 0; k < corrections.cols(); ++k) {
    corrections(2, k) = 1e-9 * static_cast<double>(coarse.time_ns[static_cast<std::size_t>(k)]);
  }
  const MatrixXd found = resampled(coarse, corrections, fine);
  for (Index k = 0; k < found.cols(); ++k) {
    EXPECT_NEAR(found(2, k), 1e-9 * static_cast<double>(fine.time_ns[static_cast<std::size_t>(k)]),
                1e-9);
  }
  EXPECT_NE(refusal([&] { resampled(fine, corrections, coarse); }), "");
}

TEST(TrajectoryKnots, RefuseAProcessThatIsNone) {
  const auto refused = [](const auto& damage) {
    PoseErrorProcess process = some_process();
    damage(process);
    return refusal([&] { require_process(process); });
  };
  EXPECT_EQ(refused([](PoseErrorProcess&) {}), "");
  EXPECT_NE(refused([](PoseErrorProcess& p) { p.sigma[1] = 0; }), "");
  EXPECT_NE(refused([](PoseErrorProcess& p) { p.correlation_time[5] = -1; }), "");
  EXPECT_NE(refused([](PoseErrorProcess& p) { p.white_attitude = std::nan(""); }), "");
  EXPECT_NE(refused([](PoseErrorProcess& p) { p.sample_interval = 0; }), "");
}

}  // namespace risley::calibration::trajectory_knots_test
