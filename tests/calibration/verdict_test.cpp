// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What a calibration comes to.
#include "calibration/verdict.hpp"

#include <string>

#include <gtest/gtest.h>

#include "risley/sensors/preset.hpp"

namespace risley::calibration::verdict_test {

/// Two tilts, each known to 1e-5 rad, moved by so much.
Calibration moved_by(double change) {
  Calibration c;
  c.converged = true;
  c.believed = sensors::load_sensor("mid-40").train;
  c.free = estimation::free_parameters({"prism_tilt_a_vertical_deg", "prism_tilt_b_vertical_deg"},
                                       c.believed.shape());
  c.parameters = Eigen::Vector2d::Constant(change);
  c.covariance = 1e-10 * Eigen::Matrix2d::Identity();
  c.rms_before = 0.010;
  c.rms_after = 0.009;
  return c;
}

std::string code_of(const Calibration& c) {
  const CalibrationVerdict verdict = verdict_of(c);
  EXPECT_FALSE(verdict.words.empty());
  EXPECT_FALSE(verdict.to_do.empty());
  return to_string(verdict.code);
}

TEST(Verdict, ParametersBeyondChanceAreBentWhereWallsGetFlatter) {
  // Chi2 of two degrees of freedom is above 13.8 once in a thousand times; the approximation
  // says 14.1.
  EXPECT_EQ(code_of(moved_by(2.55e-5)), "as_believed");
  EXPECT_EQ(code_of(moved_by(2.75e-5)), "bent");
  Calibration c = moved_by(1e-3);
  EXPECT_EQ(code_of(c), "bent");
  c.rms_after = c.rms_before;
  EXPECT_EQ(code_of(c), "not_better");
  c = moved_by(0.0);
  c.rms_after = 1.01 * c.rms_before;  // by chance
  EXPECT_EQ(code_of(c), "as_believed");
}

TEST(Verdict, SaysByHowMuchDirectionsAreOff) {
  Calibration c = moved_by(1e-3);
  constexpr double kDegree = 0.017453292519943295;
  c.pointing_error.errors.total = 0.4012 * kDegree;
  c.pointing_error.errors.gauge = 0.4003 * kDegree;
  c.pointing_error.errors.shape = 0.02304 * kDegree;
  c.pointing_error.total_sigma = c.pointing_error.gauge_sigma = 0.0015 * kDegree;
  c.pointing_error.worst_shape_sigma = c.pointing_error.shape_sigma = 0.0004 * kDegree;
  c.pointing_error.worst_shape = 0.0451 * kDegree;
  EXPECT_EQ(verdict_of(c).words,
            "reported directions are off by 0.4012 ± 0.0015 degree (21 cm at 30 m): 0.4003 ± "
            "0.0015 shared by all beams and 0.02304 ± 0.00040 in shape, 0.04510 at worst");
}

TEST(Verdict, ACalibrationThatMayWellBeWorseThanTheBeliefIsNotBetter) {
  Calibration c = moved_by(1e-3);
  c.better_probability = 0.992;
  EXPECT_EQ(code_of(c), "bent");
  c.better_probability = 0.98;
  EXPECT_EQ(code_of(c), "not_better");
}

TEST(Verdict, WhatDidNotConvergeIsUndecidedAndSaysWhy) {
  Calibration c = moved_by(0.0);
  c.converged = false;
  c.reason = "the walls do not determine";
  EXPECT_EQ(code_of(c), "undecided");
  EXPECT_EQ(verdict_of(c).words, c.reason);
}

}  // namespace risley::calibration::verdict_test
