// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/flight_start.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "calibration/flights.hpp"

namespace risley::calibration::flight_start_test {

using Eigen::Index;
using Eigen::MatrixXd;
using testing::FlightSettings;
using testing::SimulatedFlight;

FlightSettings tiny_flight() {
  FlightSettings settings;
  settings.ground = testing::Ground::flat;
  settings.strip_length = 10;
  settings.shot_rate = 100;
  return settings;
}

// Walls leave the direction that all beams share open and tie it to single angles: a prior without
// its correlations would be another one.
TEST(FlightStart, ACalibrationOnWallsIsAPriorWithAllItsCovariance) {
  const SimulatedFlight flight(tiny_flight());
  FlightCalibrationOptions options = flight.options();
  options.sensor.covariance_names = {"incident_beam_vertical_deg", "bearing_tilt_a_vertical_deg",
                                     "range_offset_m"};
  const double degree = radians_from_degrees(1);
  MatrixXd walls(3, 3);
  walls << 0.04, 0.0198, 0, 0.0198, 0.01, 0, 0, 0, 0;
  walls *= degree * degree;
  walls(2, 2) = 9e-6;
  walls(0, 2) = walls(2, 0) = 0.3 * 0.2 * degree * 3e-3;
  walls(1, 2) = walls(2, 1) = 0.3 * 0.1 * degree * 3e-3;
  options.sensor.covariance = walls;
  const FlightStart start = flight_start(options, flight.trajectory);
  const std::vector<std::string> names = unknown_names(start.model);
  std::vector<Index> at;
  for (const std::string& name : options.sensor.covariance_names) {
    const auto found = std::ranges::find(names, name);
    ASSERT_NE(found, names.end()) << name;
    at.push_back(found - names.begin());
  }
  const MatrixXd covariance = start.priors.information.inverse();
  for (Index i = 0; i < 3; ++i) {
    for (Index j = 0; j < 3; ++j) {
      EXPECT_NEAR(covariance(at[i], at[j]), walls(i, j),
                  1e-6 * std::sqrt(walls(i, i) * walls(j, j)));
    }
    EXPECT_NEAR(start.prior_sigma[at[i]], std::sqrt(walls(i, i)), 1e-12);
  }
  // The others keep theirs: 0.3 degree, and what the mount states.
  const auto other = std::ranges::find(names, "prism_tilt_b_vertical_deg");
  ASSERT_NE(other, names.end());
  EXPECT_NEAR(start.prior_sigma[other - names.begin()], 0.3 * degree, 1e-9);
  EXPECT_EQ(start.prior_sigma[FlightUnknowns::lever_arm(2)], 0.01);
}

}  // namespace risley::calibration::flight_start_test
