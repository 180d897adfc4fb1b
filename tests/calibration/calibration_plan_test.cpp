// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/calibration_plan.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/sensors/preset.hpp"

#include "calibration/range_terms.hpp"
#include "calibration/walls.hpp"

namespace risley::calibration::calibration_plan_test {

using Eigen::Index;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::station;
using testing::wall;

/// Ranges without errors but for the offset, from prisms of known size.
void hold_numbers(sensors::Sensor& sensor) {
  for (const char* name : {"range_near_m", "range_incidence", "range_per_decade_m",
                           "prism_thickness_m", "prism_spacing_m"}) {
    sensor.set_knowledge({name, 0, "exact"});
  }
}

/// 10 s at 1 kHz before flat walls, ranges without errors.
CalibrationPlan plan_of(scenes::Scene scene) {
  CalibrationPlan plan;
  plan.sensor = sensors::load_sensor("mid-40-table3");
  plan.scene = std::move(scene);
  plan.rate = 1000.0;
  plan.range_offset_sigma = 0;
  plan.shape = {};
  hold_numbers(plan.sensor);
  return plan;
}

scenes::Scene one_wall() { return {{wall("wall", 10, 80, 30)}, {}}; }

scenes::Scene corner() { return {{wall("left", 40, 88, 10), wall("right", -45, 85, 12)}, {}}; }

/// Upright, flipped, and turned to both sides.
scenes::Scene stations() {
  scenes::Scene scene = corner();
  scene.stations = {station("upright", 0, 0, 0, 0.02), station("flipped", 180, 0, 0, 0.02),
                    station("to the left", 0, 0, 30, 0.02, {1, 0.5, 0}),
                    station("to the right", 0, 0, -30, 0.02, {0, -1, 0.2})};
  return scene;
}

const scenes::Station kUpright = station("upright", 0, 0, 0, 0.02);

double total_deg(const scenes::Scene& scene) {
  return degrees_from_radians(forecast(plan_of(scene)).datum.total);
}

/// The whole sum over shots at random rotation angles.
void expect_adjustment(const CalibrationPlan& plan) {
  const auto shots = static_cast<std::size_t>(plan.duration * *plan.rate);
  const sensors::Sensor& sensor = plan.sensor;
  const double noise = plan.range_noise.value_or(sensor.range_noise);
  const double sigma = std::hypot(noise, sensor.range_resolution / std::sqrt(12.0));
  PlanarProblem p =
      testing::planar_problem(sensor.train, plan.beam_origin ? sensor.geometry : PrismGeometry{},
                              plan.scene, sigma, {shots});
  p.free = calibration_parameters({2}, plan.fixed, plan.additional);
  if (plan.prior_sigma) {
    for (const auto& free : p.free) {
      p.prior_sigma.push_back(free.name == "refractive_index" ? HUGE_VAL : *plan.prior_sigma);
    }
  }
  p.range_offset_sigma = plan.range_offset_sigma;
  p.range_terms = calibration::range_terms_of(sensor, true);
  p.divergence = {sensor.beam_divergence_horizontal, sensor.beam_divergence_vertical};
  if (plan.beam_origin) {
    p.geometry = calibration::one_size_each(p.geometry, 2);
    p.sizes = calibration::size_priors(sensor);
  }
  for (std::size_t v = 0; v < p.views.size(); ++v) {
    auto own = std::make_shared<calibration::RangedShots>(*p.views[v].shots);
    own->intensity.assign(own->size(), 100);
    calibration::fill_range_terms(p, v, *own);
    p.views[v].shots = std::move(own);
  }
  p.shape = plan.shape;
  if (!p.shape.parameters.empty()) calibration::lay_grids(p);
  const PlanarSolution expected = adjust(p, {0});
  const CalibrationForecast found = forecast(plan);
  ASSERT_EQ(found.free.size(), p.free.size());
  for (Index i = 0; i < expected.covariance.rows(); ++i) {
    for (Index j = 0; j < expected.covariance.rows(); ++j) {
      const double size = std::sqrt(expected.covariance(i, i) * expected.covariance(j, j));
      EXPECT_NEAR(found.covariance(i, j), expected.covariance(i, j), 0.03 * size)
          << found.free[i].name << ", " << found.free[j].name;
    }
  }
  EXPECT_NEAR(found.range_offset_sigma, expected.number_sigma("range_offset_m"),
              0.02 * expected.number_sigma("range_offset_m"));
  EXPECT_NEAR(found.shots, static_cast<double>(expected.shots), 0.01 * found.shots);
}

TEST(Forecast, IsTheCovarianceOfTheAdjustment) {
  CalibrationPlan plan = plan_of(corner());
  plan.duration = 40;
  expect_adjustment(plan);
}

TEST(Forecast, IsItWithWallsThatHaveShapeAndRangesThatHaveErrors) {
  CalibrationPlan plan = plan_of(corner());
  plan.duration = 40;
  plan.shape = calibration::typical_walls();
  plan.sensor = sensors::load_sensor("mid-40-table3");
  expect_adjustment(plan);
}

TEST(Forecast, IsItWithStationsAndKnownPlanesToo) {
  CalibrationPlan plan = plan_of(stations());
  plan.duration = 20;
  plan.scene.planes[1].normal_sigma = radians_from_degrees(0.03);
  plan.range_offset_sigma = 0.05;
  plan.range_noise = 0.01;
  plan.prior_sigma = radians_from_degrees(0.1);
  plan.additional = {"refractive_index"};
  plan.fixed = {"bearing_tilt_a_vertical_deg"};
  plan.beam_origin = false;
  expect_adjustment(plan);
}

/// A prior of the angles that is narrow beside what the shots determine, and none of the index.
TEST(Forecast, PriorsAreOfAngles) {
  CalibrationPlan plan = plan_of(corner());
  plan.duration = 40;
  plan.range_noise = 0.5;
  plan.additional = {"refractive_index"};
  plan.prior_sigma = radians_from_degrees(0.002);
  expect_adjustment(plan);
}

/// What a prototype in another language found for the same plans.
TEST(Forecast, ReproducesKnownNumbers) {
  EXPECT_NEAR(total_deg(one_wall()), 0.099, 0.03 * 0.099);
  EXPECT_NEAR(total_deg({{wall("tilted", 60, 90, 15)}, {}}), 0.0138, 0.03 * 0.0138);
  const double corner_distance = 10.0 * std::cos(radians_from_degrees(45.0));
  EXPECT_NEAR(
      total_deg(
          {{wall("left", 45, 90, corner_distance), wall("right", -45, 90, corner_distance)}, {}}),
      0.1094, 0.03 * 0.1094);
}

TEST(Forecast, FallsWithTheRootOfTheDurationAndWithTheNoise) {
  CalibrationPlan plan = plan_of(one_wall());
  const CalibrationForecast once = forecast(plan);
  plan.duration *= 4;
  const CalibrationForecast longer = forecast(plan);
  EXPECT_NEAR(longer.datum.total / once.datum.total, 0.5, 0.01);
  EXPECT_NEAR(longer.shots / once.shots, 4.0, 0.01);
  plan.duration /= 4;
  *plan.rate *= 4;
  EXPECT_NEAR(forecast(plan).datum.total / once.datum.total, 0.5, 0.01);
  *plan.rate /= 4;
  plan.sensor.range_resolution = 0;
  const double without_rounding = forecast(plan).datum.total;
  EXPECT_LT(without_rounding, once.datum.total);
  plan.range_noise = 0.005;
  EXPECT_NEAR(forecast(plan).datum.total / without_rounding, 0.25, 0.01);
  // A step of rounding spreads like noise of its length over the root of twelve.
  plan.range_noise = 1e-6;
  plan.sensor.range_resolution = 0.02 * std::sqrt(12.0);
  EXPECT_NEAR(forecast(plan).datum.total / without_rounding, 1.0, 0.01);
}

TEST(Forecast, TakesRateAndNoiseFromTheSensor) {
  CalibrationPlan stated = plan_of(one_wall()), own = stated;
  own.rate.reset();
  stated.rate = own.sensor.shot_rate;
  stated.range_noise = own.sensor.range_noise;
  EXPECT_EQ(forecast(own).datum.total, forecast(stated).datum.total);
}

TEST(Forecast, TellsWhichWallsAreSeen) {
  CalibrationPlan plan = plan_of(corner());
  plan.scene.planes.push_back(wall("behind", 180, 90, 5));
  const CalibrationForecast alone = forecast(plan);
  ASSERT_EQ(alone.walls.size(), 2u);
  EXPECT_EQ(alone.walls[0].name, "left");
  EXPECT_EQ(alone.walls[1].name, "right");
  EXPECT_NEAR(alone.walls[0].share + alone.walls[1].share, 1.0, 1e-12);
  EXPECT_NEAR(alone.shots, 10000.0, 1e-6);
  EXPECT_NEAR(degrees_from_radians(alone.walls[0].mean_incidence), 41, 5);
  EXPECT_NEAR(alone.walls[0].mean_range, 10.0 / std::cos(radians_from_degrees(40.0)), 1.5);
  EXPECT_EQ(alone.datum_kind, DatumKind::none);

  plan.scene.stations = stations().stations;
  const CalibrationForecast tied = forecast(plan);
  EXPECT_EQ(tied.datum_kind, DatumKind::stations);
  std::vector<std::string> from;
  for (const PlannedWall& seen : tied.walls) from.push_back(seen.station);
  EXPECT_THAT(from, Contains("upright"));
  EXPECT_THAT(from, Contains("flipped"));
  EXPECT_NEAR(tied.shots, 40000.0, 400.0);
  plan.scene.planes[0].normal_sigma = 1e-3;
  EXPECT_EQ(forecast(plan).datum_kind, DatumKind::both);
  plan.stations_known = false;
  plan.scene.stations.resize(1);
  EXPECT_EQ(forecast(plan).datum_kind, DatumKind::planes);
  // One station has nothing to be compared with.
  plan.stations_known = true;
  EXPECT_EQ(forecast(plan).datum_kind, DatumKind::planes);
  plan.scene.planes[0].normal_sigma.reset();
  EXPECT_EQ(forecast(plan).datum_kind, DatumKind::none);
}

TEST(Forecast, StartsBeamsWhereTheyLeaveThePrisms) {
  CalibrationPlan plan = plan_of(corner());
  const CalibrationForecast thick = forecast(plan);
  plan.beam_origin = false;
  const CalibrationForecast without = forecast(plan);
  EXPECT_NE(thick.walls.at(0).mean_range, without.walls.at(0).mean_range);
  plan.beam_origin = true;
  plan.sensor.set_prism_geometry({});
  const CalibrationForecast thin = forecast(plan);
  EXPECT_EQ(thin.walls.at(0).mean_range, without.walls.at(0).mean_range);
  EXPECT_EQ(thin.datum.total, without.datum.total);
}

/// Flipped in azimuth, the back of a wall is the front of one that leans the other way.
TEST(Forecast, WallsHaveTwoSides) {
  CalibrationPlan behind = plan_of(one_wall());
  scenes::Station beyond = station("beyond", 0, 0, 180, 0);
  beyond.position = 60.0 * behind.scene.planes[0].plane.normal;
  behind.scene.stations = {beyond};
  behind.stations_known = false;
  const CalibrationForecast back = forecast(behind);
  const CalibrationForecast front = forecast(plan_of({{wall("wall", 10, 100, 30)}, {}}));
  EXPECT_NEAR(back.datum.total / front.datum.total, 1.0, 1e-6);
  EXPECT_NEAR(back.walls.at(0).mean_range, front.walls.at(0).mean_range, 1e-6);
}

/// Knowing how the sensor stood is worth more than the shots alone.
TEST(Forecast, KnownStationsAreADatum) {
  CalibrationPlan plan = plan_of(stations());
  const double known = forecast(plan).datum.gauge;
  plan.stations_known = false;
  const CalibrationForecast unknown = forecast(plan);
  EXPECT_EQ(unknown.datum_kind, DatumKind::none);
  EXPECT_LT(known, 0.5 * unknown.datum.gauge);
}

TEST(Forecast, KnownNormalsAreADatum) {
  CalibrationPlan plan = plan_of(corner());
  plan.rate = 10.0;
  const double unknown = forecast(plan).datum.gauge;
  for (scenes::ScenePlane& plane : plan.scene.planes) {
    plane.normal_sigma = radians_from_degrees(0.001);
  }
  EXPECT_LT(forecast(plan).datum.gauge, 0.5 * unknown);
}

TEST(Forecast, WhatAPlaneWallDoesNotTellIsUnobservable) {
  CalibrationPlan plan = plan_of({{wall("across", 0, 90, 30)}, {}});
  const CalibrationForecast poor = forecast(plan);
  ASSERT_FALSE(poor.unobservable.empty());
  EXPECT_THAT(estimation::direction_text(poor.unobservable[0]), HasSubstr("incident_beam"));
  EXPECT_TRUE(forecast(plan_of(one_wall())).unobservable.empty());
  // What a prior holds is not unknown.
  plan.prior_sigma = radians_from_degrees(0.1);
  const CalibrationForecast held = forecast(plan);
  EXPECT_TRUE(held.unobservable.empty());
  EXPECT_TRUE(held.covariance.allFinite());
}

TEST(Forecast, AdvisesWhereSomethingIsPoor) {
  const auto advice_of = [](const CalibrationPlan& plan) { return forecast(plan).advice; };
  CalibrationPlan poor = plan_of(one_wall());
  poor.scene.planes[0].plane.distance = 15;
  EXPECT_THAT(advice_of(poor), Contains(HasSubstr("50 to 65 degrees")));
  EXPECT_THAT(advice_of(poor), Contains(HasSubstr("16 m away")));
  EXPECT_THAT(advice_of(poor), Contains(HasSubstr("upside down (180 degrees about its axis)")));
  EXPECT_THAT(advice_of(poor), Contains(HasSubstr("record longer")));
  EXPECT_THAT(advice_of(poor), Not(Contains(HasSubstr("% of the shots"))));
  EXPECT_THAT(advice_of(plan_of(corner())), Contains(HasSubstr("13 m away")));  // of both walls

  // Far walls are not too near, steep ones are steep enough.
  EXPECT_THAT(advice_of(plan_of(one_wall())), Not(Contains(HasSubstr("m away"))));
  CalibrationPlan steep = plan_of({{wall("tilted", 60, 90, 15)}, {}});
  steep.duration = 0.1;
  EXPECT_THAT(advice_of(steep), Not(Contains(HasSubstr("50 to 65 degrees"))));
  EXPECT_THAT(advice_of(steep), Contains(HasSubstr("record longer")));

  CalibrationPlan small = plan_of({{wall("tilted", 60, 90, 15)}, {}});
  small.duration = 1000;
  EXPECT_THAT(advice_of(small), ElementsAre());
  small.shape = calibration::typical_walls();
  // Nothing to say but that the walls' shape would cancel.
  EXPECT_THAT(advice_of(small), ElementsAre(HasSubstr("roll the sensor by 180 degrees")));
  scenes::ScenePlane& plane = small.scene.planes[0];
  plane.horizontal_axis = normalized(cross(Vector3<double>{0, 0, 1}, plane.plane.normal));
  plane.vertical_axis = cross(plane.plane.normal, plane.horizontal_axis);
  plane.extent = {2000.0, 9.0};
  EXPECT_THAT(advice_of(small), Contains(HasSubstr("% of the shots meet a wall")));
  // Of each of several stations.
  small.scene.stations = {kUpright, kUpright};
  EXPECT_THAT(advice_of(small), ElementsAre(HasSubstr("% of the shots meet a wall")));
  small.scene.stations.clear();
  // Nearly all is enough.
  plane.extent = {2000.0, 21.5};
  const double share = forecast(small).walls.at(0).share;
  EXPECT_GT(share, 0.91);
  EXPECT_LT(share, 0.98);
  EXPECT_THAT(advice_of(small), Not(Contains(HasSubstr("% of the shots"))));

  CalibrationPlan tied = plan_of(stations());
  tied.duration = 0.05;
  EXPECT_THAT(advice_of(tied),
              Not(Contains(HasSubstr("upside down (180 degrees about its axis)"))));
}

TEST(Forecast, RefusesWhatCannotBePlanned) {
  EXPECT_THROW(forecast(plan_of({{wall("behind", 180, 90, 5)}, {}})), EstimationError);
  EXPECT_THROW(forecast(plan_of({})), EstimationError);
  EXPECT_THROW(forecast(plan_of({{wall("too far", 10, 80, 400)}, {}})), EstimationError);
  EXPECT_THROW(forecast(plan_of({{wall("too near", 10, 80, 0.1)}, {}})), EstimationError);
  const auto refused = [](const auto& spoil) {
    CalibrationPlan plan = plan_of(one_wall());
    spoil(plan);
    EXPECT_THROW(forecast(plan), InvalidArgument);
  };
  refused([](auto& plan) { plan.duration = 0; });
  refused([](auto& plan) { plan.rate = -1.0; });
  refused([](auto& plan) { plan.range_noise = 0.0; });
  refused([](auto& plan) { plan.fixed = {"no_such_parameter"}; });
  refused([](auto& plan) { plan.additional = {"no_such_parameter"}; });
}

TEST(CalibrationParameters, AreTheTiltsThatWallsTell) {
  const auto names = [](const auto& free) {
    std::vector<std::string> all;
    for (const auto& parameter : free) all.push_back(parameter.name);
    return all;
  };
  EXPECT_EQ(names(calibration_parameters({2}, {}, {})), testing::kTiltNames);
  EXPECT_EQ(calibration_parameters({3}, {}, {}).size(), 10u);
  EXPECT_EQ(names(calibration_parameters({2}, {"prism_tilt_a_vertical_deg"},
                                         {"refractive_index", "incident_beam_vertical_deg"})),
            (std::vector<std::string>{"incident_beam_horizontal_deg", "incident_beam_vertical_deg",
                                      "bearing_tilt_a_horizontal_deg",
                                      "bearing_tilt_a_vertical_deg", "prism_tilt_b_horizontal_deg",
                                      "prism_tilt_b_vertical_deg", "refractive_index"}));
  // Fixing what is held anyway is no mistake.
  EXPECT_EQ(names(calibration_parameters({2}, {"refractive_index"}, {})), testing::kTiltNames);
  EXPECT_THROW(calibration_parameters({2}, {"bearing_tilt_c_vertical_deg"}, {}), InvalidArgument);
}

// What the preset states of a tilt that directions do not determine is its prior; wedges stay held.
TEST(AdjustedParameters, AreThoseAndTheTiltsWithAPrior) {
  const sensors::Sensor sensor = sensors::load_sensor("mid-40");
  const AdjustedParameters all = adjusted_parameters(sensor, {}, {}, std::nullopt);
  ASSERT_EQ(all.free.size(), testing::kTiltNames.size() + 1);
  ASSERT_EQ(all.prior_sigma.size(), all.free.size());
  EXPECT_EQ(all.free.back().name, "prism_tilt_a_horizontal_deg");
  EXPECT_NEAR(all.prior_sigma.back(), radians_from_degrees(0.3), 1e-12);
  for (std::size_t j = 0; j + 1 < all.free.size(); ++j) EXPECT_TRUE(std::isinf(all.prior_sigma[j]));
  const AdjustedParameters narrow = adjusted_parameters(sensor, {}, {}, radians_from_degrees(0.1));
  for (const double sigma : narrow.prior_sigma)
    EXPECT_NEAR(sigma, radians_from_degrees(0.1), 1e-12);
  EXPECT_EQ(
      adjusted_parameters(sensor, {"prism_tilt_a_horizontal_deg"}, {}, std::nullopt).free.size(),
      testing::kTiltNames.size());
  const AdjustedParameters freed =
      adjusted_parameters(sensor, {}, {"prism_tilt_a_horizontal_deg"}, std::nullopt);
  EXPECT_EQ(freed.free.size(), testing::kTiltNames.size() + 1);
  EXPECT_TRUE(std::isinf(freed.prior_sigma.back()));
}

}  // namespace risley::calibration::calibration_plan_test
