// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/simulation/trajectory_noise.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/trajectories/geodesy.hpp"

#include "refusal.hpp"

namespace risley::simulation::trajectory_noise_test {

using trajectories::ErrorModel;
using trajectories::Trajectory;

/// One pose for so many records, 5 ms apart, of a platform with its nose down to the east.
Trajectory standing(std::size_t records, trajectories::Frame frame) {
  Trajectory t;
  t.frame = frame;
  const bool earth = frame == trajectories::Frame::geocentric;
  const trajectories::Geodetic place{0.8, 0.3, 200};
  const Eigen::Vector3d position =
      earth ? trajectories::geocentric_from_geodetic(place) : Eigen::Vector3d(10, 20, 80);
  const Eigen::Quaterniond attitude = Eigen::Quaterniond(trajectories::ned_axes(frame, position)) *
                                      trajectories::ned_from_body({0.1, -0.4, 1.2});
  for (std::size_t i = 0; i < records; ++i) {
    t.time_ns.push_back(static_cast<std::int64_t>(i) * 5'000'000);
    t.position.push_back(position);
    t.attitude.push_back(attitude.normalized());
  }
  return t;
}

ErrorModel model() {
  ErrorModel m;
  const double sigma[] = {0.02, 0.03, 0.05, 4e-4, 5e-4, 1.4e-3};
  const double time[] = {1.0, 2.0, 0.5, 1.0, 1.5, 3.0};
  const double white[] = {0, 0, 0.01, 1e-4, 2e-4, 3e-4};
  for (std::size_t i = 0; i < trajectories::kPoseErrors; ++i) {
    m.terms[i] = {sigma[i], time[i], white[i], "test"};
  }
  m.sample_interval = 0.005;
  return m;
}

/// The six errors of a record, stated minus true, found without the library's own error vector.
std::array<double, 6> errors_of(const Trajectory& truth, const Trajectory& noisy, std::size_t row) {
  const Eigen::Matrix3d ned = trajectories::ned_axes(truth.frame, truth.position[row]);
  const Eigen::Vector3d moved = ned.transpose() * (noisy.position[row] - truth.position[row]);
  const Eigen::Matrix3d turned = ned.transpose() *
                                 (noisy.attitude[row].toRotationMatrix() *
                                  truth.attitude[row].toRotationMatrix().transpose()) *
                                 ned;
  // Small rotations: the antisymmetric part.
  return {moved.x(),
          moved.y(),
          -moved.z(),
          0.5 * (turned(2, 1) - turned(1, 2)),
          0.5 * (turned(0, 2) - turned(2, 0)),
          0.5 * (turned(1, 0) - turned(0, 1))};
}

// Variances and covariances at two lags over many seeds, against the formula of the process. The
// error of a variance of n draws is sqrt(2 / n).
TEST(TrajectoryNoise, HasTheVariancesAndCorrelationsOfItsModel) {
  const ErrorModel m = model();
  constexpr std::size_t kRecords = 401, kFirst = 100, kSeeds = 1500;
  const std::size_t lags[] = {0, 1, 100, 300};
  for (const auto frame : {trajectories::Frame::local, trajectories::Frame::geocentric}) {
    const Trajectory truth = standing(kRecords, frame);
    std::array<std::array<double, 4>, 6> sums{};
    double crossed = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      const Trajectory noisy = with_errors(truth, m, seed);
      const auto first = errors_of(truth, noisy, kFirst);
      for (std::size_t lag = 0; lag < 4; ++lag) {
        const auto later = errors_of(truth, noisy, kFirst + lags[lag]);
        for (std::size_t i = 0; i < 6; ++i) sums[i][lag] += first[i] * later[i] / kSeeds;
      }
      crossed += first[0] * first[1] / kSeeds;
    }
    for (std::size_t i = 0; i < 6; ++i) {
      const double sigma = *m.terms[i].sigma, white = m.terms[i].white;
      const double all = sigma * sigma + white * white;
      for (std::size_t lag = 0; lag < 4; ++lag) {
        const double decay =
            std::exp(-0.005 * static_cast<double>(lags[lag]) / m.terms[i].correlation_time);
        const double expected = sigma * sigma * decay + (lags[lag] == 0 ? white * white : 0.0);
        EXPECT_NEAR(sums[i][lag] / all, expected / all, 5 * std::sqrt(2.0 / kSeeds))
            << i << ' ' << lags[lag];
      }
    }
    EXPECT_LT(std::abs(crossed), 5 * 0.02 * 0.03 / std::sqrt(1.0 * kSeeds));
    if (HasFailure()) return;
  }
}

TEST(TrajectoryNoise, WhitePartsAreOnePerSampleOfTheirInterval) {
  ErrorModel m = model();
  for (auto& term : m.terms) term.sigma = 0.0;
  m.sample_interval = 0.020;  // four records
  const Trajectory truth = standing(200, trajectories::Frame::local);
  const Trajectory noisy = with_errors(truth, m, 5);
  int changes = 0;
  for (std::size_t i = 1; i < 200; ++i) {
    changes += noisy.position[i].z() != noisy.position[i - 1].z() ? 1 : 0;
  }
  EXPECT_EQ(changes, 49);
  EXPECT_EQ(noisy.position[7].x(), truth.position[7].x());
}

TEST(TrajectoryNoise, StatesItsAccuraciesAndKeepsTheRest) {
  const Trajectory truth = standing(10, trajectories::Frame::geocentric);
  const Trajectory noisy = with_errors(truth, model(), 1);
  EXPECT_EQ(noisy.time_ns, truth.time_ns);
  ASSERT_EQ(noisy.accuracy.size(), 10u);
  const auto& accuracy = noisy.accuracy[3];
  EXPECT_NEAR(accuracy.position.x(), 0.02, 1e-12);
  EXPECT_NEAR(accuracy.position.z(), std::hypot(0.05, 0.01), 1e-12);
  EXPECT_NEAR(accuracy.heading, std::hypot(1.4e-3, 3e-4), 1e-12);
  // Heading 1.2 rad, between north and east: roll is mostly a tilt about east.
  const double c2 = std::pow(std::cos(1.2), 2), s2 = 1 - c2;
  const double north = 4e-4 * 4e-4 + 1e-8, east = 5e-4 * 5e-4 + 4e-8;
  EXPECT_NEAR(accuracy.roll, std::sqrt(c2 * north + s2 * east), 1e-9);
  EXPECT_NEAR(accuracy.pitch, std::sqrt(s2 * north + c2 * east), 1e-9);
}

TEST(TrajectoryNoise, SameSeedSameBits) {
  const Trajectory truth = standing(50, trajectories::Frame::local);
  const Trajectory a = with_errors(truth, model(), 7), b = with_errors(truth, model(), 7);
  EXPECT_EQ(a.position, b.position);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(a.attitude[i].coeffs(), b.attitude[i].coeffs());
  EXPECT_NE(with_errors(truth, model(), 8).position[0], a.position[0]);
  // Uneven steps: as correlated as their distance implies, not their number.
  Trajectory uneven = truth;
  for (std::size_t i = 25; i < 50; ++i) uneven.time_ns[i] += 3'600'000'000'000;
  const Trajectory far = with_errors(uneven, model(), 7);
  EXPECT_EQ(far.position[24], a.position[24]);
  EXPECT_NE(far.position[25], a.position[25]);
}

TEST(TrajectoryNoise, AsksForSigmas) {
  ErrorModel m = model();
  m.terms[0].sigma.reset();
  EXPECT_THAT(refusal([&] { with_errors(standing(5, trajectories::Frame::local), m, 1); }),
              NamesField("sigma"));
}

}  // namespace risley::simulation::trajectory_noise_test
