// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/flight_forecast.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/preset.hpp"

#include "calibration/flights.hpp"
#include "refusal.hpp"

namespace risley::calibration::flight_forecast_test {

using testing::FlightSettings;
using testing::SimulatedFlight;

/// Strips over the origin, 80 m high.
trajectories::FlightPlan plan_of(const std::vector<double>& headings_deg, double length,
                                 double sway_deg) {
  trajectories::FlightPlan plan;
  for (const double heading_deg : headings_deg) {
    trajectories::Strip strip;
    strip.name = std::to_string(static_cast<int>(heading_deg));
    strip.heading = radians_from_degrees(heading_deg);
    strip.length = length;
    strip.height = 80;
    strip.speed = 5;
    plan.strips.push_back(strip);
  }
  plan.turn_duration = 21;
  plan.seed = 11;
  if (sway_deg > 0) {
    plan.attitude = {{}, 0.15, 1.2, 6};
    plan.attitude.rms.fill(radians_from_degrees(sway_deg));
    plan.velocity = {{0.15, 0.15, 0.15}, 0.05, 0.4, 6};
  }
  return plan;
}

PlannedFlight flat_flight(const std::vector<double>& headings_deg, double length, double sway_deg) {
  PlannedFlight planned;
  planned.plan = plan_of(headings_deg, length, sway_deg);
  planned.terrain.ground = scenes::Ground{};
  return planned;
}

/// What the plain simulation calls a village, as a terrain.
scenes::TerrainParts terrain_of(const SimulatedFlight& flight) {
  scenes::TerrainParts parts;
  parts.ground = scenes::Ground{};
  for (std::size_t i = 0; i < flight.roofs.size(); i += 2) {  // two sides each
    const testing::Roof& side = flight.roofs[i];
    scenes::GableRoof roof;
    roof.name = "roof " + std::to_string(i / 2);
    roof.center = {side.centre.x(), side.centre.y()};
    roof.length = 2 * side.half_length;
    roof.pitch = std::atan(side.slope);
    roof.face_width = side.width / std::cos(roof.pitch);
    roof.ridge_height = side.height;
    roof.heading = std::atan2(side.along.x(), side.along.y());
    parts.roofs.push_back(roof);
  }
  return parts;
}

FlightForecastOptions options_for(double rate) {
  FlightForecastOptions options;
  options.rate = rate;
  FlightCalibrationOptions& own = options.calibration;
  own.sensor = sensors::load_sensor("mid-40");
  own.sensor.set_knowledge({"refractive_index", 1e-5, "its own estimate", 0});
  own.mount.nominal << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  const double lever[] = {0.10, 0.05, 0.12};
  for (std::size_t k = 0; k < 3; ++k) {
    own.mount.boresight[k] = {0, radians_from_degrees(3.0), "as built"};
    own.mount.lever_arm[k] = {lever[k], 0.01, "tape"};
  }
  own.mount.clock_offset = {0, 0.002, "PPS"};
  own.errors = FlightSettings{}.errors;
  own.knot_spacing = 0.5;
  return options;
}

TEST(FlightForecast, SaysWhatACalibrationStates) {
  for (const bool still : {false, true}) {
    FlightSettings settings;
    settings.strip_length = 60;
    settings.shot_rate = 2500;
    if (still) settings.attitude_rms_deg = 0.2;
    const SimulatedFlight flight(settings);
    FlightCalibrationOptions calibration = flight.options();
    calibration.knot_spacing = 0.5;
    calibration.coarse_shots = 40000;
    const FlightCalibration made = calibrate_flight(flight.shots, flight.trajectory, calibration);
    ASSERT_TRUE(made.converged) << made.reason;
    FlightForecastOptions options = options_for(settings.shot_rate);
    options.calibration.knot_spacing = 0.5;
    PlannedFlight planned;
    planned.plan = plan_of(settings.headings_deg, settings.strip_length, settings.attitude_rms_deg);
    planned.terrain = terrain_of(flight);
    const FlightForecast promised = forecast(planned, options);
    EXPECT_NEAR(promised.datum.total, made.datum.total, 0.1 * made.datum.total);
    EXPECT_NEAR(promised.datum.shape, made.datum.shape, 0.1 * made.datum.shape);
    EXPECT_NEAR(promised.datum.height, made.datum.height, 1);
    ASSERT_EQ(promised.unknowns.size(), made.unknowns.size());
    for (std::size_t i = 0; i < promised.unknowns.size(); ++i) {
      EXPECT_EQ(promised.unknowns[i].name, made.unknowns[i].name);
      EXPECT_EQ(promised.unknowns[i].held, made.unknowns[i].held);
      EXPECT_NEAR(promised.unknowns[i].sigma, made.unknowns[i].sigma, 0.35 * made.unknowns[i].sigma)
          << promised.unknowns[i].name;
    }
    RecordProperty(still ? "still" : "swaying",
                   std::to_string(promised.datum.total / made.datum.total) + " " +
                       std::to_string(promised.datum.shape / made.datum.shape));
  }
}

/// Whether nothing undetermined contains the word.
bool determined(const FlightForecast& found, const std::string& word) {
  return std::ranges::none_of(found.not_told, [&](const NotTold& own) {
    return own.words.find(word) != std::string::npos;
  });
}

TEST(FlightForecast, NamesWhatALevelFlightWillNotTell) {
  FlightForecastOptions options = options_for(2000);
  options.calibration.knot_spacing = 2;
  const FlightForecast level = forecast(flat_flight({90, 270}, 60, 0.01), options);
  EXPECT_FALSE(determined(level, "lever_arm_z_m"));
  EXPECT_FALSE(determined(level, "clock_offset_s"));
  // The little that it sways leaves the yaw a third of what was known before.
  EXPECT_GT(level.unknowns[0].sigma, 0.3 * level.unknowns[0].prior_sigma);
  EXPECT_TRUE(determined(level, "boresight_y_deg"));
  EXPECT_TRUE(determined(level, "boresight_z_deg"));
  const FlightForecast swaying = forecast(flat_flight({90, 270, 0, 180}, 60, 2), options);
  EXPECT_TRUE(determined(swaying, "boresight_x_deg"));
  EXPECT_LT(swaying.datum.total, 0.5 * level.datum.total);
}

TEST(FlightForecast, PointsOfOneFlightLieOnEachOther) {
  // As an independent analysis: the trajectory moves points by 4 to 5 cm, what is left of that is
  // common to strips.
  PlannedFlight planned = flat_flight({90, 270, 0, 180}, 80, 2);
  planned.terrain = terrain_of(SimulatedFlight({.strip_length = 1, .shot_rate = 100}));
  const FlightForecast found = forecast(planned, options_for(4000));
  const SharedPointErrors& points = found.points;
  ASSERT_GT(points.pairs, 10U);
  for (int k = 0; k < 2; ++k) {
    EXPECT_NEAR(points.trajectory[k], 0.045, 0.007);
    EXPECT_LT(points.adjusted[k], 0.6 * points.trajectory[k]);
    EXPECT_LT(points.strips_adjusted[k], 0.25 * points.strips_trajectory[k]);
  }
  EXPECT_NEAR(points.trajectory[2], 0.032, 0.004);
  EXPECT_LT(points.strips_adjusted[2], 0.1 * points.strips_trajectory[2]);
}

TEST(FlightForecast, MoreShotsAndLongerStripsTellMore) {
  FlightForecastOptions options = options_for(1000);
  options.calibration.knot_spacing = 2;
  const PlannedFlight small = flat_flight({90, 270}, 60, 2);
  const FlightForecast few = forecast(small, options);
  EXPECT_EQ(few.strip_shots.size(), 2U);
  EXPECT_NEAR(static_cast<double>(few.shots), 2 * 12 * 1000, 600);
  EXPECT_LE(few.used, few.shots);
  options.rate = 4000;
  const FlightForecast many = forecast(small, options);
  EXPECT_LT(many.datum.shape, few.datum.shape);
  const FlightForecast longer = forecast(flat_flight({90, 270}, 120, 2), options);
  EXPECT_LT(longer.datum.total, many.datum.total);
  // The same seed, the same bits.
  EXPECT_EQ(forecast(small, options).covariance, many.covariance);
}

TEST(FlightForecast, FailsInWords) {
  FlightForecastOptions options = options_for(500);
  options.calibration.knot_spacing = 4;
  const auto failure = [&](const PlannedFlight& planned) -> std::string {
    return refusal<Error>([&] { forecast(planned, options); });
  };
  EXPECT_THAT(failure(flat_flight({90}, 60, 0)), NamesField("one strip"));
  PlannedFlight apart = flat_flight({90, 90}, 60, 0);
  apart.plan.strips[1].center = {0, 500};
  EXPECT_THAT(failure(apart), NamesField("overlap"));
  PlannedFlight high = flat_flight({90, 270}, 60, 0);
  for (auto& strip : high.plan.strips) strip.height = 400;
  EXPECT_THAT(failure(high), NamesField("sensor's range"));
  const auto refused = [&](const auto& spoil) {
    FlightForecastOptions own = options;
    PlannedFlight planned = flat_flight({90, 270}, 60, 0);
    spoil(own, planned);
    return refusal([&] { forecast(planned, own); });
  };
  EXPECT_THAT(refused([](auto& o, auto&) { o.rate = 0; }), NamesField("rate"));
  EXPECT_THAT(refused([](auto& o, auto&) { o.calibration.cell_size = -1; }), NamesField("cell"));
  EXPECT_THAT(refused([](auto& o, auto&) { o.calibration.knot_spacing = 0; }), NamesField("knots"));
  EXPECT_THAT(refused([](auto& o, auto&) { o.calibration.fixed = {"nonsense"}; }),
              NamesField("nonsense"));
  EXPECT_NE(refused([](auto&, auto& p) { p.plan.strips.clear(); }), "");
  EXPECT_NE(refused([](auto&, auto& p) { p.terrain.ground.reset(); }), "");
  // Errors of the trajectory are known only from its accuracies, and a plan has none.
  EXPECT_NE(
      refused([](auto& o, auto&) { o.calibration.errors = trajectories::assumed_error_model(); }),
      "");
}

TEST(PlannedShots, EndOnTheTerrain) {
  PlannedFlight planned = flat_flight({90, 0}, 20, 0);
  planned.sensor = sensors::load_sensor("mid-40");
  planned.mount = options_for(1).calibration.mount;
  planned.terrain.ground->height = 30;
  planned.sensor.range_offset = 0.5;
  const trajectories::Flight flight = flown(planned);
  std::size_t shots = 0;
  std::int64_t last = 0;
  for_each_planned_piece(planned, flight, {}, [&](PlannedPiece& piece) {
    require_flight_shots(piece.shots);
    EXPECT_GE(piece.shots.time_ns.front(), last);
    last = piece.shots.time_ns.back();
    shots += piece.shots.size();
    for (std::size_t i = 0; i < piece.shots.size(); i += 997) {
      EXPECT_NEAR(piece.z[i], 30, 1e-9);
      // The lever arm's 12 cm lie below the platform.
      EXPECT_GT(piece.shots.range[i], 49.5);
      EXPECT_LT(piece.shots.range[i], 49.9 / std::cos(radians_from_degrees(19.5)) + 0.5);
    }
  });
  EXPECT_NEAR(static_cast<double>(shots), 2 * 4 * 1e5, 4);
  PlannedShotsOptions some;
  some.rate = 1000;
  std::size_t fewer = 0;
  for_each_planned_piece(planned, flight, some,
                         [&](PlannedPiece& piece) { fewer += piece.shots.size(); });
  EXPECT_NEAR(static_cast<double>(fewer), 8000, 400);
  some.rate = 1e6;
  EXPECT_THAT(refusal([&] { for_each_planned_piece(planned, flight, some, [](PlannedPiece&) {}); }),
              NamesField("rate"));
  planned.sensor.angular_velocity.clear();
  EXPECT_THAT(refusal([&] { for_each_planned_piece(planned, flight, {}, [](PlannedPiece&) {}); }),
              NamesField("angular_velocity"));
}

}  // namespace risley::calibration::flight_forecast_test
