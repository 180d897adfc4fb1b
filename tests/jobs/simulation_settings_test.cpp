// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/simulation_settings.hpp"

#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley::jobs {
namespace {

/// What an option is refused with; empty where it is not.
std::string refusal(const SimulationOptions& options) {
  try {
    simulation_settings(options);
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return {};
}

TEST(SimulationSettings, WhatTheSensorBelievesBeginsWithTheTruth) {
  SimulationOptions options;
  options.set = {{"wedge_angle_a_deg", 0.31}, {"prism_tilt_b_vertical_deg", 0.002}};
  options.reported = {{"wedge_angle_a_deg", 0.32}};
  const simulation::SimulationSettings settings = simulation_settings(options);
  EXPECT_EQ(settings.truth.get("wedge_angle_a_deg"), 0.31);
  ASSERT_TRUE(settings.reported.has_value());
  EXPECT_EQ(settings.reported->get("wedge_angle_a_deg"), 0.32);
  EXPECT_EQ(settings.reported->get("prism_tilt_b_vertical_deg"), 0.002);
}

TEST(SimulationSettings, ANominalSensorBelievesThatItHasNoErrorsButThoseSaid) {
  SimulationOptions options;
  options.set = {{"prism_tilt_b_vertical_deg", 0.002}};
  options.reported_nominal = true;
  options.reported = {{"prism_tilt_a_vertical_deg", 0.001}};
  const simulation::SimulationSettings settings = simulation_settings(options);
  ASSERT_TRUE(settings.reported.has_value());
  EXPECT_EQ(settings.reported->get("prism_tilt_b_vertical_deg"), 0);
  EXPECT_EQ(settings.reported->get("prism_tilt_a_vertical_deg"), 0.001);
}

TEST(SimulationSettings, RefusalsNameTheOption) {
  SimulationOptions options;
  options.set = {{"rotation_angle_a_deg", 0.1}};
  EXPECT_NE(refusal(options).find("option start_angles"), std::string::npos);
  options.set = {{"colour", 1}};
  EXPECT_NE(refusal(options).find("unknown parameter \"colour\""), std::string::npos);
  options = {};
  options.rate = 0;
  EXPECT_NE(refusal(options).find("rate = 0 Hz"), std::string::npos);
  options = {};
  options.clock_drift = 1e-6;
  EXPECT_EQ(refusal(options), "option clock_drift needs option trajectory or option flight");
  options.flight = "plan.yaml";
  EXPECT_NE(refusal(options).find("option mount is missing"), std::string::npos);
  options.mount = "mount.yaml";
  EXPECT_NE(refusal(options).find("option scene is missing"), std::string::npos);
  options.trajectory = "flown.csv";
  EXPECT_NE(refusal(options).find("cannot be combined"), std::string::npos);
}

}  // namespace
}  // namespace risley::jobs
