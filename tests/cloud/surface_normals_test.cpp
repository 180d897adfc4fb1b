// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/surface_normals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/plane.hpp"
#include "risley/core/random.hpp"

namespace risley::cloud::surface_normals_test {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
const double kFieldRadius = radians_from_degrees(19.2);  // of a Mid-40
const std::size_t kShots = 25000;                        // of one second of a cloud

/// Nearer to the field's rim than this, the shots around a direction stand on one side of it.
const double kRim = radians_from_degrees(2.2);

/// A direction within the field of view about the X axis.
struct Shot {
  double azimuth = 0, zenith = 0;
  Vector3<double> direction() const {
    return direction_from_angles(SphericalAngles<double>{azimuth, zenith});
  }
};

/// Directions uniform over the field of view.
std::vector<Shot> shots_over_the_field(std::size_t count, std::uint64_t seed,
                                       double radius = kFieldRadius) {
  const RandomStream stream(seed, 1);
  std::vector<Shot> shots;
  for (std::uint64_t i = 0; shots.size() < count; ++i) {
    const double a = radius * (2.0 * stream.uniform(2 * i) - 1.0);
    const double e = radius * (2.0 * stream.uniform(2 * i + 1) - 1.0);
    if (a * a + e * e < radius * radius) shots.push_back({a, kPi / 2 - e});
  }
  return shots;
}

/// A plane whose normal is tilted by this much towards some side, so far along the X axis.
Plane tilted_plane(double tilt_deg, double side_deg, double ahead) {
  const double tilt = radians_from_degrees(tilt_deg), side = radians_from_degrees(side_deg);
  const Vector3<double> normal{std::cos(tilt), std::sin(tilt) * std::cos(side),
                               std::sin(tilt) * std::sin(side)};
  return {normal, ahead * normal.x};
}

double range_of(const Plane& plane, const Shot& shot) {
  return hit_distance(plane, {0, 0, 0}, shot.direction());
}

/// Between two normals of either sign, degrees.
double angle_deg(const Vector3<double>& a, const Vector3<double>& b) {
  return degrees_from_radians(std::atan2(norm(cross(a, b)), std::abs(dot(a, b))));
}

bool none(const Vector3<double>& normal) {
  return std::isnan(normal.x) && std::isnan(normal.y) && std::isnan(normal.z);
}

struct Outcome {
  double worst_deg = 0, worst_inside_deg = 0, squares = 0;
  std::size_t found = 0, missing = 0;
  double rms_deg() const { return std::sqrt(squares / static_cast<double>(found)); }
};

/// Adds shots of a plane with noise and looks at the normals in the same directions.
Outcome see(const Plane& plane, double range_noise, double noise, std::uint64_t seed) {
  SurfaceNormals normals(range_noise);
  const auto shots = shots_over_the_field(kShots, seed);
  const RandomStream stream(seed, 2);
  std::vector<std::pair<Shot, double>> met;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const double range = range_of(plane, shots[i]);
    if (!(range > 0 && range < 260)) continue;
    met.emplace_back(shots[i], range + noise * stream.normal(i));
    normals.add(shots[i].azimuth, shots[i].zenith, met.back().second);
  }
  normals.fit();
  Outcome outcome;
  for (const auto& [shot, range] : met) {
    const Vector3<double> normal = normals.normal(shot.azimuth, shot.zenith, range);
    if (none(normal)) {
      ++outcome.missing;
      continue;
    }
    EXPECT_NEAR(norm(normal), 1.0, 1e-6);
    const double off = angle_deg(normal, plane.normal);
    outcome.worst_deg = std::max(outcome.worst_deg, off);
    if (std::hypot(shot.azimuth, shot.zenith - kPi / 2) < kFieldRadius - kRim) {
      outcome.worst_inside_deg = std::max(outcome.worst_inside_deg, off);
    }
    outcome.squares += off * off;
    ++outcome.found;
  }
  return outcome;
}

TEST(SurfaceNormals, OfPlanesWithoutNoiseAreRight) {
  double worst = 0, worst_inside = 0;
  for (const double ahead : {1.0, 5.0, 20.0, 60.0}) {
    for (const double tilt : {0.0, 10.0, 25.0, 45.0, 60.0, 70.0}) {
      for (const double side : {0.0, 60.0, 90.0, 200.0, 315.0}) {
        SCOPED_TRACE(fmt::format("{} m, {} deg towards {} deg", ahead, tilt, side));
        const Outcome outcome = see(tilted_plane(tilt, side, ahead), 0.02, 0.0, 3);
        EXPECT_LT(outcome.worst_inside_deg, 1e-4);
        EXPECT_LT(outcome.worst_deg, 1e-4);
        worst_inside = std::max(worst_inside, outcome.worst_inside_deg);
        EXPECT_GT(outcome.found, 100 * outcome.missing);
        worst = std::max(worst, outcome.worst_deg);
      }
    }
  }
  RecordProperty("worst_inside_deg", fmt::format("{:.3g}", worst_inside));
  RecordProperty("worst_deg", fmt::format("{:.3g}", worst));
}

// A wall of range noise s at r metres, seen through a square of three degrees with n shots: the
// slope of the range over an angle is known to s / (0.866 degree root n), which turns the normal by
// that over r.
TEST(SurfaceNormals, ScatterAsTheNoiseOfTheRangesSays) {
  const double per_square = static_cast<double>(kShots) * 9.0 / (kPi * 19.2 * 19.2);
  for (const auto& [ahead, noise] :
       {std::pair{5.0, 0.005}, {5.0, 0.02}, {20.0, 0.01}, {20.0, 0.02}, {50.0, 0.02}}) {
    SCOPED_TRACE(fmt::format("{} m, {} m", ahead, noise));
    const Outcome outcome = see(tilted_plane(0, 0, ahead), noise, noise, 5);
    const double slope =
        noise / (ahead * radians_from_degrees(3.0 / std::sqrt(12.0)) * std::sqrt(per_square));
    const double expected = degrees_from_radians(std::sqrt(2.0) * slope);
    EXPECT_GT(outcome.rms_deg(), 0.9 * expected);
    EXPECT_LT(outcome.rms_deg(), 1.4 * expected);  // fewer shots at the rim
    EXPECT_EQ(outcome.missing, 0u);
  }
}

// On a surface that is nearly along the beam, directions that are off scatter the ranges far more
// than the ranges' own noise does.
TEST(SurfaceNormals, OfSlantedSurfacesKnowTheNoiseOfDirections) {
  const double noise = 0.01, turn = radians_from_degrees(0.03);
  const Plane wall = tilted_plane(80, 90, 4.0);
  const RandomStream stream(21, 2);
  const auto shots = shots_over_the_field(kShots, 21);
  for (const double known : {0.0, turn}) {
    SurfaceNormals normals(noise, known);
    std::vector<std::pair<Shot, double>> met;
    for (std::size_t i = 0; i < shots.size(); ++i) {
      const double range = range_of(wall, shots[i]);
      const Shot seen{shots[i].azimuth + turn * stream.normal(3 * i),
                      shots[i].zenith + turn * stream.normal(3 * i + 1)};
      if (!(range > 20 && range < 60)) continue;
      met.emplace_back(seen, range + noise * stream.normal(3 * i + 2));
      normals.add(seen.azimuth, seen.zenith, met.back().second);
    }
    normals.fit();
    double missing = 0;
    for (const auto& [shot, range] : met) {
      const Vector3<double> normal = normals.normal(shot.azimuth, shot.zenith, range);
      if (none(normal)) {
        missing += 1;
      } else {
        EXPECT_LT(angle_deg(normal, wall.normal), 1.0);
      }
    }
    ASSERT_GT(met.size(), 500u);
    const double share = missing / static_cast<double>(met.size());
    EXPECT_TRUE(known > 0 ? share < 0.01 : share > 0.3) << share << " with " << known;
  }
}

// Two walls that meet at a corner: each shot has the normal of its own wall, up to the edge. There
// ranges do not separate the walls: ten millimetres are 0.03 degree of 90.
TEST(SurfaceNormals, WallsReachToTheEdgeWhereTheyMeet) {
  const double noise = 0.01;
  const Plane left = tilted_plane(45, 0, 10.0), right = tilted_plane(45, 180, 10.0);
  SurfaceNormals normals(noise);
  const RandomStream stream(7, 2);
  const auto shots = shots_over_the_field(kShots, 7);
  const auto range = [&](std::size_t i) {
    return std::min(range_of(left, shots[i]), range_of(right, shots[i])) + noise * stream.normal(i);
  };
  for (std::size_t i = 0; i < shots.size(); ++i) {
    normals.add(shots[i].azimuth, shots[i].zenith, range(i));
  }
  normals.fit();
  double missing = 0, wrong = 0;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const Vector3<double> normal = normals.normal(shots[i].azimuth, shots[i].zenith, range(i));
    if (none(normal)) {
      missing += 1;
    } else if (angle_deg(normal, (shots[i].azimuth > 0 ? left : right).normal) > 3.0) {
      wrong += 1;
      EXPECT_LT(std::abs(degrees_from_radians(shots[i].azimuth)), 0.2);
    }
  }
  EXPECT_LT(missing, 0.005 * kShots);  // beyond three sigmas within two degrees of the edge
  EXPECT_LT(wrong, 0.005 * kShots);
  EXPECT_GT(wrong, 0);  // within a few centimetres of the edge
}

// A board before a wall: shots on either side of its rim have the normal of what they
// meet; one that meets neither, between the two, has none.
TEST(SurfaceNormals, AtTheRimOfABoardEachShotHasItsOwnSurface) {
  const double noise = 0.01;
  const Plane wall = tilted_plane(20, 0, 16.0), board = tilted_plane(30, 90, 10.0);
  SurfaceNormals normals(noise);
  const RandomStream stream(17, 2);
  const auto shots = shots_over_the_field(kShots, 17);
  const auto on_board = [&](std::size_t i) { return shots[i].azimuth > 0.013; };
  const auto range = [&](std::size_t i) {
    return range_of(on_board(i) ? board : wall, shots[i]) + noise * stream.normal(i);
  };
  for (std::size_t i = 0; i < shots.size(); ++i) {
    normals.add(shots[i].azimuth, shots[i].zenith, range(i));
  }
  normals.fit();
  double missing = 0, between = 0;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const auto& [azimuth, zenith] = shots[i];
    const Vector3<double> normal = normals.normal(azimuth, zenith, range(i));
    if (none(normal)) {
      missing += 1;
    } else {
      EXPECT_LT(angle_deg(normal, (on_board(i) ? board : wall).normal), 3.0);
    }
    if (std::abs(azimuth - 0.013) < radians_from_degrees(0.2)) {
      const double middle = 0.5 * (range_of(board, shots[i]) + range_of(wall, shots[i]));
      EXPECT_TRUE(none(normals.normal(azimuth, zenith, middle)));
      ++between;
    }
  }
  EXPECT_LT(missing, 0.002 * kShots);
  EXPECT_GT(between, 50);
}

TEST(SurfaceNormals, LeavesHaveNone) {
  SurfaceNormals normals(0.02);
  const RandomStream stream(8, 2);
  const auto shots = shots_over_the_field(kShots, 8);
  for (std::size_t i = 0; i < shots.size(); ++i) {
    normals.add(shots[i].azimuth, shots[i].zenith, 10.0 + 2.0 * stream.uniform(i));
  }
  normals.fit();
  for (const Shot& shot : shots) EXPECT_TRUE(none(normals.normal(shot.azimuth, shot.zenith, 11.0)));
}

// How much the ranges may scatter about a surface is the constant of the class: 2 times the noise.
TEST(SurfaceNormals, RoughSurfacesHaveNone) {
  const double noise = 0.02;
  for (const auto& [times, share] :
       {std::pair{0.85 * SurfaceNormals::kRoughest, 1.0}, {1.3 * SurfaceNormals::kRoughest, 0.0}}) {
    const Outcome outcome = see(tilted_plane(10, 30, 20.0), noise, times * noise, 9);
    const auto found = static_cast<double>(outcome.found);
    EXPECT_NEAR(found / (found + static_cast<double>(outcome.missing)), share, 0.02) << times;
  }
}

TEST(SurfaceNormals, AFewShotsHaveNone) {
  const Plane wall = tilted_plane(20, 0, 10.0);
  const RandomStream stream(10, 1);
  for (const std::size_t count : {0u, 1u, 3u, 11u, 12u, 40u}) {
    SurfaceNormals normals(0.02);
    for (std::size_t i = 0; i < count; ++i) {
      const Shot shot{radians_from_degrees(0.1 + 0.8 * stream.uniform(2 * i)),
                      radians_from_degrees(89.1 + 0.8 * stream.uniform(2 * i + 1))};
      normals.add(shot.azimuth, shot.zenith, range_of(wall, shot));
    }
    normals.fit();
    EXPECT_EQ(none(normals.normal(radians_from_degrees(0.5), radians_from_degrees(89.5), 10.0)),
              count < 12)
        << count;
    // Neighbours without a shot of their own.
    EXPECT_TRUE(none(normals.normal(radians_from_degrees(1.5), radians_from_degrees(89.5), 10.0)));
  }
}

// Along an oblique line, and with as much width as makes a surface.
TEST(SurfaceNormals, ShotsAlongALineHaveNone) {
  const Plane wall = tilted_plane(20, 0, 10.0);
  for (const double width_deg : {0.0, 0.002, 0.03}) {
    SurfaceNormals normals(0.02);
    for (int i = 0; i < 200; ++i) {
      const double along = radians_from_degrees(0.004 * i + 0.1);
      const double aside = radians_from_degrees(width_deg * std::sin(1.7 * i));
      const Shot shot{along, kPi / 2 - 0.5 * along + aside};
      normals.add(shot.azimuth, shot.zenith, range_of(wall, shot));
    }
    normals.fit();
    EXPECT_EQ(none(normals.normal(radians_from_degrees(0.4), kPi / 2 - 0.003, 10.0)),
              width_deg < 0.01)
        << width_deg;
  }
}

// The scatter of 12 shots about a plane has 9 degrees of freedom. At exactly the greatest roughness
// chi-square is above 9 in 437 of 1000 cases.
TEST(SurfaceNormals, AFewShotsAreJudgedByTheirDegreesOfFreedom) {
  const Plane wall = tilted_plane(20, 0, 10.0);
  SurfaceNormals normals(0.02);
  const RandomStream place(16, 1), noise(16, 2);
  constexpr int kTrials = 4000;
  int refused = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    normals.clear();
    for (std::uint64_t i = 0; i < 12; ++i) {
      const std::uint64_t number = 12 * static_cast<std::uint64_t>(trial) + i;
      const Shot shot{radians_from_degrees(0.1 + 0.8 * place.uniform(2 * number)),
                      radians_from_degrees(89.1 + 0.8 * place.uniform(2 * number + 1))};
      normals.add(shot.azimuth, shot.zenith,
                  range_of(wall, shot) + SurfaceNormals::kRoughest * 0.02 * noise.normal(number));
    }
    normals.fit();
    refused += none(normals.normal(radians_from_degrees(0.5), radians_from_degrees(89.5), 10.0));
  }
  EXPECT_NEAR(refused / static_cast<double>(kTrials), 0.437, 0.04);
}

TEST(SurfaceNormals, DirectionsOutsideTheGridHaveNone) {
  const Plane wall = tilted_plane(0, 0, 10.0);
  SurfaceNormals normals(0.02);
  const double degree = radians_from_degrees(1.0);
  const std::vector<Shot> outside{
      {90.5 * degree, kPi / 2}, {-90.5 * degree, kPi / 2}, {kPi, kPi / 2}, {0, -0.5 * degree},
      {0, 180.5 * degree},      {kNaN, kPi / 2},           {0, kNaN},      {1e300, kPi / 2}};
  for (const Shot& shot : outside) {
    for (int i = 0; i < 50; ++i) normals.add(shot.azimuth, shot.zenith, 5.0);
  }
  for (const Shot& shot : shots_over_the_field(kShots, 11)) {
    normals.add(shot.azimuth, shot.zenith, range_of(wall, shot));
  }
  normals.fit();
  for (const Shot& shot : outside) {
    EXPECT_TRUE(none(normals.normal(shot.azimuth, shot.zenith, 5.0)));
  }
  EXPECT_LT(angle_deg(normals.normal(0.01, kPi / 2 - 0.01, 10.0), wall.normal), 0.2);
}

// Up to 84 degrees off the axis a surface is as good as ahead; flatter directions have none.
TEST(SurfaceNormals, WorkAsFarAsTheyAreLookedAt) {
  for (const double azimuth_deg : {-83.0, 83.0, 87.0}) {
    const double towards = radians_from_degrees(azimuth_deg);
    const Plane wall{{std::cos(towards), std::sin(towards), 0.0}, 10.0};
    SurfaceNormals normals(0.02);
    const RandomStream stream(12, 1);
    for (std::uint64_t i = 0; i < 400; ++i) {
      const Shot shot{towards + radians_from_degrees(stream.uniform(2 * i) - 0.5),
                      kPi / 2 + radians_from_degrees(stream.uniform(2 * i + 1) - 0.5)};
      normals.add(shot.azimuth, shot.zenith, range_of(wall, shot));
    }
    normals.fit();
    const auto normal = normals.normal(towards, kPi / 2 + 0.001, 10.0);
    if (azimuth_deg > 84) {
      EXPECT_TRUE(none(normal));
    } else {
      EXPECT_LT(angle_deg(normal, wall.normal), 1e-4);
    }
  }
}

// As a new one: neither shots nor normals stay.
TEST(SurfaceNormals, ClearForgets) {
  const Plane before = tilted_plane(45, 0, 10.0), after = tilted_plane(30, 120, 25.0);
  SurfaceNormals used(0.02), fresh(0.02);
  for (const Shot& shot : shots_over_the_field(kShots, 13)) {
    used.add(shot.azimuth, shot.zenith, range_of(before, shot));
  }
  used.fit();
  used.clear();
  used.fit();
  EXPECT_TRUE(none(used.normal(0.01, kPi / 2, 10.0)));
  // Fewer shots within a smaller circle: the rest has no surface any more.
  for (const Shot& shot : shots_over_the_field(3000, 14, radians_from_degrees(6.0))) {
    used.add(shot.azimuth, shot.zenith, range_of(after, shot));
    fresh.add(shot.azimuth, shot.zenith, range_of(after, shot));
  }
  used.fit();
  fresh.fit();
  for (const Shot& shot : shots_over_the_field(2000, 15)) {
    const auto a = used.normal(shot.azimuth, shot.zenith, range_of(after, shot));
    const auto b = fresh.normal(shot.azimuth, shot.zenith, range_of(after, shot));
    EXPECT_EQ(none(a), none(b));
    if (!none(a)) {
      EXPECT_EQ(norm(a - b), 0.0);
    }
  }
}

TEST(SurfaceNormals, FittingTwiceChangesNothing) {
  const Plane wall = tilted_plane(30, 120, 25.0);
  SurfaceNormals normals(0.02);
  for (const Shot& shot : shots_over_the_field(3000, 14)) {
    normals.add(shot.azimuth, shot.zenith, range_of(wall, shot));
  }
  normals.fit();
  const auto first = normals.normal(0.05, kPi / 2, 25.0);
  normals.fit();
  EXPECT_EQ(norm(normals.normal(0.05, kPi / 2, 25.0) - first), 0.0);
}

TEST(SurfaceNormals, AShotWithoutARangeTellsNothing) {
  SurfaceNormals normals(0.02);
  for (int i = 0; i < 400; ++i) {  // a wall across the X axis at 10 m
    const double azimuth = 1e-4 * (i % 20), zenith = kPi / 2 + 1e-4 * (i / 20);
    const auto d = direction_from_angles<double>({azimuth, zenith});
    normals.add(azimuth, zenith, 10.0 / d.x);
    for (const double range : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
      normals.add(azimuth, zenith, range);
    }
  }
  normals.fit();
  EXPECT_NEAR(std::abs(normals.normal(1e-3, kPi / 2 + 1e-3, 10.0).x), 1.0, 1e-6);
}

}  // namespace risley::cloud::surface_normals_test
