// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// What a sensor sees of walls, furniture and people, with a footprint and errors of its ranges.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"

namespace risley::simulation::real_walls_test {

struct Shots {
  std::vector<double> range, true_range;
  std::vector<int> intensity, emitter;
  std::vector<Vector3<double>> direction;  ///< true, sensor frame
  std::vector<double> time;                ///< s

  std::size_t size() const { return range.size(); }
  std::size_t returns() const {
    return static_cast<std::size_t>(std::ranges::count_if(range, [](double r) { return r > 0.0; }));
  }
};

Shots scan(const SimulationSettings& settings, std::size_t piece = 65536) {
  Scanner scanner(settings);
  Shots shots;
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  while (scanner.read(chunk, truth, piece)) {
    const recordings::Observations& rows = chunk.observations;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      shots.range.push_back(rows.range[i]);
      shots.true_range.push_back(truth.range[i]);
      shots.intensity.push_back(rows.intensity[i]);
      shots.emitter.push_back(rows.beam[i]);
      shots.direction.push_back(direction_from_angles<double>({truth.azimuth[i], truth.zenith[i]}));
      shots.time.push_back(1e-9 * static_cast<double>(rows.time_ns[i]));
    }
  }
  return shots;
}

/// Without noise, beams from the origin.
SimulationSettings exact(const std::string& sensor, const std::string& scene) {
  SimulationSettings settings;
  settings.truth = sensors::load_sensor(sensor);
  settings.truth.set_prism_geometry({});
  settings.angle_noise = 0.0;
  settings.range_noise = 0.0;
  settings.quantize = false;
  settings.duration = 0.1;
  settings.scene = scenes::parse_scene(scene, "scene.yaml");
  return settings;
}

const std::string kWall =
    "planes: [{name: wall, distance_m: 6, normal_azimuth_deg: 30, normal_zenith_deg: 75}]\n";

TEST(RealWalls, RangeErrorsAreThoseOfTheSensor) {
  SimulationSettings settings = exact("avia", kWall);
  sensors::Sensor& sensor = settings.truth;
  sensor.range_offset = -0.004;
  sensor.range_errors = {0.015, 0.3, 0.01, {0.001, 0.002, -0.003, 0.0, 0.005, 0.006}};
  const Shots shots = scan(settings);
  const Vector3<double> normal = settings.scene->planes.front().plane.normal;
  ASSERT_EQ(shots.returns(), shots.size());
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const double r = shots.true_range[i];
    const Vector3<double>& u = shots.direction[i];
    ASSERT_NEAR(shots.intensity[i], 120.0 * dot(normal, u), 0.501);
    // How much the range changes when the beam turns about its vertical and its horizontal axis.
    const auto range_at = [&](double azimuth, double zenith) {
      auto angles = angles_from_direction(u);
      angles.azimuth += azimuth;
      angles.zenith += zenith;
      return 6.0 / dot(normal, direction_from_angles(angles));
    };
    constexpr double kTurn = 1e-6;
    const double level = std::hypot(u.x, u.y);
    const double across = (range_at(kTurn, 0) - range_at(-kTurn, 0)) / (2 * kTurn * level);
    const double up = (range_at(0, kTurn) - range_at(0, -kTurn)) / (2 * kTurn);
    const double depth = 0.5 * std::hypot(across * sensor.beam_divergence_horizontal,
                                          up * sensor.beam_divergence_vertical);
    const double expected = -0.004 + 0.015 * std::exp(-(r - 1.0) / 2.0) + 0.3 * depth +
                            0.01 * std::log10(100.0 / shots.intensity[i]) +
                            sensor.range_errors.emitter[shots.emitter[i]];
    ASSERT_NEAR(shots.range[i] - r, expected, 1e-8) << i;
  }
}

TEST(RealWalls, AFootprintChangesLittleOfAFlatWall) {
  SimulationSettings settings = exact("mid-40", kWall);
  const Shots line = scan(settings);
  settings.scene->footprint = true;
  const Shots wide = scan(settings);
  double square = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    ASSERT_EQ(line.true_range[i], wide.true_range[i]);
    ASSERT_NEAR(line.range[i], wide.range[i], 1e-4);
    ASSERT_NEAR(line.intensity[i], wide.intensity[i], 1.0);
    square += std::pow(line.range[i] - wide.range[i], 2);
  }
  EXPECT_GT(square, 0.0);
}

/// A board that covers the left half of a wall that is farther away.
std::string edge(double behind) {
  return "planes:\n"
         "  - {name: board, distance_m: 6, normal_azimuth_deg: 0, normal_zenith_deg: 90, extent_m: "
         "[20, 40], center_m: [10, 0], reflectivity: 0.4}\n"
         "  - {name: wall, normal_azimuth_deg: 0, normal_zenith_deg: 90, distance_m: " +
         std::to_string(6 + behind) + "}\nfootprint: yes\n";
}

TEST(RealWalls, PixelsAreMixedAtEdgesAndOnlyThere) {
  const SimulationSettings settings = exact("mid-40", edge(0.3));
  const Shots shots = scan(settings);
  // Half of the horizontal divergence of 0.03 degree, in ninths up to 4/9.
  const double half = settings.truth.beam_divergence_horizontal * 4.0 / 9.0;
  int mixed = 0;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const Vector3<double>& u = shots.direction[i];
    const double near = 6.0 / u.x, far = 6.3 / u.x;
    const double from_edge = std::atan2(u.y, std::hypot(u.x, u.z));
    if (std::abs(from_edge) > 1.2 * half) {
      ASSERT_NEAR(shots.range[i], u.y > 0 ? near : far, 1e-4) << i;
      ASSERT_NEAR(shots.intensity[i], (u.y > 0 ? 60.0 : 120.0) * u.x, 0.6);
    } else {
      ASSERT_GE(shots.range[i], near - 1e-4);
      ASSERT_LE(shots.range[i], far + 1e-4);
      if (shots.range[i] > near + 0.01 && shots.range[i] < far - 0.01) ++mixed;
    }
  }
  EXPECT_GT(mixed, 3);
}

TEST(RealWalls, SurfacesFarFromEachOtherAreTwoPulses) {
  const SimulationSettings settings = exact("mid-40", edge(2.0));
  const Shots shots = scan(settings);
  int weak = 0;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const double near = 6.0 / shots.direction[i].x, far = 8.0 / shots.direction[i].x;
    ASSERT_LT(std::min(std::abs(shots.range[i] - near), std::abs(shots.range[i] - far)), 5e-3);
    // Where the first pulse has a part of the beam, it is weaker.
    if (shots.range[i] < near + 0.1 && shots.intensity[i] < 50) ++weak;
  }
  EXPECT_GT(weak, 3);
}

TEST(RealWalls, DarkSurfacesEndBeforeBrightOnes) {
  const auto returns = [](double distance_m, const std::string& fields, const std::string& more) {
    SimulationSettings settings =
        exact("mid-40", "planes: [{name: wall, normal_azimuth_deg: 0, normal_zenith_deg: 90, " +
                            fields + "distance_m: " + std::to_string(distance_m) + "}]\n" + more);
    settings.duration = 0.02;
    const Shots shots = scan(settings);
    return std::pair{static_cast<double>(shots.returns()) / static_cast<double>(shots.size()),
                     *std::ranges::max_element(shots.intensity)};
  };
  const std::string limit = "limit_by_reflectivity: yes\n";
  // 260 m sqrt(0.1 / 0.8) = 91.9 m; at an angle a the range is d / cos a and cos a is left.
  EXPECT_EQ(returns(70, "reflectivity: 0.1, ", limit), std::pair(1.0, 15));
  EXPECT_GT(returns(91, "reflectivity: 0.1, ", limit).first, 0.0);
  EXPECT_LT(returns(91, "reflectivity: 0.1, ", limit).first, 0.5);
  EXPECT_EQ(returns(92, "reflectivity: 0.1, ", limit).first, 0.0);
  EXPECT_EQ(returns(92, "reflectivity: 0.1, ", "").first, 1.0);
  EXPECT_EQ(returns(200, "", limit).first, 1.0);
  EXPECT_EQ(returns(92, "reflectivity: 0.1, ", limit + "footprint: yes\n").first, 0.0);
}

TEST(RealWalls, WindowsHaveNoReturns) {
  SimulationSettings settings =
      exact("mid-40",
            "planes: [{name: wall, distance_m: 6, normal_azimuth_deg: 20, normal_zenith_deg: 90, "
            "patches: "
            "[{center_m: [-2.2, 0], size_m: [2, 1], depth_m: 0.1, glass: yes}]}]\n");
  const Shots shots = scan(settings);
  EXPECT_LT(shots.returns(), shots.size() * 9 / 10);
  EXPECT_GT(shots.returns(), shots.size() / 2);
}

TEST(RealWalls, PeopleAreWhereTheyWalkAtTheTimeOfTheShot) {
  SimulationSettings settings =
      exact("mid-40", kWall +
                          "people: [{name: walker, from_m: [4, -1, -0.9], to_m: [4, 1, -0.9], "
                          "speed_m_per_s: 2, size_m: [0.5, 1.8]}]\n");
  settings.duration = 2.0;
  settings.rate = 20'000;
  const Shots shots = scan(settings);
  int seen = 0;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    if (shots.true_range[i] > 4.6) continue;
    ++seen;
    const double t = shots.time[i];
    const double left = t < 1.0 ? -1.0 + 2.0 * t : 3.0 - 2.0 * t;
    const Vector3<double> place = shots.true_range[i] * shots.direction[i];
    const double from_middle = std::pow((place.x - 4.0) / 0.25, 2) +
                               std::pow((place.y - left) / 0.25, 2) + std::pow(place.z / 0.9, 2);
    ASSERT_NEAR(from_middle, 1.0, 1e-9) << i;
  }
  EXPECT_GT(seen, 1000);
}

}  // namespace risley::simulation::real_walls_test
