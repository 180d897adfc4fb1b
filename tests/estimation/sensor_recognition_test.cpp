// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Which sensor made a recording, recognised from its shots alone: mirrored, turned, half under the
// sky, cut anywhere.
#include "risley/estimation/sensor_recognition.hpp"

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/spectral_lines.hpp"
#include "risley/optics/observation_model.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::estimation::sensor_recognition_test {

constexpr double deg(double degrees) { return radians_from_degrees(degrees); }

/// What happened to a scan on its way into a file.
struct Scene {
  bool mirrored = false, sky = false;
  double gross = 0.02;                  // share of shots with gross errors
  double yaw = 0, pitch = 0, roll = 0;  // of the recording's frame, rad
  FiringOrder order;
  BeamSource beams = BeamSource::counted;
};

/// A tenth of a second, 24,000 shots a second.
AngleSeries scan(const sensors::Sensor& sensor, const Scene& scene) {
  constexpr double kRate = 24000.0, kDuration = 0.1;
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal(0.0, deg(0.01));
  std::uniform_real_distribution<double> uniform;
  const Eigen::Matrix3d frame =
      recording_from_sensor({scene.yaw, scene.pitch}) *
      Eigen::AngleAxisd(scene.roll, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const int emitters = sensor.train.emitters();
  AngleSeries series;
  for (int i = 0; i < static_cast<int>(kRate * kDuration); ++i) {
    const double time = i / kRate;
    std::vector<double> angles;
    for (std::size_t k = 0; k < sensor.angular_velocity.size(); ++k) {
      angles.push_back(1.0 + 2.0 * static_cast<double>(k) + time * sensor.angular_velocity[k]);
    }
    const int steps = scene.order.backwards ? emitters - i % emitters : i % emitters;
    const int emitter = (scene.order.first_emitter + steps) % emitters;
    const auto v = observe(sensor.train, angles, emitter).direction;
    const Eigen::Vector3d recorded = frame * Eigen::Vector3d(v.x, v.y, scene.mirrored ? -v.z : v.z);
    if (scene.sky && recorded.z() > 0.03) continue;
    const auto direction =
        angles_from_direction(Vector3<double>{recorded.x(), recorded.y(), recorded.z()});
    const bool gross = uniform(generator) < scene.gross;
    const double up = normal(generator);  // one draw a line: compilers order arguments as they like
    const double aside = gross ? uniform(generator) - 0.5 : normal(generator);
    const int beam = scene.beams == BeamSource::recorded ? emitter : i % 6;
    series.append(std::llround(1e9 * time), direction.azimuth + aside, direction.zenith + up,
                  static_cast<std::uint8_t>(beam));
  }
  return series;
}

std::vector<sensors::Sensor> types() {
  std::vector<sensors::Sensor> result;
  for (const char* name : {"mid-40", "mid-70", "avia", "horizon", "tele-15"}) {
    result.push_back(sensors::load_sensor(name));
  }
  return result;
}

TEST(SensorRecognition, KnowsEverySensorWhateverHappenedToItsScan) {
  const std::vector<sensors::Sensor> sensors = types();
  std::vector<Scene> scenes(2);
  scenes[0].sky = true;
  scenes[0].order = {2, true};
  scenes[1].mirrored = scenes[1].sky = true;
  scenes[1].yaw = deg(26.0);
  scenes[1].pitch = deg(-3.0);
  scenes[1].order.first_emitter = 4;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    for (const Scene& scene : scenes) {
      SCOPED_TRACE(sensors[i].name + (scene.mirrored ? " mirrored" : ""));
      const SensorRecognition found =
          recognise_sensor(scan(sensors[i], scene), sensors, BeamSource::counted);
      ASSERT_EQ(found.matches.size(), sensors.size());
      const SensorMatch& best = found.matches.front();
      EXPECT_EQ(best.candidate, i);
      EXPECT_TRUE(found.fits && found.decided);
      EXPECT_GT(found.matches[1].misfit, 3.0 * best.misfit);
      EXPECT_NEAR(best.frame.yaw, scene.yaw, deg(1.0));
      EXPECT_NEAR(best.frame.pitch, scene.pitch, deg(1.0));
      EXPECT_NEAR(best.roll, 0.0, deg(15.0));  // gross errors move narrow emitters
      if (sensors[i].train.emitters() == 1) continue;
      EXPECT_EQ(best.mirrored, scene.mirrored);
      EXPECT_EQ(best.order.first_emitter, scene.order.first_emitter);
      EXPECT_EQ(best.order.backwards, scene.order.backwards);
    }
  }
}

TEST(SensorRecognition, ASmallWindowOfAMid70IsNoMid40OfImpossibleGlass) {
  const std::vector<sensors::Sensor> sensors = types();
  sensors::Sensor unit = sensors[1];
  unit.set("bearing_tilt_a_horizontal_deg", deg(-0.3));
  unit.set("prism_tilt_a_vertical_deg", deg(0.4));
  constexpr double kRate = 100e3, kDuration = 0.3;
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal(0.0, deg(0.005));
  AngleSeries series;
  for (int i = 0; i < static_cast<int>(kRate * kDuration); ++i) {
    const double time = i / kRate;
    const std::vector<double> angles = {3.8 + time * unit.angular_velocity[0],
                                        5.5 + time * unit.angular_velocity[1]};
    const Observation seen = observe(unit.train, angles);
    if (std::abs(seen.azimuth - deg(1)) > deg(10) || std::abs(seen.zenith - deg(94)) > deg(7.5)) {
      continue;
    }
    series.append(std::llround(1e9 * time), seen.azimuth + normal(generator),
                  seen.zenith + normal(generator), 0);
  }
  // Freed, a Mid-40 describes it as well, with an index off by 0.3 and a prism tilted by 17
  // degrees.
  const SensorRecognition found = recognise_sensor(series, sensors, BeamSource::recorded);
  EXPECT_EQ(sensors[found.matches.front().candidate].name, "mid-70");
  EXPECT_TRUE(found.decided);
}

TEST(SensorRecognition, EmittersThatTheFileNamesTellTheRoll) {
  const std::vector<sensors::Sensor> sensors = types();
  Scene scene;
  scene.beams = BeamSource::recorded;
  for (const std::size_t i : {2u, 3u, 4u}) {
    for (const double roll : {180.0, 90.0, -30.0}) {
      SCOPED_TRACE(sensors[i].name + " " + std::to_string(roll));
      scene.roll = deg(roll);
      // Of 30 scans each, the worst was off by 0.13 degree, the Horizon's by 1.06: its two rotors
      // of equal speeds leave more within a tenth of a second. Gross errors move the roll: the
      // Avia's by 3 degrees rms, less in this scan; others may find none. They hide no sensor.
      for (const double gross : {0.0, 0.02}) {
        scene.gross = gross;
        const SensorRecognition found =
            recognise_sensor(scan(sensors[i], scene), sensors, BeamSource::recorded);
        const SensorMatch& best = found.matches.front();
        EXPECT_EQ(best.candidate, i);
        EXPECT_TRUE(found.decided);
        if (gross == 0 || i == 2) {
          EXPECT_LT(std::abs(wrap_to_pi(best.roll - scene.roll)), deg(gross == 0 ? 1.3 : 3.0));
        }
        for (const SensorMatch& match : found.matches) {  // sixth beams have only those with six
          if (sensors[match.candidate].train.emitters() == 1) {
            EXPECT_FALSE(std::isfinite(match.misfit));
          }
        }
      }
    }
  }
}

TEST(SensorRecognition, ASensorThatNoPresetDescribesIsNotRecognised) {
  const std::vector<sensors::Sensor> sensors = types();
  sensors::Sensor other = sensors[2];
  other.angular_velocity = {deg(-33000.0), deg(9000.0)};
  Scene scene;
  scene.beams = BeamSource::recorded;
  const SensorRecognition found =
      recognise_sensor(scan(other, scene), sensors, BeamSource::recorded);
  EXPECT_FALSE(found.decided);
  AngleSeries few = rows_of(scan(sensors[0], {}), 0, 20);
  EXPECT_THROW(recognise_sensor(few, sensors, BeamSource::counted), EstimationError);
  EXPECT_TRUE(recognise_sensor(few, {}, BeamSource::counted).matches.empty());
}

TEST(SensorRecognition, TheSmallestFieldThatHoldsTheShots) {
  const std::vector<sensors::Sensor> sensors = types();
  const auto field_of = [&](std::size_t i, const Scene& scene, BeamSource beams) {
    return smallest_field(scan(sensors[i], scene), sensors, beams);
  };
  EXPECT_EQ(field_of(0, {}, BeamSource::counted), 0u);
  EXPECT_EQ(field_of(1, {}, BeamSource::counted), 1u);
  EXPECT_EQ(field_of(4, {}, BeamSource::counted), 4u);
  Scene turned;
  turned.yaw = deg(60.0);
  EXPECT_EQ(field_of(4, turned, BeamSource::counted), 4u);
  turned.beams = BeamSource::recorded;
  EXPECT_EQ(field_of(2, turned, BeamSource::recorded), 2u);
  EXPECT_EQ(smallest_field({}, sensors, BeamSource::counted), std::nullopt);
}

TEST(SensorRecognition, BeamsAreNumberedInTheOrderOfFiring) {
  AngleSeries series;
  for (int i = 0; i < 4; ++i) series.append(i, 0.0, 1.5, static_cast<std::uint8_t>(i));
  AngleSeries one = series;
  number_beams(series, sensors::load_sensor("avia"), {1, true});
  EXPECT_EQ(series.beam, (std::vector<std::uint8_t>{1, 0, 5, 4}));
  number_beams(one, sensors::load_sensor("mid-40"), {});
  EXPECT_EQ(one.beam, std::vector<std::uint8_t>(4, 0));
}

TEST(SpectralLines, AmplitudesThatMustBeOthersLeaveMore) {
  // Full coverage: what two lines leave grows with the squares of the differences.
  const std::vector<sensors::Sensor> sensors = types();
  const LineSearch search(scan(sensors[0], {}));
  const RotorLines lines = search.near(sensors[0].angular_velocity, 0.06, 1).front();
  const std::vector<double> same = {lines.lines[0].amplitude, lines.lines[1].amplitude};
  EXPECT_NEAR(unexplained_with(lines, same), lines.unexplained, 1e-12);
  const std::vector<double> other = {same[0] + 0.1, same[1] - 0.05};
  EXPECT_NEAR(unexplained_with(lines, other) - lines.unexplained, 0.01 + 0.0025, 0.002);
}

}  // namespace risley::estimation::sensor_recognition_test
