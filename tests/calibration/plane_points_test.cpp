// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/plane_points.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/sensors/preset.hpp"

#include "refusal.hpp"

namespace risley::calibration::plane_points_test {

using ::testing::AllOf;
using ::testing::ElementsAre;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(SpreadRows, AreEvenlySpread) {
  EXPECT_THAT(spread_rows(0, 5), ElementsAre());
  EXPECT_THAT(spread_rows(5, 0), ElementsAre());
  EXPECT_THAT(spread_rows(3, 3), ElementsAre(0, 1, 2));
  EXPECT_THAT(spread_rows(3, 100), ElementsAre(0, 1, 2));
  EXPECT_THAT(spread_rows(10, 1), ElementsAre(5));
  const std::vector<std::size_t> rows = spread_rows(1234567, 20000);
  ASSERT_EQ(rows.size(), 20000u);
  const double part = 1234567.0 / 20000.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {  // one of each of 20,000 equal parts
    ASSERT_GE(rows[i], static_cast<std::size_t>(part * static_cast<double>(i))) << i;
    ASSERT_LT(static_cast<double>(rows[i]), part * static_cast<double>(i + 1)) << i;
    ASSERT_TRUE(i == 0 || rows[i] > rows[i - 1]) << i;
  }
}

TEST(SpreadRows, FallIntoStepWithNoNumberOfBeams) {
  // Every ninth shot would meet two beams of six.
  for (const std::size_t beams : {2u, 3u, 4u, 5u, 6u, 8u}) {
    for (const std::size_t part : {6u, 8u, 9u, 12u, 60u}) {
      std::vector<std::size_t> count(beams);
      for (const std::size_t row : spread_rows(10000 * part, 10000)) ++count[row % beams];
      for (const std::size_t one : count) {
        EXPECT_NEAR(static_cast<double>(one) * static_cast<double>(beams), 10000.0, 700.0)
            << beams << " beams, one shot of " << part;
      }
    }
  }
}

TEST(RangedShots, RowsAreCopiedWhole) {
  RangedShots from;
  from.resize(3, 2);
  EXPECT_EQ(from.size(), 2u);
  EXPECT_EQ(from.prisms(), 3);
  EXPECT_EQ(from.angle_covariance.size(), 6u);
  for (std::size_t k = 0; k < 3; ++k) {
    from.rotation_angle[k] = {0.1 + static_cast<double>(k), 1.1 + static_cast<double>(k)};
  }
  for (std::size_t k = 0; k < 6; ++k) {
    from.angle_covariance[k] = {2.0F, 3.0F + static_cast<float>(k)};
  }
  from.range = {7, 8};
  from.beam = {4, 5};
  const RangedShots to = rows_of(from, {1, 0, 1});
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_THAT(to.rotation_angle[k],
                ElementsAre(1.1 + static_cast<double>(k), 0.1 + static_cast<double>(k),
                            1.1 + static_cast<double>(k)));
  }
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_THAT(to.angle_covariance[k],
                ElementsAre(3.0F + static_cast<float>(k), 2.0F, 3.0F + static_cast<float>(k)));
  }
  EXPECT_THAT(to.range, ElementsAre(8, 7, 8));
  EXPECT_THAT(to.beam, ElementsAre(5, 4, 5));
  from.beam.clear();
  EXPECT_THAT(rows_of(from, {1, 0}).beam, ElementsAre(0, 0));
}

constexpr std::size_t kShots = 200;

/// Shots straight ahead, 0.2 ms apart.
estimation::AngleSeries some_shots() {
  estimation::AngleSeries series;
  for (std::size_t i = 0; i < kShots; ++i) {
    series.append(static_cast<std::int64_t>(1'000'000'000 + 200'000 * i), 0.0, 0.5 * kPi);
    series.range.push_back(10.0 + 0.01 * static_cast<double>(i));
  }
  return series;
}

/// An estimate by hand: rotors at constant speed, a knot every 2 ms with ten shots.
estimation::Estimate some_estimate() {
  estimation::Estimate estimate;
  estimate.converged = true;
  estimate.sensor = sensors::load_sensor("mid-40");
  estimate.free = estimation::free_parameters({"refractive_index"}, {2});
  estimate.covariance = Eigen::MatrixXd::Constant(1, 1, 4e-8);
  estimate.series = some_shots();
  const std::vector<estimation::ShotRange> all{{0, kShots}};
  estimate.trajectory = estimation::make_knots(estimate.series, all, 2);
  for (std::size_t knot = 0; knot < estimate.trajectory.size(); ++knot) {
    const double time = 1e-9 * static_cast<double>(estimate.trajectory.time_ns[knot]) - 1.0;
    const auto state = estimate.trajectory.state_of(knot);
    for (std::size_t k = 0; k < 2; ++k) {
      state[3 * k] = 1.0 + estimate.sensor.angular_velocity[k] * time;
      state[3 * k + 1] = estimate.sensor.angular_velocity[k];
    }
    for (int i = 0; i < 21; ++i) estimate.trajectory.covariance.push_back(0.0);
    double* covariance = estimate.trajectory.covariance.data() + 21 * knot;
    covariance[0] = 1e-8 * static_cast<double>(knot + 1);  // of the angles of both rotors
    covariance[3] = -2e-9;
    covariance[15] = 3e-8;
  }
  estimate.azimuth_residual.assign(kShots, 0.0);
  estimate.zenith_residual.assign(kShots, 0.0);
  estimate.outlier.assign(kShots, 0);
  estimate.common_angles = {Eigen::Vector2d{0.25, -0.75},
                            Eigen::Vector2d{1e8, 4e8}.asDiagonal().toDenseMatrix()};
  return estimate;
}

TEST(RangedRecording, HoldsRangesAndRotationAngles) {
  const estimation::Estimate estimate = some_estimate();
  const RangedRecording recording = ranged_recording(estimate, "one.lvx", "3GGD0042");
  EXPECT_EQ(recording.name, "one.lvx");
  EXPECT_EQ(recording.serial, "3GGD0042");
  EXPECT_EQ(recording.believed.name, "mid-40");
  ASSERT_EQ(recording.free.size(), 1u);
  EXPECT_EQ(recording.covariance(0, 0), 4e-8);
  EXPECT_EQ(recording.angle_sensitivity, estimate.common_angles->sensitivity);
  EXPECT_NEAR(recording.mean_angle_covariance(0, 0), 1e-8, 1e-20);
  EXPECT_NEAR(recording.mean_angle_covariance(1, 1), 0.25e-8, 1e-20);
  EXPECT_EQ(recording.without_range, 0u);
  EXPECT_EQ(recording.outliers, 0u);
  ASSERT_EQ(recording.shots.size(), kShots);
  ASSERT_EQ(recording.shots.prisms(), 2);
  EXPECT_EQ(recording.time_ns, some_shots().time_ns);
  EXPECT_EQ(recording.shots.range, some_shots().range);
  for (std::size_t i = 0; i < kShots; ++i) {
    const double time = 2e-4 * static_cast<double>(i);
    for (std::size_t k = 0; k < 2; ++k) {
      const double angle = recording.shots.rotation_angle[k][i];
      EXPECT_LE(std::abs(angle), kPi);
      EXPECT_NEAR(std::remainder(angle - 1.0 - estimate.sensor.angular_velocity[k] * time, kTwoPi),
                  0.0, 1e-9);
    }
    EXPECT_FLOAT_EQ(recording.shots.angle_covariance[0][i], 1e-8F * static_cast<float>(i / 10 + 1));
    EXPECT_FLOAT_EQ(recording.shots.angle_covariance[1][i], -2e-9F);
    EXPECT_FLOAT_EQ(recording.shots.angle_covariance[2][i], 3e-8F);
  }
}

TEST(RangedRecording, LeavesOutWhatHasNoRangeOrNoDirection) {
  estimation::Estimate estimate = some_estimate();
  estimate.series.change([](estimation::AngleSeries& rows) {
    rows.range[3] = kNaN;
    rows.range[4] = 0.0;
    rows.range[199] = -1.0;
  });
  estimate.outlier[3] = 1;  // counted as one without range
  estimate.outlier[10] = 1;
  estimate.outlier[11] = 1;
  estimate.trajectory.last_shot[5] -= 4;  // four shots of the sixth knot were not used
  const RangedRecording recording = ranged_recording(estimate, "one.lvx", "");
  EXPECT_EQ(recording.without_range, 3u);
  EXPECT_EQ(recording.outliers, 6u);
  const std::size_t left = kShots - 9;
  EXPECT_EQ(recording.time_ns.size(), left);
  EXPECT_EQ(recording.shots.size(), left);
  for (const auto& column : recording.shots.rotation_angle) EXPECT_EQ(column.size(), left);
  for (const auto& column : recording.shots.angle_covariance) EXPECT_EQ(column.size(), left);
  // Rows stay together.
  for (std::size_t i = 0; i < left; ++i) {
    const auto shot = static_cast<std::size_t>((recording.time_ns[i] - 1'000'000'000) / 200'000);
    EXPECT_EQ(recording.shots.range[i], 10.0 + 0.01 * static_cast<double>(shot));
    EXPECT_NEAR(
        std::remainder(recording.shots.rotation_angle[0][i] - 1.0 -
                           estimate.sensor.angular_velocity[0] * 2e-4 * static_cast<double>(shot),
                       kTwoPi),
        0.0, 1e-9);
  }
}

TEST(RangedRecording, RefusesWhatIsNoEstimateWithRanges) {
  const auto error_of = [](const estimation::Estimate& estimate) {
    return refusal<EstimationError>([&] { ranged_recording(estimate, "one.lvx", ""); });
  };
  estimation::Estimate estimate = some_estimate();
  estimate.converged = false;
  estimate.reason = "it did not settle";
  EXPECT_THAT(error_of(estimate), AllOf(NamesField("one.lvx"), NamesField("it did not settle")));
  estimate = some_estimate();
  estimate.series.change([](estimation::AngleSeries& rows) { rows.range.clear(); });
  EXPECT_THAT(error_of(estimate), AllOf(NamesField("one.lvx"), NamesField("ranges")));
  estimate = some_estimate();
  estimate.common_angles.reset();
  EXPECT_THAT(error_of(estimate), NamesField("one.lvx"));
  estimate = some_estimate();
  estimate.series.change([](estimation::AngleSeries& rows) { rows.range.assign(kShots, 0.0); });
  EXPECT_THAT(error_of(estimate), NamesField("one.lvx"));
}

}  // namespace risley::calibration::plane_points_test
