// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// A wedge and a reflector about an upright axis, as the Mid-360 has them.
#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/estimation/sensor_recognition.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/sensors/scan_pattern.hpp"

namespace risley::estimation::reflector_test {

/// A unit that is off in all that the preset calls uncertain.
sensors::Sensor random_unit(unsigned seed) {
  sensors::Sensor unit = sensors::load_sensor("mid-360");
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  for (const sensors::Knowledge& known : unit.knowledge) {
    if (!(known.sigma > 0) || known.name.starts_with("angular")) continue;
    unit.set(known.name, unit.get(known.name) + known.sigma * normal(generator));
  }
  return unit;
}

/// Shots every 5 us, in turn of the emitters, with the swing of the unit's speeds.
AngleSeries shots_of(const sensors::Sensor& unit, std::size_t shots, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0.0, unit.angle_noise);
  const double swing = sensors::swing_angular_frequency(unit);
  AngleSeries series;
  for (std::size_t i = 0; i < shots; ++i) {
    const std::int64_t ns = 5000 * static_cast<std::int64_t>(i);
    const double t = 1e-9 * static_cast<double>(ns);
    const int emitter = static_cast<int>(i % 4);
    std::array<double, 2> angles{1.0 + t * unit.angular_velocity[0],
                                 2.5 + t * unit.angular_velocity[1]};
    for (std::size_t k = 0; swing > 0 && k < 2; ++k) {
      angles[k] += unit.sequence->swing[k] / swing * std::sin(swing * t);
    }
    const Observation shot = observe(unit.train, angles, emitter);
    series.append(ns, shot.azimuth + normal(generator), shot.zenith + normal(generator));
    series.beam.back() = static_cast<std::uint8_t>(emitter);
  }
  return series;
}

EstimateOptions options_of_preset() {
  EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-360");
  return options;
}

TEST(Reflector, UnitsAreEstimatedToTheirNoise) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    SCOPED_TRACE(seed);
    const sensors::Sensor unit = random_unit(seed);
    const AngleSeries series = shots_of(unit, 40'000, seed);
    const Estimate found = estimate(Method::map, series, series, options_of_preset());
    ASSERT_TRUE(found.converged) << found.reason;
    EXPECT_FALSE(found.mirrored);
    EXPECT_NEAR(found.expected_residual, unit.angle_noise, 0.03 * unit.angle_noise);
    for (const int place : {place::prism_tilt_vertical(0), place::wedge_angle(0),
                            place::wedge_angle(1), place::prism_tilt_horizontal(1)}) {
      EXPECT_NEAR(found.sensor.train[place], unit.train[place], radians_from_degrees(0.6)) << place;
    }
  }
}

TEST(Reflector, JointErrorsAreThoseStated) {
  // The held tilt of the reflector moves the others by up to 30 sigma of what is known best, in
  // second order.
  constexpr unsigned kUnits = 20;
  double chi2 = 0, values = 0;
  for (unsigned seed = 1; seed <= kUnits; ++seed) {
    const sensors::Sensor unit = random_unit(seed);
    const AngleSeries series = shots_of(unit, 20'000, seed);
    const Estimate found = estimate(Method::map, series, series, options_of_preset());
    ASSERT_TRUE(found.converged) << found.reason;
    const Eigen::Index n = found.parameters.size();
    Eigen::MatrixXd covariance = found.covariance;
    for (std::size_t j = 0; j < found.held_changes.held.size(); ++j) {
      covariance += found.held_changes.covariance(j, n);
    }
    chi2 += algebra::SymmetricSolver(covariance)
                .chi2(found.parameters - free_values(unit.train, found.free));
    values += static_cast<double>(n);
  }
  EXPECT_GT(chi2 / values, 0.8);
  EXPECT_LT(chi2 / values, 1.25);
}

TEST(Reflector, RotorsThatLeanAreNoTurnOfTheFrame) {
  sensors::Sensor unit = sensors::load_sensor("mid-360");
  const double lean = radians_from_degrees(0.35);
  for (const int element : {0, 1})
    unit.train.set_place(place::bearing_tilt_vertical(element), lean);
  for (int emitter = 0; emitter < 4; ++emitter) {
    unit.train.set_place(place::incident_beam_vertical(emitter, 2), lean);
  }
  const AngleSeries series = shots_of(unit, 40'000, 7);
  const Estimate found = estimate(Method::map, series, series, options_of_preset());
  ASSERT_TRUE(found.converged) << found.reason;
  EXPECT_FALSE(found.frame_turn.has_value());
  EXPECT_NEAR(found.sensor.train[place::bearing_tilt_vertical(1)], lean,
              radians_from_degrees(0.02));
}

TEST(Reflector, ATurnOfTheFrameHoldsTheLeanOfTheLastAxis) {
  const sensors::Sensor unit = sensors::load_sensor("mid-360");
  AngleSeries series = shots_of(unit, 40'000, 8);
  const FrameTurn turned{radians_from_degrees(2.0), radians_from_degrees(-1.0), true};
  turn(series, recording_from_sensor(turned));
  const Estimate found = estimate(Method::map, series, series, options_of_preset());
  ASSERT_TRUE(found.converged) << found.reason;
  ASSERT_TRUE(found.frame_turn.has_value());
  EXPECT_NEAR(found.frame_turn->turn.yaw, turned.yaw, radians_from_degrees(0.1));
  EXPECT_NEAR(found.frame_turn->turn.pitch, turned.pitch, radians_from_degrees(0.1));
  EXPECT_EQ(found.sensor.train[place::bearing_tilt_vertical(1)], 0.0);
}

// Rotor A's speed swings by 180 rpm at 20 Hz, as in the manufacturer's sequence.
TEST(Reflector, ASwingIsFollowed) {
  const sensors::Sensor sensor = sensors::load_sensor("mid-360-sequence");
  const AngleSeries series = shots_of(sensor, 100'000, 5);
  EstimateOptions options;
  options.sensor = sensor;
  const Estimate found = estimate(Method::map, series, series, options);
  ASSERT_TRUE(found.converged) << found.reason;
  EXPECT_NEAR(found.expected_residual, sensor.angle_noise, 0.05 * sensor.angle_noise);
  int compared = 0;
  for (const EstimatedValue& value : found.values) {
    const ParameterInfo& info = find_parameter(value.name, sensor.shape());
    if (info.kind != ParameterKind::train || !(value.sigma > 0)) continue;
    const double truth = sensor.train[info.places.front()];
    EXPECT_LT(std::abs(value.value - truth), 4.5 * value.sigma) << value.name;
    ++compared;
  }
  EXPECT_GT(compared, 10);
}

TEST(Reflector, IsRecognisedAmongAllPresets) {
  std::vector<sensors::Sensor> candidates;
  for (const char* name : {"mid-40", "mid-70", "avia", "horizon", "tele-15", "mid-360"}) {
    candidates.push_back(sensors::load_sensor(name));
  }
  const SensorRecognition found =
      recognise_sensor(shots_of(random_unit(4), 40'000, 4), candidates, BeamSource::recorded);
  EXPECT_TRUE(found.fits);
  EXPECT_TRUE(found.decided);
  EXPECT_EQ(candidates[found.matches.front().candidate].name, "mid-360");
}

TEST(Reflector, ItsFrameTurnsAboutTheSensorsXAndY) {
  const FrameTurn turn{0.2, -0.1, true};
  const Eigen::Matrix3d rotation = recording_from_sensor(turn);
  const FrameTurn back = turn_of(rotation, true);
  EXPECT_NEAR(back.yaw, turn.yaw, 1e-15);
  EXPECT_NEAR(back.pitch, turn.pitch, 1e-15);
  const Eigen::Matrix3d rolled =
      rotation * Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_NEAR(turn_of(rolled, true).yaw, turn.yaw, 1e-14);
  // A small yaw is about the sensor's Y and moves its Z along X; a small pitch is about its X.
  const Eigen::Matrix3d small = turned_further(Eigen::Matrix3d::Identity(), {1e-4, 2e-4}, true);
  EXPECT_NEAR(small(0, 2), 1e-4, 1e-8);
  EXPECT_NEAR(small(1, 2), -2e-4, 1e-8);
}

}  // namespace risley::estimation::reflector_test
