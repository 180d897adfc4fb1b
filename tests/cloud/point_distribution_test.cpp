// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/point_distribution.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/scanner.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/interpolation.hpp"

#include "refusal.hpp"

namespace risley::cloud::point_distribution_test {

using ::testing::HasSubstr;

constexpr double kHalfField = radians_from_degrees(19.23);

trajectories::Mount nadir_mount() {
  trajectories::Mount mount;
  mount.nominal << 0, 0, 1, 0, -1, 0, 1, 0, 0;  // X down, Y to the left, Z forward
  return mount;
}

/// A straight, level flight of one strip at the middle of nothing.
trajectories::FlightPlan plan_of(double height, double speed, double length, double heading,
                                 double sway_deg = 0) {
  trajectories::FlightPlan plan;
  trajectories::Strip strip;
  strip.center = {13.0, -7.0};
  strip.heading = heading;
  strip.length = length;
  strip.height = height;
  strip.speed = speed;
  plan.strips = {strip};
  plan.lead = 0.5;
  plan.seed = 3;
  if (sway_deg > 0) {
    plan.attitude.rms.fill(radians_from_degrees(sway_deg));
    plan.attitude.lowest_frequency = 0.15;
    plan.attitude.highest_frequency = 1.2;
    plan.attitude.sinusoids = 6;
  }
  return plan;
}

struct Simulated {
  trajectories::Flight flight;
  std::vector<double> x, y, z;
  std::vector<std::uint16_t> strip;
};

/// Points of the simulator's own shots, without noise, by plain georeferencing.
Simulated simulated(const trajectories::FlightPlan& plan) {
  Simulated result;
  result.flight = trajectories::fly(plan);
  const auto trajectory =
      std::make_shared<trajectories::Trajectory>(result.flight.trajectory);
  simulation::SimulationSettings settings;
  settings.truth = sensors::load_sensor("mid-40");
  settings.angle_noise = 0;
  settings.range_noise = 0;
  settings.quantize = false;
  settings.seed = 5;
  scenes::Scene scene;
  scenes::TerrainParts parts;
  parts.ground = scenes::Ground{};
  scene.terrain.emplace(parts);
  settings.scene = scene;
  simulation::Platform platform;
  platform.trajectory = trajectory;
  platform.mount = nadir_mount();
  settings.duration = simulation::longest_duration(platform) - 1e-4;
  const std::int64_t first = simulation::first_clock_reading_ns(platform);
  settings.platform = platform;
  simulation::Scanner scanner(settings);
  const trajectories::Interpolation poses(*trajectory);
  auto cursor = poses.cursor();
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  const trajectories::StripTimes& times = result.flight.strips.at(0);
  while (scanner.read(chunk, truth)) {
    const recordings::Observations& rows = chunk.observations;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (rows.valid[i] == 0 || !(rows.range[i] > 0)) continue;
      if (rows.time_ns[i] < times.begin_ns || rows.time_ns[i] >= times.end_ns) continue;
      const auto pose = cursor.at(rows.time_ns[i]);
      const Vector3<double> d =
          direction_from_angles(SphericalAngles<double>{rows.azimuth[i], rows.zenith[i]});
      const Eigen::Vector3d point =
          pose->position + pose->attitude * (platform.mount.nominal * Eigen::Vector3d(d.x, d.y, d.z)) *
                               rows.range[i];
      result.x.push_back(point.x());
      result.y.push_back(point.y());
      result.z.push_back(point.z());
    }
  }
  EXPECT_GE(first, 0);
  result.strip.assign(result.x.size(), 1);
  return result;
}

StripLine line_of(const trajectories::FlightPlan& plan) {
  const trajectories::Strip& strip = plan.strips[0];
  const double half = 0.5 * strip.length;
  return {"strip",
          {strip.center[0] - half * std::sin(strip.heading),
           strip.center[1] - half * std::cos(strip.heading)},
          {strip.center[0] + half * std::sin(strip.heading),
           strip.center[1] + half * std::cos(strip.heading)},
          strip.height};
}

PointDistributionSummary distribution_of(const trajectories::FlightPlan& plan,
                                         const PointDistributionOptions& options = {}) {
  const Simulated own = simulated(plan);
  PointDistribution distribution({line_of(plan)},
                                 swath_reach(sensors::load_sensor("mid-40"), nadir_mount()),
                                 options);
  distribution.add(own.x, own.y, own.z, own.strip);
  return distribution.summary();
}

/// Complete elliptic integral of the first kind by its modulus, with the arithmetic-geometric mean.
double elliptic_k(double modulus) {
  double a = 1, b = std::sqrt(1 - modulus * modulus);
  while (std::abs(a - b) > 1e-14) {
    const double mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
  }
  return 0.5 * std::numbers::pi / a;
}

TEST(PointDistribution, DensityOfARosetteInMotionIsThatOfItsFormula) {
  for (const double height : {30.0, 50.0, 80.0, 120.0}) {
    const double half = height * std::tan(kHalfField);
    const double speed = 5, rate = 100'000;
    const auto summary =
        distribution_of(plan_of(height, speed, 2 * half + 20, radians_from_degrees(90)));
    ASSERT_EQ(summary.strips.size(), 1U);
    const StripDistribution& strip = summary.strips[0];
    EXPECT_NEAR(strip.width, 2 * half, 0.002 * half);
    EXPECT_NEAR(strip.height, height, 0.01);
    const double mean = rate / (2 * speed * half);
    EXPECT_NEAR(strip.density, mean, 0.005 * mean) << height;
    EXPECT_NEAR(strip.spacing, 1 / std::sqrt(mean), 0.005 / std::sqrt(mean));
    const auto formula = [&](double share) {
      return mean * 4 / (std::numbers::pi * std::numbers::pi) *
             elliptic_k(std::sqrt(1 - share * share));
    };
    std::string told;
    for (std::size_t k = 0; k < 4; ++k) {  // 0.25 to 0.9
      EXPECT_NEAR(strip.place_density[k], formula(kSwathPlaces[k]), 0.03 * formula(kSwathPlaces[k]))
          << height << " m, " << kSwathPlaces[k];
      told += " " + std::to_string(strip.place_density[k] / mean);
    }
    EXPECT_NEAR(strip.place_density[4], formula(0.97), 0.06 * formula(0.97));
    const double stripe = mean * 4 / (std::numbers::pi * std::numbers::pi) *
                          (std::log(8 * half) + 1);
    EXPECT_NEAR(strip.middle_density, stripe, 0.04 * stripe) << height;
    EXPECT_NEAR(strip.dense_width, 2 * half, 0.05 * half);
    RecordProperty("at_" + std::to_string(static_cast<int>(height)) + "_m",
                   std::to_string(strip.middle_density / mean) + told);
  }
}

TEST(PointDistribution, GapsGrowWithTheSpeed) {
  // 5, 10, 15 m/s: 0.3, 2.8, 7.8 % by an independent program, to 25 %.
  const double speeds[] = {5, 10, 15}, expected[] = {0.003, 0.028, 0.078};
  for (int k = 0; k < 3; ++k) {
    const auto summary = distribution_of(plan_of(80, speeds[k], 96, radians_from_degrees(90)));
    const StripDistribution& strip = summary.strips.at(0);
    EXPECT_NEAR(strip.empty_share, expected[k], 0.25 * expected[k]) << speeds[k];
    RecordProperty("at_" + std::to_string(static_cast<int>(speeds[k])) + "_m_per_s",
                   std::to_string(strip.empty_share) + " " +
                       std::to_string(strip.cell_variation) + " " +
                       std::to_string(strip.largest_empty[0]) + " " +
                       std::to_string(strip.largest_empty[1]) + " " +
                       std::to_string(strip.largest_empty[2]) + " " +
                       std::to_string(strip.spacing_cells_covered));
  }
}

TEST(PointDistribution, SwayWidensAndThinsTheSwath) {
  const auto summary = distribution_of(plan_of(80, 5, 160, radians_from_degrees(90), 2));
  const StripDistribution& strip = summary.strips.at(0);
  std::string told = std::to_string(strip.middle_density);
  for (const double density : strip.place_density) told += " " + std::to_string(density);
  RecordProperty("sway", told + " " + std::to_string(strip.dense_width));
  EXPECT_LT(strip.place_density[4], 0.8 * 230);
  EXPECT_LT(strip.middle_density, 0.8 * 948);
  EXPECT_LT(strip.dense_width, 53);
  EXPECT_GT(strip.dense_width, 45);
}

}  // namespace risley::cloud::point_distribution_test
