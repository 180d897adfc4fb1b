// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Trains that fit and are none.
#include "risley/identification/soundness.hpp"

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::identification::soundness_test {

/// A Mid-40, with a sigma of its second wedge.
Identification found_mid_40(double wedge_sigma_deg) {
  Identification found;
  Hypothesis& best = found.hypotheses.emplace_back();
  const sensors::Sensor sensor = sensors::load_sensor("mid-40");
  best.fit.model.train = sensor.train;
  best.fit.names = {"wedge_angle_b_deg"};
  const double sigma = radians_from_degrees(wedge_sigma_deg);
  best.fit.covariance = best.total_covariance = Eigen::MatrixXd::Constant(1, 1, sigma * sigma);
  best.fit.model.rotors = RotorCurves(2, 0, 1, 1, 1, true);
  found.correlation_time_factor = 1;
  return found;
}

TEST(Soundness, ATrainHasToBePossible) {
  sensors::Sensor sensor = sensors::load_sensor("mid-40");
  EXPECT_EQ(doubt_of(found_mid_40(0.01), sensor).words, "");
  const int tilt = find_parameter("prism_tilt_b_vertical_deg", sensor.shape()).places.front();
  sensor.train.set_place(tilt, radians_from_degrees(35.6));
  EXPECT_TRUE(doubt_of(found_mid_40(0.01), sensor).refuted);
}

TEST(Soundness, APrismHasToBeSeen) {
  const sensors::Sensor sensor = sensors::load_sensor("mid-40");
  const Doubt doubt = doubt_of(found_mid_40(10.0), sensor);
  EXPECT_NE(doubt.words, "");
  EXPECT_FALSE(doubt.refuted);
}

TEST(Soundness, WhatIsLeftHasToBeNoise) {
  const sensors::Sensor sensor = sensors::load_sensor("mid-40");
  Identification found = found_mid_40(0.01);
  found.correlation_time_factor = 1.5;
  EXPECT_EQ(doubt_of(found, sensor).words, "");
  found.correlation_time_factor = 7;
  EXPECT_NE(doubt_of(found, sensor).words, "");
  EXPECT_FALSE(doubt_of(found, sensor).refuted);
}

}  // namespace risley::identification::soundness_test
