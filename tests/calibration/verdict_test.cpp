// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What a calibration comes to.
#include "calibration/verdict.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/sensors/preset.hpp"

#include "refusal.hpp"

namespace risley::calibration::verdict_test {

using ::testing::EndsWith;

constexpr double kDegree = 0.017453292519943295;

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
  c.rms_after = 1.01 * c.rms_before;
  c.shape.sigma = 0.3 * c.rms_before;  // walls that wave may be thicker about the right plane
  EXPECT_EQ(code_of(c), "bent");
  c.shape.sigma = 0.1 * c.rms_before;
  EXPECT_EQ(code_of(c), "not_better");
  c = moved_by(0.0);
  c.rms_after = 1.01 * c.rms_before;  // by chance
  EXPECT_EQ(code_of(c), "as_believed");
}

TEST(Verdict, RangesOfNoStatedUnitHaveToScatterAsTheSensorsDo) {
  Calibration c = moved_by(1e-3);
  c.sensor = sensors::load_sensor("mid-40");
  RangedRecording recording;
  for (const double sigma0 : {0.1, 0.3, 3.1, 10.0}) {
    c.sigma0 = sigma0;
    recording.unit_assumed = false;
    EXPECT_EQ(reason_of_ranges(c, {recording}, 0.02), "");
    recording.unit_assumed = true;
    EXPECT_NE(reason_of_ranges(c, {recording}, 0.02), "");
  }
  for (const double sigma0 : {0.35, 1.0, 2.9}) {
    c.sigma0 = sigma0;
    EXPECT_EQ(reason_of_ranges(c, {recording}, 0.02), "");
  }
}

TEST(Verdict, WhatWasHeldMayExplainAChange) {
  Calibration c = moved_by(1e-4);
  EXPECT_EQ(code_of(c), "bent");
  // Both tilts follow one held quantity.
  c.held = {"wedge_angle_deg"};
  c.held_changes = Eigen::Vector2d::Constant(1e-4);
  EXPECT_EQ(code_of(c), "as_believed");
  // No error of it moves them apart.
  c.parameters[1] = -c.parameters[0];
  EXPECT_EQ(code_of(c), "bent");
}

TEST(Verdict, AnErrorWithinTheToleranceIsNotBent) {
  Calibration c = moved_by(1e-3);
  c.pointing_error.errors.total = 0.0075 * kDegree;
  c.pointing_error.total_sigma = 0.001 * kDegree;
  EXPECT_EQ(code_of(c), "bent");  // without a tolerance every error that is there counts
  c.tolerance = 0.1 * kDegree;
  EXPECT_EQ(code_of(c), "off_within_tolerance");
  EXPECT_THAT(verdict_of(c).words, NamesField("0.0075 ± 0.0010 degree"));
  EXPECT_THAT(verdict_of(c).words, EndsWith("; that is within the tolerance of 0.1 degree"));
  EXPECT_TRUE(improves(verdict_of(c).code));
  c.pointing_error.errors.total = 0.15 * kDegree;
  EXPECT_EQ(code_of(c), "bent");
  EXPECT_THAT(verdict_of(c).words, EndsWith("; that is beyond the tolerance of 0.1 degree"));
  // Chance decides what does not differ from what is believed, not the tolerance.
  Calibration believed = moved_by(2.55e-5);
  believed.tolerance = 1e-9;
  EXPECT_EQ(code_of(believed), "as_believed");
  EXPECT_FALSE(improves(verdict_of(believed).code));
}

TEST(Verdict, SaysHowProbableItIsThatTheErrorIsBeyondTheTolerance) {
  Calibration c = moved_by(1e-3);
  c.tolerance = 0.1 * kDegree;
  c.pointing_error.errors.total = 0.08 * kDegree;
  c.pointing_error.total_sigma = 0.02 * kDegree;
  EXPECT_EQ(code_of(c), "off_within_tolerance");
  EXPECT_THAT(verdict_of(c).words,
              EndsWith("within the tolerance of 0.1 degree, with a probability of 0.84"));
  c.pointing_error.errors.total = 0.12 * kDegree;
  EXPECT_EQ(code_of(c), "bent");
  EXPECT_THAT(verdict_of(c).words,
              EndsWith("beyond the tolerance of 0.1 degree, with a probability of 0.84"));
  EXPECT_DOUBLE_EQ(beyond_probability(1, 0.5, 1), 0.5);
  EXPECT_NEAR(beyond_probability(2, 0.5, 1), 0.97725, 1e-5);
  EXPECT_EQ(beyond_probability(2, 0, 1), 1);
  EXPECT_EQ(beyond_probability(0.5, 0, 1), 0);
}

TEST(Verdict, WallsThatTellLessThanTheToleranceConfirmNothing) {
  Calibration c = moved_by(0.0);
  c.tolerance = 0.1 * kDegree;
  c.datum.total = 0.09 * kDegree;
  EXPECT_EQ(code_of(c), "as_believed");
  c.datum.total = 0.3 * kDegree;
  EXPECT_EQ(code_of(c), "undecided");
  EXPECT_THAT(verdict_of(c).words, NamesField("tolerance of 0.1 degree"));
  EXPECT_THAT(verdict_of(c).to_do, NamesField("180 degrees"));
}

TEST(Verdict, SaysByHowMuchDirectionsAreOff) {
  Calibration c = moved_by(1e-3);
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
  EXPECT_THAT(verdict_of(c).to_do, NamesField("180 degrees"));
  PriorTest test;
  test.name = "flipped";
  test.station = true;
  test.chi2 = 100;
  test.degrees_of_freedom = 2;
  test.critical = 18.4;
  c.prior_tests = {test};
  EXPECT_THAT(verdict_of(c).to_do, NamesField("normals"));
}

/// The incident beam, known to 1e-5 rad, moved by so much, with the eight unknowns of the mount
/// held.
FlightCalibration flown(double change) {
  FlightCalibration c;
  c.converged = true;
  c.model.train = sensors::load_sensor("mid-40").train;
  c.model.free = estimation::free_parameters({"incident_beam_vertical_deg"}, c.model.train.shape());
  const auto count = FlightUnknowns::parameter(1);
  c.unknowns.resize(count);
  for (FlightUnknown& own : c.unknowns) own.held = true;
  FlightUnknown& beam = c.unknowns.back();
  beam.held = false;
  beam.name = c.model.free.front().name;
  beam.start = c.model.train.get(beam.name);
  beam.value = beam.start + change;
  c.model.train.set_place(c.model.free.front().places.front(), beam.value);
  c.covariance = 1e-10 * Eigen::MatrixXd::Identity(count, count);
  c.rms_before = 0.02;
  c.rms_after = 0.01;
  c.pointing_error = pointing_error_of(c);
  return c;
}

TEST(Verdict, FlightsHaveTheSameCodes) {
  EXPECT_EQ(verdict_of(flown(1e-5)).code, CalibrationCode::as_believed);
  FlightCalibration c = flown(0.01);
  EXPECT_EQ(verdict_of(c).code, CalibrationCode::bent);
  // It turns all beams alike, to a twentieth.
  EXPECT_NEAR(c.pointing_error.errors.total, 0.01, 5e-4);
  EXPECT_NEAR(c.pointing_error.total_sigma, 1e-5, 1e-6);
  EXPECT_LT(c.pointing_error.errors.shape, 1e-3);
  c.tolerance = 1.01 * c.pointing_error.errors.total;
  EXPECT_EQ(verdict_of(c).code, CalibrationCode::off_within_tolerance);
  EXPECT_THAT(verdict_of(c).words, NamesField("tolerance"));
  c.tolerance = 0.99 * c.pointing_error.errors.total;
  EXPECT_EQ(verdict_of(c).code, CalibrationCode::bent);
  // A rotation of all beams that may be the boresight's does not convict.
  c.pointing_error.total_sigma = c.pointing_error.errors.total;
  EXPECT_EQ(verdict_of(c).code, CalibrationCode::off_within_tolerance);
  EXPECT_THAT(verdict_of(c).words, NamesField("shape is within the tolerance"));
  c.rms_after = c.rms_before;
  EXPECT_EQ(verdict_of(c).code, CalibrationCode::not_better);
}

}  // namespace risley::calibration::verdict_test
