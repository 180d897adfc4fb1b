// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// RISLEY_SEEDS=20 makes the Monte Carlo of so many flights.
#include "risley/calibration/flight_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "risley/core/angle.hpp"

#include "calibration/flights.hpp"
#include "refusal.hpp"
#include "seeds.hpp"
#include "warning_codes.hpp"

namespace risley::calibration::flight_calibration_test {

using Eigen::Index;
using testing::FlightErrors;
using testing::FlightSettings;
using testing::SimulatedFlight;

std::string failure(const SimulatedFlight& flight, const FlightCalibrationOptions& options) {
  return refusal<Error>([&] { calibrate_flight(flight.shots, flight.trajectory, options); });
}

/// A short flight with few shots: finds what a full one does, less well.
FlightSettings short_flight() {
  FlightSettings settings;
  settings.strip_length = 40;
  settings.shot_rate = 2500;
  return settings;
}

TEST(FlightCalibration, FindsMountAndPrismsFromDegreesOff) {
  const int seeds = testing::seeds_or(1);
  double nees = 0, total = 0, stated = 0;
  int flights = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    for (const bool far : {false, true}) {
      FlightSettings settings = short_flight();
      settings.seed = static_cast<std::uint64_t>(seed);
      if (far) settings.boresight_deg = {6, 5, -5};
      const SimulatedFlight flight(settings);
      FlightCalibrationOptions options = flight.options();
      options.coarse_shots = 40000;
      options.knot_spacing = 0.5;
      const FlightCalibration found = calibrate_flight(flight.shots, flight.trajectory, options);
      EXPECT_TRUE(found.converged) << found.reason;
      const FlightErrors errors = flight_errors(flight, settings, found);
      // Five sigmas; it began at 2.7 and 9.3 degrees.
      EXPECT_LT(errors.total, 5 * found.datum.total) << "seed " << seed;
      EXPECT_LT(errors.shape, 5 * found.datum.shape) << "seed " << seed;
      EXPECT_LT(found.datum.total, radians_from_degrees(0.012));
      EXPECT_LT(found.datum.shape, radians_from_degrees(0.003));
      EXPECT_NEAR(found.sigma0, 1, 0.05);
      EXPECT_NEAR(found.datum.height, 82, 6);
      EXPECT_GT(found.rms_before, 0.3);
      EXPECT_LT(found.rms_after, 0.012);
      nees += errors.nees;
      total += errors.total * errors.total;
      stated += found.datum.total * found.datum.total;
      ++flights;
    }
  }
  // Of 16 unknowns a flight.
  const double spread = std::sqrt(2.0 / (16 * flights));
  EXPECT_GT(nees / flights, 0.8 - 3 * spread);
  EXPECT_LT(nees / flights, 1.25 + 3 * spread);
  EXPECT_LT(total / stated, 1.3 + 3 * std::sqrt(2.0 / (2 * flights)));
}

TEST(FlightCalibration, CorrectsTheTrajectory) {
  FlightSettings settings = short_flight();
  const SimulatedFlight flight(settings);
  FlightCalibrationOptions options = flight.options();
  options.coarse_shots = 40000;
  options.many_shots = 60000;
  options.knot_spacing = 0.5;
  const FlightCalibration found = calibrate_flight(flight.shots, flight.trajectory, options);
  ASSERT_EQ(found.trajectory.size(), flight.trajectory.size());
  double before = 0, after = 0;
  for (std::size_t i = 0; i < flight.trajectory.size(); ++i) {
    const double time =
        1e-9 * static_cast<double>(flight.trajectory.time_ns[i] - 1'300'000'000'000'000'000);
    Eigen::Vector3d position;
    Eigen::Matrix3d attitude;
    flight.pose(time, position, attitude);
    const Eigen::Quaterniond truth(attitude);
    before += std::pow(flight.trajectory.attitude[i].angularDistance(truth), 2);
    after += std::pow(found.trajectory.attitude[i].angularDistance(truth), 2);
  }
  EXPECT_LT(after, 0.5 * before);
  // What is written down belongs to what was found.
  const Eigen::VectorXd values = unknown_values(found.model);
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(found.mount.boresight[k].value, values[k]);
    EXPECT_EQ(found.mount.lever_arm[k].sigma, found.unknowns[3 + k].sigma);
  }
  EXPECT_EQ(found.mount.clock_offset.value, found.model.clock_offset);
  EXPECT_EQ(found.sensor.covariance.rows(), std::ssize(found.sensor.covariance_names));
  // Mount and sensor are known together: yaw of the boresight against yaw of the beams above all.
  const algebra::NamedCovariance of_sensor{found.sensor.covariance_names, found.sensor.covariance};
  EXPECT_TRUE(trajectories::found_together(found.mount, of_sensor));
  trajectories::require_mount(found.mount);
  const algebra::NamedCovariance& joint = found.mount.covariance;
  const Index yaw = joint.find("boresight_z_deg"),
              beam = joint.find("incident_beam_horizontal_deg");
  ASSERT_GE(std::min(yaw, beam), 0);
  EXPECT_GT(std::abs(joint.matrix(yaw, beam)),
            0.5 * std::sqrt(joint.matrix(yaw, yaw) * joint.matrix(beam, beam)));
  EXPECT_EQ(joint.matrix(yaw, beam), found.covariance(2, [&] {
    for (std::size_t i = 0; i < found.unknowns.size(); ++i) {
      if (found.unknowns[i].name == "incident_beam_horizontal_deg") return static_cast<Index>(i);
    }
    return Index{-1};
  }()));
  EXPECT_EQ(found.correction_sigma.cols(), found.model.corrections.cols());
  EXPECT_LT(found.correction_sigma.maxCoeff(), 0.031);
  EXPECT_FALSE(found.pairs_after.empty());
  EXPECT_FALSE(found.piece_rms.empty());
}

/// Whether nothing undetermined contains the word.
bool determined(const FlightCalibration& found, const std::string& word) {
  return std::ranges::none_of(found.not_told, [&](const NotTold& own) {
    return own.words.find(word) != std::string::npos;
  });
}

TEST(FlightCalibration, NamesWhatALevelFlightDoesNotTell) {
  FlightSettings settings = short_flight();
  settings.attitude_rms_deg = 0.01;
  settings.headings_deg = {90, 270};
  for (const bool flat : {true, false}) {
    settings.ground = flat ? testing::Ground::flat : testing::Ground::village;
    const SimulatedFlight flight(settings);
    FlightCalibrationOptions options = flight.options();
    options.coarse_shots = 40000;
    options.knot_spacing = 2;
    const FlightCalibration found = calibrate_flight(flight.shots, flight.trajectory, options);
    EXPECT_FALSE(determined(found, "lever_arm_z_m"));
    EXPECT_FALSE(determined(found, "clock_offset_s"));  // against lever_arm_x_m
    EXPECT_TRUE(determined(found, "boresight_y_deg"));
    EXPECT_TRUE(determined(found, "boresight_z_deg"));
    EXPECT_GT(found.unknowns[FlightUnknowns::lever_arm(2)].prior_share, 0.8);
    EXPECT_LT(found.unknowns[1].prior_share, 0.01);
    const double off = flight_errors(flight, settings, found).error[0];
    EXPECT_LT(std::abs(off), 4 * found.unknowns[0].sigma);
    // Flat ground says next to nothing of the yaw; roofs give its sum with the heading.
    if (flat) {
      EXPECT_GT(found.unknowns[0].sigma, 0.3 * found.unknowns[0].prior_sigma);
    } else {
      EXPECT_FALSE(determined(found, "heading"));
    }
  }
}

// Cells that lean by chance seem to determine shifts across them, and the yaw to 0.3 degree.
TEST(FlightCalibration, FlatGroundTellsOfTheYawWhatItStates) {
  const int seeds = testing::seeds_or(4);
  double squares = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    FlightSettings settings = short_flight();
    settings.ground = testing::Ground::flat;
    settings.strip_length = 60;
    settings.attitude_rms_deg = 0.01;
    settings.headings_deg = {90, 270};
    settings.seed = static_cast<std::uint64_t>(seed);
    const SimulatedFlight flight(settings);
    FlightCalibrationOptions options = flight.options();
    options.coarse_shots = 40000;
    const FlightCalibration found = calibrate_flight(flight.shots, flight.trajectory, options);
    EXPECT_TRUE(found.converged) << found.reason;
    const double off = flight_errors(flight, settings, found).error[0];
    squares += std::pow(off / found.unknowns[0].sigma, 2);
  }
  EXPECT_LT(squares / seeds, 1 + 3 * std::sqrt(2.0 / seeds));
}

TEST(FlightCalibration, DoesNotDependOnThreads) {
  FlightSettings settings = short_flight();
  settings.strip_length = 25;
  settings.shot_rate = 1000;
  const SimulatedFlight flight(settings);
  FlightCalibrationOptions options = flight.options();
  options.knot_spacing = 2;
  options.cell_size = 3;
  const auto run = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return calibrate_flight(flight.shots, flight.trajectory, options);
  };
  const FlightCalibration one = run(1), four = run(4);
  EXPECT_EQ(unknown_values(one.model), unknown_values(four.model));
  EXPECT_EQ(one.covariance, four.covariance);
}

/// A place of the village's level ground, at least 12 m from its houses.
Eigen::Vector3d level_place(const SimulatedFlight& flight, double east, double north) {
  for (double step = 0;; step += 0.7) {
    const Eigen::Vector2d at(east + step * std::cos(step), north + step * std::sin(step));
    if (std::ranges::all_of(flight.roofs, [&](const testing::Roof& roof) {
          return (roof.centre - at).norm() > 9;
        })) {
      return {at.x(), at.y(), 0};
    }
  }
}

scenes::KnownGround known_ground(const char* name, const Eigen::Vector3d& place) {
  scenes::KnownGround ground;
  ground.name = name;
  ground.place = {place.x(), place.y(), place.z()};
  ground.sigma = 0.004;
  ground.radius = 1.5;
  return ground;
}

/// Mean height of level ground as a calibration sees it; truly 0.
double seen_height(const FlightCalibration& found) {
  double sum = 0, count = 0;
  for (const GroundPlane& plane : found.model.planes) {
    if (plane.normal.z() < 0.9995) continue;
    sum += plane.centre.z() + found.tangent.origin.z();
    ++count;
  }
  return sum / count;
}

// Nothing else determines the mean height of a flight, nor the lever arm's.
TEST(FlightCalibration, KnownGroundFixesTheHeight) {
  FlightSettings settings = short_flight();
  settings.seed = 5;
  settings.shot_rate = 1500;
  *settings.errors.terms[2].sigma = 0.1;  // heights are a decimetre off
  const SimulatedFlight flight(settings);
  FlightCalibrationOptions options = flight.options();
  options.coarse_shots = 20000;
  options.knot_spacing = 2;
  const auto point = [&](const char* name, double east, double north) {
    const Eigen::Vector3d at = level_place(flight, east, north);
    return known_ground(name, {at.x(), at.y(), 0});
  };
  const testing::Roof& roof = flight.roofs.front();
  const Eigen::Vector3d normal = roof.normal();
  const Eigen::Vector2d across(-roof.along.y(), roof.along.x());
  const Eigen::Vector2d middle = roof.centre + 0.5 * roof.width * roof.side * across;
  const FlightCalibration alone = calibrate_flight(flight.shots, flight.trajectory, options);
  EXPECT_TRUE(alone.control.empty());
  options.control = {point("yard", 6, -4), point("field", -12, 10)};
  options.control.push_back(
      known_ground("roof", {middle.x(), middle.y(), roof.height - 0.5 * roof.width * roof.slope}));
  options.control.back().normal = Vector3<double>{normal.x(), normal.y(), normal.z()};
  options.control.back().normal_sigma = 1e-3;
  options.control.push_back(known_ground("far away", {4000, 0, 0}));
  const FlightCalibration fixed = calibrate_flight(flight.shots, flight.trajectory, options);
  ASSERT_EQ(fixed.control.size(), 4U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_TRUE(fixed.control[i].used) << fixed.control[i].name;
    EXPECT_GT(fixed.control[i].shots, 20U);
    EXPECT_LT(std::abs(fixed.control[i].off), 4 * fixed.control[i].sigma);
    EXPECT_FALSE(fixed.control[i].significant);
  }
  EXPECT_FALSE(fixed.control[3].used);
  EXPECT_EQ(fixed.control[3].shots, 0U);
  EXPECT_EQ(fixed.warnings.size(), alone.warnings.size() + 1);
  EXPECT_EQ(fixed.warnings.front().code, kWarning.control_doubtful);
  EXPECT_GT(std::abs(seen_height(alone)), 0.02);
  EXPECT_LT(std::abs(seen_height(fixed)), 0.008);
  // The corrections' mean height is known as well as the ground is.
  EXPECT_LT(fixed.correction_sigma.row(2).mean(), 0.3 * alone.correction_sigma.row(2).mean());
  const FlightErrors errors = flight_errors(flight, settings, fixed);
  EXPECT_LT(errors.total, 4 * fixed.datum.total);

  options.control[1].place.z += 0.3;  // a blunder
  const FlightCalibration fooled = calibrate_flight(flight.shots, flight.trajectory, options);
  EXPECT_TRUE(fooled.control[1].significant);
  EXPECT_LT(fooled.control[1].off, -5 * fooled.control[1].sigma);
  EXPECT_THAT(codes_of(fooled.warnings), ::testing::Contains("control_doubtful"));
}

TEST(FlightCalibration, HoldsWhatIsStatedToBeExact) {
  FlightSettings settings = short_flight();
  settings.strip_length = 25;
  settings.shot_rate = 1000;
  const SimulatedFlight flight(settings);
  FlightCalibrationOptions options = flight.options();
  options.knot_spacing = 2;
  options.cell_size = 3;
  options.mount.lever_arm[2].sigma = 0;
  options.range_offset_sigma = 0;
  options.fixed = {"prism_tilt_a_vertical_deg"};
  const FlightCalibration found = calibrate_flight(flight.shots, flight.trajectory, options);
  EXPECT_EQ(found.model.lever_arm[2], options.mount.lever_arm[2].value);
  EXPECT_EQ(found.model.range_offset, options.sensor.range_offset);
  EXPECT_EQ(found.sensor.get("prism_tilt_a_vertical_deg"), 0);
  EXPECT_TRUE(found.unknowns[FlightUnknowns::lever_arm(2)].held);
  EXPECT_EQ(found.mount.lever_arm[2].source, "tape");
}

// 20 ppm are 1.3 ms at either end of two minutes: pixels of boresight in a flight that sways.
TEST(FlightCalibration, TellsAClockThatDrifts) {
  const int seeds = testing::seeds_or(2);
  double squares = 0;
  int flights = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    for (const double drift : {0.0, 20e-6, -20e-6}) {
      FlightSettings settings = short_flight();
      settings.seed = static_cast<std::uint64_t>(seed);
      settings.clock_drift = drift;
      const SimulatedFlight flight(settings);
      FlightCalibrationOptions options = flight.options();
      options.coarse_shots = 40000;
      options.knot_spacing = 0.5;
      const FlightCalibration found = calibrate_flight(flight.shots, flight.trajectory, options);
      const ClockDrift& clock = found.clock_drift;

      EXPECT_EQ(clock.significant, drift != 0) << "seed " << seed;
      EXPECT_NEAR(clock.value, drift, 2e-6) << "seed " << seed;
      EXPECT_EQ(std::ranges::count(codes_of(found.warnings), "clocks_disagree"), drift != 0);
      EXPECT_EQ(found.verdict.code == CalibrationCode::undecided, drift != 0);
      if (drift != 0) continue;
      squares += std::pow(clock.value / clock.sigma, 2);
      ++flights;
    }
  }
  EXPECT_LT(squares / flights, 1 + 3 * std::sqrt(2.0 / flights));
}

TEST(FlightCalibration, FailsInWords) {
  FlightSettings settings = short_flight();
  settings.strip_length = 15;
  settings.shot_rate = 500;
  const SimulatedFlight flight(settings);
  const FlightCalibrationOptions options = flight.options();
  SimulatedFlight other = flight;
  for (auto& time : other.shots.time_ns) time += 604'800'000'000'000;  // a week
  const std::string week_apart = failure(other, options);
  EXPECT_NE(week_apart.find("share no time"), std::string::npos) << week_apart;
  EXPECT_NE(week_apart.find("a week apart"), std::string::npos) << week_apart;
  other = flight;  // a record here and there, in the turns
  for (auto& time : other.shots.time_ns) time = other.shots.time_ns.front() + 20'000'000'000;
  EXPECT_NE(failure(other, options).find("where the trajectory has a gap"), std::string::npos);
  other = flight;
  for (auto& strip : other.shots.strip) strip = 0;
  EXPECT_NE(failure(other, options).find("one strip"), std::string::npos);
  other = flight;  // strips that see different ground
  for (std::size_t i = 0; i < other.trajectory.size(); ++i) {
    other.trajectory.position[i].x() += 500 * static_cast<double>(i * 4 / other.trajectory.size());
  }
  EXPECT_NE(failure(other, options).find("cells"), std::string::npos);
  const auto refused = [&](const auto& damage) {
    FlightCalibrationOptions damaged = options;
    damage(damaged);
    return refusal([&] { calibrate_flight(flight.shots, flight.trajectory, damaged); });
  };
  EXPECT_NE(refused([](FlightCalibrationOptions& o) { o.knot_spacing = 0; }), "");
  EXPECT_NE(refused([](FlightCalibrationOptions& o) { o.cell_size = -1; }), "");
  EXPECT_NE(refused([](FlightCalibrationOptions& o) { o.errors.terms[2].sigma = -1; }), "");
  EXPECT_NE(refused([](FlightCalibrationOptions& o) { o.errors.terms[2].sigma.reset(); }), "");
  EXPECT_NE(refused([](FlightCalibrationOptions& o) { o.range_noise = -1; }), "");
  EXPECT_NE(refused([](FlightCalibrationOptions& o) { o.fixed = {"nonsense"}; }), "");
  EXPECT_NE(refused([](FlightCalibrationOptions& o) { o.mount.nominal *= 2; }), "");
  EXPECT_NE(refused([](FlightCalibrationOptions& o) { o.coarse_shots = 3; }), "");
  EXPECT_NE(refused([](FlightCalibrationOptions& o) {
              o.control = {known_ground("a", {0, 0, 0})};
              o.control.front().sigma = 0;
            }),
            "");
  other = flight;
  other.shots.rotation_angle.pop_back();
  EXPECT_NE(refusal([&] { calibrate_flight(other.shots, other.trajectory, options); }), "");
  other = flight;
  other.shots.beam.assign(other.shots.size(), 1);  // a second emitter, which a Mid-40 has not
  EXPECT_NE(refusal([&] { calibrate_flight(other.shots, other.trajectory, options); }), "");
}

}  // namespace risley::calibration::flight_calibration_test
