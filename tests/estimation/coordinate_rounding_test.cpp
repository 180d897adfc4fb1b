// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/coordinate_rounding.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "risley/estimation/estimate.hpp"
#include "risley/estimation/frame_turn.hpp"

#include "estimation/series.hpp"

namespace risley::estimation::coordinate_rounding_test {

constexpr double kStep = 0.001;  // m

double rounded(double value) { return kStep * std::round(value / kStep); }
double cut_off(double value) { return kStep * std::trunc(value / kStep); }

/// What a record of whole millimetres leaves of shots in a hall.
AngleSeries recorded(AngleSeries series, double (*whole)(double), const Eigen::Matrix3d& frame) {
  for (std::size_t i = 0; i < series.size(); ++i) {
    const auto v = direction_from_angles<double>({series.azimuth[i], series.zenith[i]});
    const double range = 3.0 / std::max(0.05, std::abs(v.y) + std::abs(v.z));
    Eigen::Vector3d point = range * (frame * Eigen::Vector3d(v.x, v.y, v.z));
    for (double& coordinate : point) coordinate = whole(coordinate);
    const auto angles = angles_from_direction(Vector3<double>{point.x(), point.y(), point.z()});
    series.azimuth[i] = angles.azimuth;
    series.zenith[i] = angles.zenith;
    series.range.push_back(point.norm());
    const double variance = std::pow(kStep / point.norm(), 2) / 12.0;
    series.zenith_rounding_variance[i] = static_cast<float>(variance);
    series.azimuth_rounding_variance[i] =
        static_cast<float>(variance / std::pow(std::sin(angles.zenith), 2));
  }
  return series;
}

Estimate estimate_of(const AngleSeries& series) {
  EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.cartesian = true;
  return estimate(Method::map, series, series, options);
}

TEST(CoordinateRounding, IsReadOffTheData) {
  const auto sensor = sensors::load_sensor("mid-40-table3");
  const AngleSeries exact =
      testing::constant_speed_series(sensor, 0.5, 2.5, 0.2, 50000.0, 0.001, 2);
  for (const FrameTurn& frame : {FrameTurn{}, FrameTurn{0.6, 0.1}}) {
    const Eigen::Matrix3d rotation = recording_from_sensor(frame);
    const Estimate to_nearest = estimate_of(recorded(exact, rounded, rotation));
    EXPECT_TRUE(to_nearest.converged) << to_nearest.reason;
    EXPECT_EQ(to_nearest.coordinates, CoordinateRounding::nearest);
    const Estimate to_zero = estimate_of(recorded(exact, cut_off, rotation));
    EXPECT_TRUE(to_zero.converged) << to_zero.reason;
    EXPECT_EQ(to_zero.coordinates, CoordinateRounding::toward_zero);
    // Half a step added back takes the bias away.
    for (const Estimate* estimate : {&to_nearest, &to_zero}) {
      for (std::size_t i = 0; i < estimate->free.size(); ++i) {
        const EstimatedValue& value = estimate->values[i];
        EXPECT_LT(std::abs(value.value - sensor.get(value.name)), 4.5 * value.sigma_given_held)
            << value.name;
      }
    }
  }
}

TEST(CoordinateRounding, IsUnknownWhereItDoesNotMatter) {
  const auto sensor = sensors::load_sensor("mid-40");
  AngleSeries series = testing::constant_speed_series(sensor, 0.5, 2.5, 0.2, 2000.0, 0.01, 2);
  series.range.assign(series.size(), 100.0);
  EXPECT_EQ(estimate_of(series).coordinates, CoordinateRounding::unknown);
  EXPECT_EQ(half_step_signal(series, 1e-4), 0.0);
}

TEST(CoordinateRounding, HalfStepsAreAddedAwayFromZero) {
  AngleSeries series;
  const Vector3<double> point{2.0, -0.003, 0.0};
  const auto angles = angles_from_direction(point);
  const auto variance = static_cast<float>(std::pow(kStep / norm(point), 2) / 12.0);
  series.append(0, angles.azimuth, angles.zenith, 0, variance, variance);
  series.append(1, 0.1, 1.5, 0, variance, variance);
  series.range = {norm(point), std::nan("")};
  add_half_steps(series, Eigen::Matrix3d::Identity());
  const Vector3<double> moved =
      series.range[0] * direction_from_angles<double>({series.azimuth[0], series.zenith[0]});
  EXPECT_NEAR(moved.x, 2.0005, 1e-7);
  EXPECT_NEAR(moved.y, -0.0035, 1e-7);
  EXPECT_NEAR(moved.z, 0.0, 1e-7);    // may have been either sign
  EXPECT_EQ(series.azimuth[1], 0.1);  // no range: nothing is known of its coordinates
}

}  // namespace risley::estimation::coordinate_rounding_test
