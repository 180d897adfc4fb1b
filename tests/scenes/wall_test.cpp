// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Walls with waves, bows, steps and glass.
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/scenes/scene.hpp"

#include "refusal.hpp"

namespace risley::scenes::wall_test {

/// A wall 5 m ahead, 4 m wide and 3 m high.
Scene wall_with(const std::string& fields) {
  return parse_scene(
      "planes: [{name: wall, distance_m: 5, normal_azimuth_deg: 0, normal_zenith_deg: 90, "
      "extent_m: [4, 3]" +
          (fields.empty() ? "" : ", " + fields) + "}]",
      "wall.yaml");
}

/// To a place of the plane, from the origin or elsewhere.
Vector3<double> to(double left, double up, const Vector3<double>& origin = {0, 0, 0}) {
  return normalized(Vector3<double>{5.0, left, up} - origin);
}

// The referee: how deep a point is within the wall, from the fields of the plane alone.
double depth_at(const ScenePlane& wall, const Vector3<double>& point) {
  const Vector3<double> from_foot = point - wall.plane.distance * wall.plane.normal;
  const double across = dot(from_foot, wall.horizontal_axis);
  const double up = dot(from_foot, wall.vertical_axis);
  double depth = 0.0;
  for (const Patch& patch : wall.patches) {
    if (std::abs(across - patch.center[0]) <= 0.5 * patch.size[0] &&
        std::abs(up - patch.center[1]) <= 0.5 * patch.size[1]) {
      depth = patch.depth;
    }
  }
  return dot(from_foot, wall.plane.normal) - depth - wall.shape.at(across, up).height;
}

bool in_extent(const ScenePlane& wall, const Vector3<double>& point) {
  const Vector3<double> from_foot = point - wall.plane.distance * wall.plane.normal;
  return !wall.extent ||
         (std::abs(dot(from_foot, wall.horizontal_axis)) <= 0.5 * (*wall.extent)[0] &&
          std::abs(dot(from_foot, wall.vertical_axis)) <= 0.5 * (*wall.extent)[1]);
}

/// Every ray ends where it first changes between before and behind the wall.
void expect_rays_end_on(const Scene& scene, const Vector3<double>& origin, std::uint64_t seed,
                        double longest, int& hits) {
  const ScenePlane& wall = scene.planes.front();
  const RandomStream random(seed, 1);
  for (std::uint64_t i = 0; i < 300; ++i) {
    const Vector3<double> direction =
        to(4.4 * random.uniform(2 * i) - 2.2, 3.4 * random.uniform(2 * i + 1) - 1.7, origin);
    const auto hit = nearest_hit(scene, origin, direction);
    const double end = hit ? hit->range : longest;
    constexpr double kStep = 4e-3;
    double before = 0.0;
    for (double t = kStep; t < end - 1e-6; t += kStep) {
      const Vector3<double> point = origin + t * direction;
      const double now = in_extent(wall, point) ? depth_at(wall, point) : 0.0;
      ASSERT_GE(before * now, 0.0)
          << "ray " << i << " passes through the wall at " << t << " of " << end;
      before = now;
    }
    if (!hit) continue;
    ++hits;
    const double near = depth_at(wall, origin + (end - 1e-7) * direction);
    const double beyond = depth_at(wall, origin + (end + 1e-7) * direction);
    ASSERT_LE(near * beyond, 0.0) << "ray " << i << " ends at " << end << ", not on the wall";
    ASSERT_NEAR(norm(hit->normal), 1.0, 1e-12);
    ASSERT_NEAR(hit->cosine, std::abs(dot(hit->normal, direction)), 1e-12);
  }
}

TEST(Wall, ShapesOfZeroAreThePlane) {
  const Scene flat = wall_with("");
  const Scene zero = wall_with(
      "waves: {peak_to_valley_m: 0, half_wave_m: 1}, bow_m: 0, patches: [{center_m: [0.5, 0], "
      "size_m: [1, 1], depth_m: 0}]");
  for (int i = -20; i <= 20; ++i) {
    const Vector3<double> direction = to(0.11 * i, 0.07 * i);
    const auto a = nearest_hit(flat, {0, 0, 0}, direction);
    const auto b = nearest_hit(zero, {0, 0, 0}, direction);
    ASSERT_EQ(a.has_value(), b.has_value());
    if (!a) continue;
    EXPECT_NEAR(a->range, b->range, 1e-14);
    EXPECT_NEAR(a->cosine, b->cosine, 1e-14);
    EXPECT_EQ(b->reflectivity, kMattReflectivity);
  }
}

TEST(Wall, RaysEndWhereTheyFirstMeetWavesAndSteps) {
  const std::string waves = "waves: {peak_to_valley_m: 0.06, half_wave_m: 0.4, seed: 3}";
  const std::string steps =
      "patches: [{center_m: [-1, 0], size_m: [1, 2], depth_m: 0.2}, {center_m: [-1, 0.2], "
      "size_m: [0.4, 0.5], depth_m: -0.1}, {center_m: [1.2, 0.3], size_m: [0.8, 0.9], depth_m: "
      "-0.15}]";
  for (const std::string& fields :
       {waves, steps, waves + ", " + steps, waves + ", bow_m: -0.2, " + steps}) {
    SCOPED_TRACE(fields);
    const Scene scene = wall_with(fields);
    int hits = 0;
    expect_rays_end_on(scene, {0, 0, 0}, 1, 8.0, hits);
    expect_rays_end_on(scene, {4.6, -1.5, 0.4}, 2, 8.0, hits);   // grazing
    expect_rays_end_on(scene, {4.92, -2.5, 0.0}, 3, 8.0, hits);  // from beside it
    expect_rays_end_on(scene, {9.0, 0.5, 0.0}, 4, 8.0, hits);    // from behind
    EXPECT_GT(hits, 600);
  }
}

TEST(Wall, HitsLieOnTheSurfaceToAPicometre) {
  const Scene scene = parse_scene(
      "planes: [{name: wall, distance_m: 2, normal_azimuth_deg: 45, normal_zenith_deg: 80, waves: "
      "[{peak_to_valley_m: 0.005, half_wave_m: 1}, {peak_to_valley_m: 0.002, half_wave_m: 0.2}]}]",
      "wall.yaml");
  const ScenePlane& wall = scene.planes.front();
  for (int azimuth = -40; azimuth <= 130; azimuth += 5) {  // up to 85 degrees of incidence
    const Vector3<double> direction =
        direction_from_angles<double>({radians_from_degrees(azimuth), radians_from_degrees(95)});
    const auto hit = nearest_hit(scene, {0, 0, 0}, direction);
    ASSERT_TRUE(hit);
    EXPECT_LT(std::abs(depth_at(wall, hit->range * direction)), 1e-12) << azimuth;
    // The normal is that of the surface: it stays on it for a small way along the tangents.
    for (const Vector3<double>& tangent :
         {cross(hit->normal, wall.vertical_axis), cross(hit->normal, wall.horizontal_axis)}) {
      constexpr double kWay = 1e-4;
      const Vector3<double> ahead = hit->range * direction + kWay * tangent;
      const Vector3<double> back = hit->range * direction - kWay * tangent;
      EXPECT_LT(std::abs(depth_at(wall, ahead) - depth_at(wall, back)), 1e-9) << azimuth;
    }
  }
}

TEST(Wall, WavesHaveTheStatedRmsAndLength) {
  const WallWaves waves{0.005, 1.5, 0};
  EXPECT_NEAR(waves.rms(), 0.005 / 2.8284271247461903, 1e-15);
  double square = 0, slope = 0;
  int count = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    WallWaves one = waves;
    one.seed = seed;
    const WallShape shape(std::vector{one}, 0.0, {}, {0.0, 0.0});
    EXPECT_FALSE(shape.flat());
    for (int i = 0; i < 40; ++i) {
      for (int j = 0; j < 40; ++j) {
        const Deviation d = shape.at(0.77 * i, 0.77 * j);
        square += d.height * d.height;
        slope += d.horizontal_slope * d.horizontal_slope + d.vertical_slope * d.vertical_slope;
        ASSERT_LE(std::abs(d.height), shape.highest());
        ASSERT_LE(std::hypot(d.horizontal_slope, d.vertical_slope), shape.steepest());
        constexpr double kWay = 1e-6;
        const Deviation ahead = shape.at(0.77 * i + kWay, 0.77 * j);
        ASSERT_NEAR((ahead.height - d.height) / kWay, d.horizontal_slope, 1e-7);
        ASSERT_LE(std::abs(ahead.horizontal_slope - d.horizontal_slope) / kWay,
                  shape.strongest_bend());
        ++count;
      }
    }
  }
  const double rms = std::sqrt(square / count);
  EXPECT_NEAR(rms / waves.rms(), 1.0, 0.03);
  // rms slope over rms height is a mean wave number.
  EXPECT_NEAR(kPi / (std::sqrt(slope / count) / rms), 1.5, 0.1);
}

TEST(Wall, SeedsMakeWaves) {
  const auto height = [](std::uint64_t seed) {
    return WallShape(std::vector{WallWaves{0.005, 1.0, seed}}, 0.0, {}, {0.0, 0.0})
        .at(0.3, 0.4)
        .height;
  };
  EXPECT_EQ(height(5), height(5));
  EXPECT_NE(height(5), height(6));
  // Planes that state no seed have waves of their own.
  const Scene scene = parse_scene(R"(
planes:
  - {name: a, distance_m: 5, normal_azimuth_deg: 0, normal_zenith_deg: 90, waves: {peak_to_valley_m: 0.005, half_wave_m: 1}}
  - {name: b, distance_m: 5, normal_azimuth_deg: 0, normal_zenith_deg: 90, waves: {peak_to_valley_m: 0.005, half_wave_m: 1}}
)",
                                  "walls.yaml");
  EXPECT_NE(scene.planes[0].shape.at(0, 0).height, scene.planes[1].shape.at(0, 0).height);
}

TEST(Wall, ABowIsOneHalfWaveOverTheExtent) {
  const WallShape shape({}, 0.02, std::array{4.0, 3.0}, {1.0, -0.5});
  EXPECT_NEAR(shape.at(1.0, -0.5).height, 0.02, 1e-15);
  EXPECT_NEAR(shape.at(3.0, -0.5).height, 0.0, 1e-15);
  EXPECT_NEAR(shape.at(1.0, 1.0).height, 0.0, 1e-15);
  EXPECT_NEAR(shape.at(2.0, -0.5).height, 0.02 * std::sqrt(0.5), 1e-15);
  const auto hit = nearest_hit(wall_with("bow_m: 0.02"), {0, 0, 0}, {1, 0, 0});
  EXPECT_NEAR(hit->range, 5.02, 1e-12);
}

TEST(Wall, PatchesStandBehindAndBeforeTheWall) {
  const Scene scene = wall_with(
      "reflectivity: 0.6, patches: [{name: door, center_m: [-1, 0], size_m: [1, 2], depth_m: 0.1, "
      "reflectivity: 0.3}, {name: board, center_m: [1, 0], size_m: [1, 1], depth_m: -0.018}, "
      "{center_m: [1, 0], size_m: [0.2, 0.2], depth_m: -0.018, reflectivity: 0.05}]");
  const auto straight_at = [&](double left, double up) {
    return nearest_hit(scene, {0, left, up}, {1, 0, 0}).value();
  };
  EXPECT_NEAR(straight_at(0, 0).range, 5.0, 1e-12);
  EXPECT_EQ(straight_at(0, 0).reflectivity, 0.6);
  EXPECT_NEAR(straight_at(-1, 0.9).range, 5.1, 1e-12);
  EXPECT_EQ(straight_at(-1, 0.9).reflectivity, 0.3);
  EXPECT_NEAR(straight_at(1.4, 0).range, 4.982, 1e-12);
  EXPECT_EQ(straight_at(1.4, 0).reflectivity, 0.6);
  EXPECT_EQ(straight_at(1.05, 0.05).reflectivity, 0.05);
  // The reveal of the door: a ray over its edge meets the side of the step, of the wall's material.
  const Vector3<double> origin{0, -2.9, 0};
  const Vector3<double> direction = normalized(Vector3<double>{5.05, 2.4, 0});
  const auto reveal = nearest_hit(scene, origin, direction);
  ASSERT_TRUE(reveal);
  EXPECT_NEAR((origin + reveal->range * direction).y, -0.5, 1e-12);
  EXPECT_NEAR(std::abs(reveal->normal.y), 1.0, 1e-12);
  EXPECT_EQ(reveal->reflectivity, 0.6);
}

TEST(Wall, GlassLetsRaysThroughAndMirrorsThoseThatComeStraight) {
  const Scene scene = parse_scene(R"(
planes:
  - {name: wall, distance_m: 5, normal_azimuth_deg: 0, normal_zenith_deg: 90, patches: [{name: window, center_m: [0, 0], size_m: [2, 2], glass: yes}]}
  - {name: yard, distance_m: 9, normal_azimuth_deg: 0, normal_zenith_deg: 90, extent_m: [1, 20]}
)",
                                  "window.yaml");
  const auto straight = nearest_hit(scene, {0, 0, 0}, {1, 0, 0});
  EXPECT_EQ(straight->surface, 0U);
  EXPECT_EQ(straight->reflectivity, kMattReflectivity);
  const auto through = nearest_hit(scene, {0, 0, 0}, to(0, 0.4));
  ASSERT_TRUE(through);
  EXPECT_EQ(through->surface, 1U);
  EXPECT_NEAR(through->reflectivity, kMattReflectivity * kGlassTransmission, 1e-15);
  EXPECT_FALSE(nearest_hit(scene, {0, 0, 0}, to(0.6, 0)));  // past what is behind
  const auto beside = nearest_hit(scene, {0, 0, 0}, to(0, 1.1));
  EXPECT_EQ(beside->surface, 0U);
  EXPECT_EQ(beside->reflectivity, kMattReflectivity);
  // A pane behind the target weakens nothing.
  EXPECT_EQ(nearest_hit(scene, {20, 0, 0.5}, {-1, 0, 0})->reflectivity, kMattReflectivity);
}

TEST(Wall, ShapesAskForNumbersThatMakeSense) {
  const auto run = [](const WallWaves& waves, double bow, bool extent) {
    return refusal([&] {
      return WallShape(std::vector{waves}, bow,
                       extent ? std::optional(std::array{1.0, 1.0}) : std::nullopt, {0.0, 0.0});
    });
  };
  EXPECT_EQ(run({0.001, 1, 0}, 0, false), "");
  EXPECT_EQ(run({-0.001, 1, 0}, 0, false), "peak_to_valley = -0.001 m, allowed 0 and above");
  EXPECT_EQ(run({0.001, 0, 0}, 0, false), "half_wave = 0 m, allowed above 0");
  EXPECT_EQ(run({0.001, 1, 0}, NAN, true), "bow = nan m, allowed finite");
  EXPECT_EQ(run({0.001, 1, 0}, 0.1, false), "a bow needs an extent");
}

TEST(Wall, PatchesLieWithinTheExtent) {
  EXPECT_EQ(line_and_problem([] {
              wall_with("patches: [{center_m: [1.8, 0], size_m: [1, 1]}]");
            }).find("1: planes[0].patches[0].size_m reaches beyond the extent of \"wall\""),
            0U);
}

}  // namespace risley::scenes::wall_test
