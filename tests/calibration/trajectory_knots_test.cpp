// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/trajectory_knots.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

#include "calibration/flight_findings.hpp"
#include "refusal.hpp"

namespace risley::calibration::trajectory_knots_test {

using Eigen::Index;
using Eigen::MatrixXd;

/// Of the corrections, m or rad, and s.
constexpr double kSigma[] = {0.02, 0.03, 0.04, 1e-4, 2e-4, 3e-4};
constexpr double kTime[] = {100, 60, 30, 10, 5, 2};

/// @param growing  by the trajectory's accuracies, to twice as much within the first ten seconds
trajectories::ErrorProcess some_process(bool growing = false) {
  trajectories::ErrorModel model = trajectories::assumed_error_model();
  trajectories::Trajectory trajectory;
  trajectory.frame = trajectories::Frame::local;
  for (int c = 0; c < kCorrections; ++c) {
    trajectories::ErrorTerm& term = model.terms[static_cast<std::size_t>(error_of(c))];
    if (!growing) term.sigma = kSigma[c];
    term.correlation_time = kTime[c];
  }
  for (const int second : {0, 10}) {  // level, to the north
    const Eigen::Vector3d position(0, 0, 0);
    trajectory.time_ns.push_back(1'000'000'000LL * second);
    trajectory.position.push_back(position);
    trajectory.attitude.emplace_back(trajectories::ned_axes(trajectory.frame, position));
    const double size = 1 + 0.1 * second;
    trajectory.accuracy.push_back({size * Eigen::Vector3d(kSigma[1], kSigma[0], kSigma[2]),
                                   size * kSigma[4], size * kSigma[3], size * kSigma[5]});
  }
  return {model, trajectory};
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
  const Index n = knots.size();
  for (int number = 0; number < 2 * kCorrections; ++number) {
    const int c = number % kCorrections;
    const bool growing = number >= kCorrections;
    const trajectories::ErrorProcess process = some_process(growing);
    const auto sigma = [&](Index k) {
      const double seconds = 1e-9 * static_cast<double>(knots.time_ns[k]);
      return kSigma[c] * (growing ? 1 + std::min(0.1 * seconds, 1.0) : 1);
    };
    MatrixXd covariance(n, n);
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < n; ++j) {
        const double apart = 1e-9 * static_cast<double>(knots.time_ns[i] - knots.time_ns[j]);
        covariance(i, j) = sigma(i) * sigma(j) * std::exp(-std::abs(apart) / kTime[c]);
      }
    }
    const KnotInformation information = knot_information(knots, process, c);
    MatrixXd all = MatrixXd::Zero(n, n);
    for (Index i = 0; i < n; ++i) {
      all(i, i) = information.diagonal[i];
      if (i + 1 < n) all(i, i + 1) = all(i + 1, i) = information.next[i];
    }
    EXPECT_LT((all * covariance - MatrixXd::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(TrajectoryKnots, KnowWhatHappensBetweenThem) {
  // Values at the ends and at the middles of the parts, all at once.
  const trajectories::ErrorProcess process = some_process();
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
  const MatrixXd found = covariance_between_knots(process, 4, 0, 3'000'000'000, kParts);
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_GT(found(2, 2), 0);
  // A short interval of a slow process: a random walk tied at both ends, 2 s^2 / T per second.
  const MatrixXd tied = covariance_between_knots(process, 0, 0, 250'000'000, 1);
  EXPECT_NEAR(tied(0, 0), 2 * 4e-4 / 100 * 0.25 / 4, 1e-3 * tied(0, 0));
}

TEST(TrajectoryKnots, PassCorrectionsOn) {
  const FlightShots shots = two_strips();
  const TrajectoryKnots coarse = make_knots(shots, 1), fine = make_knots(shots, 0.25);
  MatrixXd corrections = MatrixXd::Zero(6, coarse.size());
  for (Index k = 0; k < corrections.cols(); ++k) {
    corrections(2, k) = 1e-9 * static_cast<double>(coarse.time_ns[k]);
  }
  const MatrixXd found = resampled(coarse, corrections, fine);
  for (Index k = 0; k < found.cols(); ++k) {
    EXPECT_NEAR(found(2, k), 1e-9 * static_cast<double>(fine.time_ns[k]), 1e-9);
  }
  EXPECT_NE(refusal([&] { resampled(fine, corrections, coarse); }), "");
}

TEST(TrajectoryKnots, CorrectPosesBetweenBeforeAndBehindThem) {
  const TrajectoryKnots knots = make_knots(two_strips(), 1);  // at 0, 1, 2; 12.01, 13 s
  const trajectories::ErrorProcess process = some_process();
  MatrixXd corrections = MatrixXd::Zero(6, knots.size());
  corrections.row(3) << 1e-4, 3e-4, -1e-4, 2e-4, 0;
  const auto at = [&](double seconds) {
    return correction_at(knots, corrections, process, std::llround(1e9 * seconds))[3];
  };
  EXPECT_NEAR(at(0.25), 1.5e-4, 1e-15);
  EXPECT_NEAR(at(-5), 1e-4 * std::exp(-0.5), 1e-15);
  EXPECT_NEAR(at(33), 0, 1e-15);
  // Between strips: what a process of 10 s leaves of both, as the inverse of its covariance says.
  const double before = std::exp(-0.3), behind = std::exp(-0.701), both = std::exp(-1.001);
  const double rest = 1 - both * both;
  EXPECT_NEAR(at(5),
              -1e-4 * (before - behind * both) / rest + 2e-4 * (behind - before * both) / rest,
              1e-15);
  // Half known at the knots: half and half between, and forgotten by and by.
  MatrixXd sigma(6, knots.size());
  for (int c = 0; c < 6; ++c) sigma.row(c).setConstant(0.5 * kSigma[c]);
  const auto sigma_of = [&](double seconds) {
    return correction_sigma_at(knots, sigma, process, std::llround(1e9 * seconds))[3];
  };
  EXPECT_NEAR(sigma_of(0.25), 0.5e-4, 1e-15);
  EXPECT_NEAR(sigma_of(-5), 1e-4 * std::sqrt(1 - 0.75 * std::exp(-1.0)), 1e-15);
  EXPECT_NEAR(sigma_of(5), 1e-4 * std::sqrt(1 - 0.75 * std::exp(-0.6)), 1e-15);
  EXPECT_NEAR(sigma_of(500), 1e-4, 1e-15);
  EXPECT_NE(refusal([&] { correction_sigma_at(knots, sigma.topRows(3), process, 0); }), "");
  EXPECT_NE(refusal([&] { correction_at(knots, corrections.leftCols(2), process, 0); }), "");
  EXPECT_NE(refusal([&] { correction_at({}, {}, process, 0); }), "");
  EXPECT_NE(refusal([&] { knot_information(knots, process, 6); }), "");
  EXPECT_NE(refusal([&] { covariance_between_knots(process, 0, 5, 5, 1); }), "");
  EXPECT_NE(refusal([&] { covariance_between_knots(process, 0, 0, 5, 0); }), "");
}

// What stays of tilts about east and north, in the words of a body that heads somewhere.
TEST(TrajectoryKnots, TheAccuracyOfACorrectedTrajectoryTurnsWithItsHeading) {
  FlightModel model;
  model.knots = make_knots(two_strips(), 0.55);
  model.corrections = MatrixXd::Zero(6, model.knots.size());
  MatrixXd sigma(6, model.knots.size());
  for (int c = 0; c < 6; ++c) sigma.row(c).setConstant(kSigma[c]);
  for (const double heading : {0.0, 0.5, kPi / 2, 4.0}) {
    trajectories::Trajectory trajectory;
    trajectory.frame = trajectories::Frame::local;
    trajectory.time_ns = {0};
    trajectory.position = {{0, 0, 0}};
    trajectory.attitude = {Eigen::Quaterniond(trajectories::ned_axes(trajectory.frame, {0, 0, 0})) *
                           trajectories::ned_from_body({0, 0, heading})};
    const trajectories::PoseAccuracy found =
        corrected(trajectory, model, some_process(), sigma).accuracy.at(0);
    const double c = std::cos(heading), s = std::sin(heading);
    EXPECT_NEAR(found.position.x(), kSigma[1], 1e-12);
    EXPECT_NEAR(found.position.y(), kSigma[0], 1e-12);
    EXPECT_NEAR(found.roll, std::hypot(c * kSigma[4], s * kSigma[3]), 1e-12);
    EXPECT_NEAR(found.pitch, std::hypot(s * kSigma[4], c * kSigma[3]), 1e-12);
    EXPECT_NEAR(found.heading, kSigma[5], 1e-12);
  }
}

TEST(TrajectoryKnots, KeepWhatIsKnownExactly) {
  trajectories::ErrorModel model = trajectories::assumed_error_model();
  for (trajectories::ErrorTerm& term : model.terms) term.sigma = 0;
  trajectories::Trajectory trajectory;
  trajectory.frame = trajectories::Frame::local;
  trajectory.time_ns = {0};
  trajectory.position = {{0, 0, 0}};
  trajectory.attitude = {Eigen::Quaterniond::Identity()};
  const KnotInformation known = knot_information(make_knots(two_strips(), 1),
                                                 trajectories::ErrorProcess(model, trajectory), 2);
  EXPECT_GT(known.diagonal[0], 1e13);
  EXPECT_TRUE(std::isfinite(known.diagonal[0]));
}

}  // namespace risley::calibration::trajectory_knots_test
