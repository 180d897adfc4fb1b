// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/observability.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string_view>

#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/estimation/estimate.hpp"

#include "estimation/series.hpp"
#include "optics/trains.hpp"

namespace risley::estimation::observability_test {

ObservabilityPlan plan_of(const char* sensor, double duration, double rate) {
  ObservabilityPlan plan;
  plan.sensor = sensors::load_sensor(sensor);
  plan.duration = duration;
  plan.rate = rate;
  plan.angle_noise = radians_from_degrees(0.01);
  plan.free = free_parameters(default_free_names({2}), {2});
  return plan;
}

const QuantityObservability& quantity(const Observability& all, const std::string& name) {
  return *std::find_if(all.quantities.begin(), all.quantities.end(),
                       [&](const auto& one) { return one.name == name; });
}

double correlation(const Observability& all, const std::string& a, const std::string& b) {
  const auto place = [&](const std::string& name) {
    return std::find(all.correlation_names.begin(), all.correlation_names.end(), name) -
           all.correlation_names.begin();
  };
  return all.correlation(place(a), place(b));
}

TEST(Observability, BoundsOfAPlanAreThoseOfMonteCarloStudies) {
  // 30 s at 1 kHz and 0.01 degree: the bounds that Table 3's Monte Carlo reaches.
  const Observability all = observability_of_plan(plan_of("mid-40-table3", 30, 1000));
  EXPECT_NEAR(quantity(all, "refractive_index").sigma, 4.3e-6, 2e-7);
  const double k = kRadiansPerDegree;
  EXPECT_NEAR(quantity(all, "incident_beam_horizontal_deg").sigma / k, 1.05e-4, 5e-6);
  EXPECT_NEAR(quantity(all, "bearing_tilt_a_vertical_deg").sigma / k, 2.0e-3, 1e-4);
  EXPECT_NEAR(quantity(all, "prism_tilt_a_vertical_deg").sigma / k, 1.93e-3, 1e-4);
  EXPECT_NEAR(quantity(all, "prism_tilt_b_horizontal_deg").sigma / k, 2.42e-3, 1e-4);
  EXPECT_NEAR(quantity(all, "prism_tilt_b_vertical_deg").sigma / k, 2.34e-3, 1e-4);
}

TEST(Observability, BoundsFallWithTheSquareRootOfTheShots) {
  const Observability all = observability_of_plan(plan_of("mid-40", 10, 1000));
  const Observability more =
      observability_of_plan(plan_of("mid-40", 30, 100000));  // thinned inside
  for (const QuantityObservability& one : all.quantities) {
    if (!one.free || one.name.find("angul") == 0 || one.name.find("rotation") == 0) continue;
    EXPECT_NEAR(one.sigma / quantity(more, one.name).sigma, std::sqrt(300.0), 0.3) << one.name;
  }
}

TEST(Observability, ABoundIsTheEstimatesSigma) {
  const auto series = testing::constant_speed_series(sensors::load_sensor("mid-40-table3"), 0.5,
                                                     2.5, 2.0, 1000.0, 0.01, 1);
  EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  options.angle_noise = radians_from_degrees(0.01);
  for (const Method method : {Method::map, Method::ekf}) {
    const Estimate result = estimate(method, series, series, options);
    const Observability all = observability_of_estimate(result);
    for (std::size_t i = 0; i < result.free.size(); ++i) {
      EXPECT_NEAR(quantity(all, result.free[i].name).sigma / result.values[i].sigma_given_held, 1.0,
                  0.01)
          << to_string(method) << " " << result.free[i].name;
    }
    EXPECT_NEAR(all.shots, 2001, 4);
    EXPECT_NEAR(all.duration, 2.0, 1e-9);
  }
}

TEST(Observability, SensitivitiesAreDifferenceQuotients) {
  const Observability all = observability_of_plan(plan_of("mid-40-table3", 1, 2000));
  const auto sensor = sensors::load_sensor("mid-40-table3");
  for (const char* name : {"refractive_index", "wedge_angle_deg", "prism_tilt_a_horizontal_deg",
                           "incident_beam_vertical_deg", "bearing_tilt_a_horizontal_deg"}) {
    const double h = 1e-6;
    auto up = sensor, down = sensor;
    up.set(name, up.get(name) + h);
    down.set(name, down.get(name) - h);
    const auto a = testing::constant_speed_series(up, 0, 0, 1.0, 2000.0);
    const auto b = testing::constant_speed_series(down, 0, 0, 1.0, 2000.0);
    double squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      squares += std::pow((a.azimuth[i] - b.azimuth[i]) / (2 * h), 2) +
                 std::pow((a.zenith[i] - b.zenith[i]) / (2 * h), 2);
    }
    const double expected = std::sqrt(squares / static_cast<double>(a.size()));
    EXPECT_NEAR(quantity(all, name).sensitivity / expected, 1.0, 1e-3) << name;
  }
}

TEST(Observability, Section23OfThePaper) {
  const Observability all = observability_of_plan(plan_of("mid-40-table3", 30, 1000));
  // The index of air is not determined at all, prism A's horizontal tilt hardly: it goes with A's
  // rotation angle at -0.99, and moves the beam least of all.
  EXPECT_TRUE(std::isinf(quantity(all, "refractive_index_air").sigma));
  EXPECT_NEAR(correlation(all, "prism_tilt_a_horizontal_deg", "rotation_angle_a_deg"), -0.99,
              0.012);
  const QuantityObservability tilt = quantity(all, "prism_tilt_a_horizontal_deg");
  for (const QuantityObservability& one : all.quantities) {
    if (one.name == tilt.name) continue;
    EXPECT_GT(one.sensitivity, tilt.sensitivity) << one.name;
  }
  // Wedge and index are not one quantity: enough data separate them.
  const QuantityObservability wedge = quantity(all, "wedge_angle_deg");
  EXPECT_TRUE(std::isfinite(wedge.sigma));
  EXPECT_GT(std::abs(wedge.twins.front().second), 0.999);
  ASSERT_FALSE(all.unobservable.empty());
  EXPECT_EQ(all.unobservable.front().weights.size(), 2u);
  const auto words = observability_words(all, {2});
  const auto says = [&](const std::string& text) {
    return std::any_of(words.begin(), words.end(),
                       [&](const std::string& one) { return one.find(text) != std::string::npos; });
  };
  EXPECT_TRUE(says("refractive_index_air cannot be separated from refractive_index"));
  EXPECT_TRUE(says("rotation_angle_a_deg (rho = -0.99"));
}

/// A plan as the command makes it for a sensor, 1 s at 24 kHz.
ObservabilityPlan plan_of_six(const sensors::Sensor& sensor) {
  ObservabilityPlan plan;
  plan.sensor = sensor;
  plan.duration = 1;
  plan.rate = 24000;
  plan.angle_noise = radians_from_degrees(0.004);
  EstimateOptions usual;
  usual.sensor = sensor;
  plan.free = chosen_parameters(usual);
  return plan;
}

const EmitterBounds& bounds_of(const EmitterComparison& all, std::string_view name) {
  return *std::find_if(all.bounds.begin(), all.bounds.end(),
                       [&](const auto& one) { return one.name == name; });
}

TEST(Observability, OfSixEmittersIsTheEstimatesSigma) {
  sensors::Sensor unit = sensors::load_sensor("horizon");
  unit.set("bearing_tilt_a_vertical_deg", radians_from_degrees(0.3));
  unit.set("prism_tilt_b_vertical_deg", radians_from_degrees(-0.2));
  ObservabilityPlan plan = plan_of_six(unit);
  AngleSeries series;
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 12000; ++i) {
    const double t = i / plan.rate;
    std::vector<double> angles;
    for (const double speed : unit.angular_velocity) angles.push_back(speed * t);  // as a plan
    const Observation shot = observe(unit.train, angles, i % 6);
    series.append(std::llround(1e9 * t), shot.azimuth + plan.angle_noise * normal(generator),
                  shot.zenith + plan.angle_noise * normal(generator),
                  static_cast<std::uint8_t>(i % 6));
  }
  EstimateOptions options;
  options.sensor = sensors::load_sensor("horizon");
  options.angle_noise = plan.angle_noise;
  options.rotor_process.assign(3, kTypicalRotor);
  const Estimate result = estimate(Method::map, series, series, options);
  ASSERT_TRUE(result.converged) << result.reason;
  const Observability all = observability_of_estimate(result);
  plan.duration = 0.5;
  plan.rotor_process = options.rotor_process;
  const Observability planned = observability_of_plan(plan);
  ASSERT_EQ(result.free.size(), 25u);
  for (std::size_t i = 0; i < result.free.size(); ++i) {
    const std::string& name = result.free[i].name;
    EXPECT_TRUE(quantity(all, name).free) << name;
    EXPECT_NEAR(quantity(all, name).sigma / result.values[i].sigma_given_held, 1.0, 0.01) << name;
    EXPECT_NEAR(quantity(planned, name).sigma / result.values[i].sigma_given_held, 1.0, 0.1)
        << name;
    if (name.starts_with("incident")) continue;
    EXPECT_NEAR(bounds_of(all.emitters, name).all / quantity(all, name).sigma, 1.0, 1e-3) << name;
  }
}

TEST(Observability, SixEmittersTellTheFirstPrismWhichOneDoesNot) {
  const Observability all = observability_of_plan(plan_of_six(sensors::load_sensor("horizon")));
  const EmitterComparison& emitters = all.emitters;
  EXPECT_EQ(emitters.emitters, 6);
  EXPECT_TRUE(emitters.alone == 2 || emitters.alone == 3);
  for (const char* name :
       {"refractive_index_a", "prism_tilt_a_vertical_deg", "bearing_tilt_a_vertical_deg"}) {
    EXPECT_TRUE(std::isfinite(bounds_of(emitters, name).all)) << name;
    EXPECT_TRUE(std::isinf(bounds_of(emitters, name).alone)) << name;
  }
  const EmitterBounds& tilt = bounds_of(emitters, "prism_tilt_a_horizontal_deg");
  EXPECT_GT(tilt.alone / tilt.all, 100.0);
  // The last prism's glass needs no further emitter.
  const EmitterBounds& last = bounds_of(emitters, "refractive_index_c");
  EXPECT_NEAR(last.alone / last.all, 1.0, 0.05);
  for (const EmitterBounds& one : emitters.bounds) {
    EXPECT_LE(one.known, one.all * (1 + 1e-6)) << one.name;
  }
  ASSERT_EQ(emitters.untold_alone.size(), 1u);
  EXPECT_EQ(emitters.untold_alone[0].weights.front().first, "prism_tilt_a_vertical_deg");
  const auto words = observability_words(all, {3, 6});
  EXPECT_TRUE(std::any_of(words.begin(), words.end(), [](const std::string& one) {
    return one.starts_with("only the 6 emitters together determine") &&
           one.find("refractive_index_a") != std::string::npos;
  }));
}

TEST(Observability, OneEmitterAloneIsASensorWithThatEmitter) {
  const sensors::Sensor six = sensors::load_sensor("avia");
  const ObservabilityPlan plan = plan_of_six(six);
  const EmitterComparison emitters = observability_of_plan(plan).emitters;
  ObservabilityPlan own = plan;
  own.sensor.train = testing::train_of_emitter(six.train, emitters.alone);
  own.free = free_parameters(default_free_names({2}), {2});
  const Observability alone = observability_of_plan(own);
  EXPECT_TRUE(alone.emitters.bounds.empty());
  for (const char* name : {"bearing_tilt_a_horizontal_deg", "bearing_tilt_a_vertical_deg",
                           "prism_tilt_a_vertical_deg", "prism_tilt_b_horizontal_deg",
                           "prism_tilt_b_vertical_deg", "prism_tilt_a_horizontal_deg"}) {
    EXPECT_NEAR(bounds_of(emitters, name).alone / quantity(alone, name).sigma, 1.0, 0.03) << name;
  }
}

TEST(Observability, ParametersOfOnePrismAreNamedWhenTheyAreFree) {
  ObservabilityPlan plan = plan_of("mid-40-table3", 1, 1000);
  plan.free = free_parameters({"refractive_index_a", "refractive_index_b"}, {2});
  const Observability all = observability_of_plan(plan);
  EXPECT_TRUE(quantity(all, "refractive_index_a").free);
  EXPECT_TRUE(quantity(all, "refractive_index_b").free);
  EXPECT_FALSE(quantity(all, "wedge_angle_deg").free);
  for (const QuantityObservability& one : all.quantities) EXPECT_NE(one.name, "refractive_index");
  EXPECT_TRUE(all.emitters.bounds.empty());
}

TEST(Observability, WeakDirectionsAreThoseOfTheMatrix) {
  // Two parameters of which only the sum is known.
  const auto free =
      free_parameters({"prism_tilt_a_vertical_deg", "prism_tilt_b_vertical_deg"}, {2});
  const double prior = free[0].prior_sigma;
  Eigen::Matrix2d information;
  information << 1, 1, 1, 1;
  information *= 1e4 / (prior * prior);
  const auto weak = weak_directions(information, free, 0.3);
  ASSERT_EQ(weak.size(), 1u);
  ASSERT_EQ(weak[0].weights.size(), 2u);
  EXPECT_NEAR(weak[0].weights[0].second, std::sqrt(0.5), 1e-9);
  EXPECT_NEAR(weak[0].weights[1].second, -std::sqrt(0.5), 1e-9);
  EXPECT_LT(weak[0].ratio, 1e-7);
  EXPECT_EQ(direction_text(weak[0]),
            "0.71 " + weak[0].weights[0].first + " - 0.71 " + weak[0].weights[1].first);
  information(0, 0) *= 1.01;
  EXPECT_TRUE(weak_directions(information, free, 0.3).empty());
  EXPECT_TRUE(weak_directions({}, {}, 0.3).empty());
}

TEST(Observability, PlansThatMakeNoSenseAreRefused) {
  auto plan = plan_of("mid-40", 0, 1000);
  EXPECT_THROW(observability_of_plan(plan), InvalidArgument);
  plan.duration = 1;
  plan.rate = -1;
  EXPECT_THROW(observability_of_plan(plan), InvalidArgument);
  plan.rate = 1000;
  plan.angle_noise = 0;
  EXPECT_THROW(observability_of_plan(plan), InvalidArgument);
}

}  // namespace risley::estimation::observability_test
