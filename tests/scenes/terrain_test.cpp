// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/scenes/terrain.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/scenes/scene.hpp"

#include "refusal.hpp"

namespace risley::scenes::terrain_test {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

using Real = long double;
constexpr Real kPiL = 3.14159265358979323846264338327950288L;

struct Point {
  Real x = 0, y = 0, z = 0;
};

struct TestRay {
  Vector3<double> origin, direction;

  Point at(Real t) const {
    return {static_cast<Real>(origin.x) + t * static_cast<Real>(direction.x),
            static_cast<Real>(origin.y) + t * static_cast<Real>(direction.y),
            static_cast<Real>(origin.z) + t * static_cast<Real>(direction.z)};
  }
};

// The referee: every object as a question "in which part of space is this point?", asked along the
// ray in small steps of long double, and again in halves of every step whose ends differ. Nothing
// of it is shared with the library but the numbers of the parts.

Real ground_height(const Ground& ground, Real x, Real y) {
  Real z = static_cast<Real>(ground.height);
  for (const Relief& r : ground.relief) {
    z += static_cast<Real>(r.amplitude) *
         std::sin(2 * kPiL * x / static_cast<Real>(r.wavelength_x)) *
         std::cos(2 * kPiL * y / static_cast<Real>(r.wavelength_y));
  }
  for (const Waves& w : ground.waves) {
    const Real heading = static_cast<Real>(w.heading);
    z += static_cast<Real>(w.amplitude) *
         std::sin(2 * kPiL * (x * std::sin(heading) + y * std::cos(heading)) /
                  static_cast<Real>(w.wavelength));
  }
  return z;
}

/// Where an object stands and how it is turned.
struct Footing {
  Real x = 0, y = 0, floor = 0, sine = 0, cosine = 0;

  /// Places along and across its heading.
  std::pair<Real, Real> along_across(const Point& p) const {
    return {(p.x - x) * sine + (p.y - y) * cosine, (p.x - x) * cosine - (p.y - y) * sine};
  }
};

class Referee {
 public:
  explicit Referee(const TerrainParts& parts) : parts_(parts) {
    const Ground ground = parts.ground.value_or(Ground{});
    const auto add = [&](const std::array<double, 2>& at, double heading) {
      footings_.push_back(
          {static_cast<Real>(at[0]), static_cast<Real>(at[1]),
           ground_height(ground, static_cast<Real>(at[0]), static_cast<Real>(at[1])),
           std::sin(static_cast<Real>(heading)), std::cos(static_cast<Real>(heading))});
    };
    for (const GableRoof& each : parts.roofs) add(each.center, each.heading);
    for (const Building& each : parts.buildings) add(each.center, each.heading);
    for (const Bush& each : parts.bushes) add(each.center, 0);
  }

  std::size_t objects() const {
    return parts_.roofs.size() + parts_.buildings.size() + parts_.bushes.size() +
           (parts_.ground ? 1 : 0);
  }
  std::string name(std::size_t object) const {
    if (object < parts_.roofs.size()) return parts_.roofs[object].name;
    object -= parts_.roofs.size();
    if (object < parts_.buildings.size()) return parts_.buildings[object].name;
    object -= parts_.buildings.size();
    return object < parts_.bushes.size() ? parts_.bushes[object].name : "ground";
  }
  bool is_bush(std::size_t object) const {
    return object >= parts_.roofs.size() + parts_.buildings.size() &&
           object < parts_.roofs.size() + parts_.buildings.size() + parts_.bushes.size();
  }

  /// Where the ray enters the object first, or for a bush the middle of its way through it.
  std::optional<Real> hit(std::size_t object, const TestRay& ray, Real farthest) const {
    const Real step = 0.004L;
    std::optional<Real> entered;
    if (is_bush(object) && part(object, ray.at(0)) == -1) entered = 0;
    for (Real t = 0; t < farthest; t += step) {
      const auto change = first_change(object, ray, t, part(object, ray.at(t)), t + step,
                                       part(object, ray.at(t + step)));
      if (!change) continue;
      if (!is_bush(object)) return change;
      if (entered) return (*entered + *change) / 2;
      entered = change;
    }
    return std::nullopt;
  }

 private:
  /// +1 and -1 are the two sides of a surface; 0 is neither.
  int part(std::size_t object, const Point& p) const {
    if (object == footings_.size()) {
      return p.z > ground_height(*parts_.ground, p.x, p.y) ? 1 : -1;
    }
    const Footing& at = footings_[object];
    const auto [along, across] = at.along_across(p);
    if (object < parts_.roofs.size()) {
      const GableRoof& roof = parts_.roofs[object];
      const Real pitch = static_cast<Real>(roof.pitch);
      const bool below_it =
          std::abs(along) <= static_cast<Real>(roof.length) / 2 &&
          std::abs(across) <= static_cast<Real>(roof.face_width) * std::cos(pitch);
      if (!below_it) return roof.walls ? 1 : 0;
      const Real height =
          at.floor + static_cast<Real>(roof.ridge_height) - std::abs(across) * std::tan(pitch);
      return p.z > height ? 1 : -1;
    }
    object -= parts_.roofs.size();
    if (object < parts_.buildings.size()) {
      const Building& each = parts_.buildings[object];
      const bool inside = std::abs(along) <= static_cast<Real>(each.size[0]) / 2 &&
                          std::abs(across) <= static_cast<Real>(each.size[1]) / 2 &&
                          p.z <= at.floor + static_cast<Real>(each.height);
      return inside ? -1 : 1;
    }
    const Bush& bush = parts_.bushes[object - parts_.buildings.size()];
    const Real half = static_cast<Real>(bush.height) / 2, radius = static_cast<Real>(bush.radius);
    const Real x = (p.x - at.x) / radius, y = (p.y - at.y) / radius;
    const Real z = (p.z - at.floor - half) / half;
    return x * x + y * y + z * z <= 1 ? -1 : 1;
  }

  std::optional<Real> first_change(std::size_t object, const TestRay& ray, Real from, int before,
                                   Real to, int after) const {
    if (before == after) return std::nullopt;
    const Real middle = (from + to) / 2;
    if (to - from < 1e-13L || middle <= from || middle >= to) {
      return before * after == -1 ? std::optional<Real>(middle) : std::nullopt;
    }
    const int between = part(object, ray.at(middle));
    if (const auto left = first_change(object, ray, from, before, middle, between)) return left;
    return first_change(object, ray, middle, between, to, after);
  }

  const TerrainParts& parts_;
  std::vector<Footing> footings_;  ///< of roofs, buildings and bushes
};

TerrainParts hamlet() {
  TerrainParts parts;
  parts.ground = Ground{0.4, {{3.0, 80.0, 100.0}}, {{0.05, 1.5, 0.3}}};
  parts.roofs.push_back({"open", {-8, 3}, 8, 5, radians_from_degrees(40), 8, 0.7, false});
  parts.roofs.push_back({"house", {9, -5}, 10, 4, radians_from_degrees(25), 7, -1.1, true});
  parts.buildings.push_back({"box", {2, 12}, {6, 9}, 5, 2.2});
  parts.buildings.push_back({"base", {-8, 3}, {7, 6}, 4, 0.7});
  parts.bushes.push_back({"shrub", {-3, -9}, 2, 2.5});
  parts.bushes.push_back({"hedge", {-1, -8}, 1.5, 4});
  return parts;
}

Vector3<double> random_direction(const RandomStream& random, std::uint64_t at) {
  const double z = 2 * random.uniform(at) - 1, turn = kTwoPi * random.uniform(at + 1);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

void expect_as_referee(const Terrain& terrain, const TestRay& ray, Real farthest, double tolerance,
                       std::map<std::string, int>& met) {
  const Referee referee(terrain.parts());
  std::optional<Real> nearest;
  std::string name;
  for (std::size_t object = 0; object < referee.objects(); ++object) {
    // A bush is asked for as far as its middle may lie.
    const Real end = nearest ? std::min(farthest, *nearest + 10) : farthest;
    const auto range = referee.hit(object, ray, end);
    if (range && *range <= farthest && (!nearest || *range < *nearest)) {
      nearest = range;
      name = referee.name(object);
    }
  }
  const auto hit =
      terrain.nearest_hit(ray.origin, ray.direction, static_cast<double>(farthest), 0.5);
  const auto text = [&] {
    return ::testing::Message() << "from " << ray.origin.x << ' ' << ray.origin.y << ' '
                                << ray.origin.z << " towards " << ray.direction.x << ' '
                                << ray.direction.y << ' ' << ray.direction.z
                                << ", referee: " << (nearest ? static_cast<double>(*nearest) : -1.0)
                                << ' ' << name;
  };
  ASSERT_EQ(hit.has_value(), nearest.has_value()) << text();
  ++met[hit ? name : "nothing"];
  if (!hit) return;
  ASSERT_NEAR(static_cast<double>(static_cast<Real>(hit->range) - *nearest), 0.0, tolerance)
      << text();
  ASSERT_THAT(terrain.surface_name(hit->surface), StartsWith(name)) << text();
  ASSERT_GE(hit->cosine, 0.0);
  ASSERT_LE(hit->cosine, 1.0);
}

TEST(Terrain, EveryRayFromAboveEndsWhereTheRefereeSays) {
  const Terrain terrain(hamlet());
  const RandomStream random(1, 1);
  std::map<std::string, int> met;
  for (std::uint64_t i = 0; i < 300; ++i) {
    const double x = 50 * (random.uniform(8 * i) - 0.5), y = 50 * (random.uniform(8 * i + 1) - 0.5);
    // Towards a random place of the hamlet from 12 m above, mostly steep.
    const Vector3<double> from{x, y, 14.0};
    const Vector3<double> to{24 * (random.uniform(8 * i + 2) - 0.5),
                             28 * (random.uniform(8 * i + 3) - 0.5), 5 * random.uniform(8 * i + 4)};
    expect_as_referee(terrain, {from, normalized(to - from)}, 70.0L, 1e-10, met);
    if (HasFatalFailure()) return;
  }
  for (const char* name : {"open", "house", "box", "base", "shrub", "hedge", "ground"}) {
    EXPECT_GT(met[name], 2) << name;
  }
}

TEST(Terrain, RaysFromBelowAndFromInsideEndToo) {
  const Terrain terrain(hamlet());
  const RandomStream random(2, 1);
  std::map<std::string, int> met;
  for (std::uint64_t i = 0; i < 350; ++i) {
    // Anywhere in the hamlet: below the ground, within houses and bushes, under the open roof.
    const Vector3<double> from{26 * (random.uniform(8 * i) - 0.5),
                               32 * (random.uniform(8 * i + 1) - 0.5),
                               16 * random.uniform(8 * i + 2) - 2};
    const Vector3<double> towards = random_direction(random, 8 * i + 3);
    // Walls end at the lowest ground, -2.65 m.
    const double farthest = towards.z < 0 ? std::min(40.0, (from.z + 2.6) / -towards.z) : 40.0;
    expect_as_referee(terrain, {from, towards}, static_cast<Real>(farthest), 1e-10, met);
    if (HasFatalFailure()) return;
  }
  for (const char* name : {"open", "house", "box", "ground", "nothing"}) {
    EXPECT_GT(met[name], 2) << name;
  }
}

TEST(Terrain, FromEightyMetresTheErrorIsBelowANanometre) {
  TerrainParts parts;
  parts.ground = Ground{0.0, {{3.0, 80.0, 100.0}}, {{0.01, 1.5, 0.0}}};
  const Terrain terrain(parts);
  const RandomStream random(3, 1);
  std::map<std::string, int> met;
  for (std::uint64_t i = 0; i < 60; ++i) {
    const double off = 0.336 * std::sqrt(random.uniform(4 * i)),
                 turn = kTwoPi * random.uniform(4 * i + 1);
    expect_as_referee(
        terrain,
        {{200 * random.uniform(4 * i + 2), -150 * random.uniform(4 * i + 3), 80},
         {std::sin(off) * std::cos(turn), std::sin(off) * std::sin(turn), -std::cos(off)}},
        100.0L, 1e-12, met);
    if (HasFatalFailure()) return;
  }
  EXPECT_EQ(met["ground"], 60);
}

/// Height of a ray above the ground.
Real clearance(const Ground& ground, const TestRay& ray, Real t) {
  const Point p = ray.at(t);
  return p.z - ground_height(ground, p.x, p.y);
}

// Rays that nearly touch: shifted up or down from a tangent by a tenth of a micrometre to a
// millimetre they must, or must not, end on the hill that they graze.
TEST(Terrain, GrazingRaysNeitherJumpOverNorInventAHill) {
  TerrainParts parts;
  parts.ground = Ground{0.0, {{3.0, 80.0, 100.0}}, {{0.01, 1.5, 0.4}}};
  const Ground& ground = *parts.ground;
  const Terrain terrain(parts);
  const RandomStream random(4, 1);
  int ended = 0, passed = 0;
  for (std::uint64_t i = 0; i < 200; ++i) {
    const Real x = 100 * static_cast<Real>(random.uniform(4 * i));
    const Real y = 100 * static_cast<Real>(random.uniform(4 * i + 1));
    const Real h = 1e-6L;
    const Real slope_x =
        (ground_height(ground, x + h, y) - ground_height(ground, x - h, y)) / (2 * h);
    const Real slope_y =
        (ground_height(ground, x, y + h) - ground_height(ground, x, y - h)) / (2 * h);
    const double turn = kTwoPi * random.uniform(4 * i + 2);
    const Vector3<double> along =
        normalized(Vector3<double>{std::cos(turn), std::sin(turn),
                                   static_cast<double>(slope_x) * std::cos(turn) +
                                       static_cast<double>(slope_y) * std::sin(turn)});
    const double shift = std::pow(10.0, -3 - 4 * random.uniform(4 * i + 3)) * (i % 2 == 0 ? 1 : -1);
    const double back = 1.0;
    const TestRay ray{
        {static_cast<double>(x) - back * along.x, static_cast<double>(y) - back * along.y,
         static_cast<double>(ground_height(ground, x, y)) + shift - back * along.z},
        along};
    const auto hit = terrain.nearest_hit(ray.origin, ray.direction, 2 * back, 0.5);
    // The first change of sign that steps of a fifth of a millimetre see.
    const bool above = clearance(ground, ray, 0) > 0;
    std::optional<Real> seen;
    for (Real t = 0; t < 2 * static_cast<Real>(back) && !seen; t += 2e-4L) {
      if ((clearance(ground, ray, t + 2e-4L) > 0) != above) seen = t;
    }
    if (seen) {
      ASSERT_TRUE(hit) << i;
      ASSERT_LT(hit->range, static_cast<double>(*seen) + 2.01e-4) << i;
      ++ended;
    } else {
      ++passed;
    }
    if (hit) {  // the ray really is at the ground there, and was not before
      ASSERT_LT(
          std::abs(static_cast<double>(clearance(ground, ray, static_cast<Real>(hit->range)))),
          1e-13);
      for (Real t = 0; t < static_cast<Real>(hit->range) - 2e-4L; t += 2e-4L) {
        ASSERT_EQ(clearance(ground, ray, t) > 0, above);
      }
    }
  }
  EXPECT_GT(ended, 40);
  EXPECT_GT(passed, 15);
}

TEST(Terrain, FarAndFlatRaysKeepTheirAccuracy) {
  TerrainParts parts;
  parts.ground = Ground{0.0, {{3.0, 80.0, 100.0}}, {}};
  const Terrain terrain(parts);
  for (const double down : {0.08, 0.04, 0.02, 0.011}) {
    for (const double turn : {0.1, 1.0, 2.5, 4.0}) {
      const TestRay ray{{12.0, -7.0, 15.0},
                        normalized(Vector3<double>{std::cos(turn), std::sin(turn), -down})};
      const auto hit = terrain.nearest_hit(ray.origin, ray.direction, 5000, 0.5);
      ASSERT_TRUE(hit);
      std::optional<Real> seen;
      Real t = 0;
      for (; !seen; t += 0.01L) {
        if (clearance(*parts.ground, ray, t + 0.01L) <= 0) seen = t;
      }
      Real low = *seen, high = low + 0.01L;
      for (int i = 0; i < 60; ++i) {
        const Real middle = (low + high) / 2;
        (clearance(*parts.ground, ray, middle) > 0 ? low : high) = middle;
      }
      EXPECT_NEAR(static_cast<double>(static_cast<Real>(hit->range) - low), 0.0, 1e-10);
    }
  }
}

TEST(Terrain, CosinesAreThoseOfTheSurface) {
  TerrainParts parts;
  parts.ground = Ground{0.0, {{3.0, 80.0, 100.0}}, {}};
  parts.roofs.push_back({"roof", {100, 0}, 8, 5, radians_from_degrees(30), 8, 0.0, false});
  const Terrain terrain(parts);
  // Straight down on the roof: the pitch. East and west of a ridge that runs north.
  for (const double x : {98.0, 102.0}) {
    const auto hit = terrain.nearest_hit({x, 1, 50}, {0, 0, -1}, 1e3, 0.5);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->cosine, std::cos(radians_from_degrees(30)), 1e-14);
    EXPECT_EQ(terrain.surface_name(hit->surface), x > 100 ? "roof, right face" : "roof, left face");
  }
  // On the hill: differences of heights.
  const double h = 1e-5, x = 7, y = 21;
  const double slope_x =
      (parts.ground->height_at(x + h, y) - parts.ground->height_at(x - h, y)) / (2 * h);
  const double slope_y =
      (parts.ground->height_at(x, y + h) - parts.ground->height_at(x, y - h)) / (2 * h);
  const auto hit = terrain.nearest_hit({x, y, 50}, {0, 0, -1}, 1e3, 0.5);
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->cosine, 1 / std::sqrt(1 + slope_x * slope_x + slope_y * slope_y), 1e-9);
  EXPECT_NEAR(50 - hit->range, parts.ground->height_at(x, y), 1e-13);
}

TEST(Terrain, FlatGroundIsAPlane) {
  TerrainParts parts;
  parts.ground = Ground{-2.0, {{0.0, 80.0, 100.0}}, {}};
  const Terrain terrain(parts);
  const auto hit = terrain.nearest_hit({3, 4, 78}, {0.6, 0.0, -0.8}, 1e6, 0.5);
  ASSERT_TRUE(hit);
  EXPECT_DOUBLE_EQ(hit->range, 100.0);
  EXPECT_DOUBLE_EQ(hit->cosine, 0.8);
  EXPECT_EQ(terrain.surface_name(hit->surface), "ground");
  EXPECT_FALSE(terrain.nearest_hit({3, 4, 78}, {0.6, 0.0, 0.8}, 1e6, 0.5));
  EXPECT_FALSE(terrain.nearest_hit({3, 4, 78}, {1.0, 0.0, 0.0}, 1e6, 0.5));
  EXPECT_FALSE(terrain.nearest_hit({3, 4, 78}, {0.6, 0.0, -0.8}, 99.0, 0.5));
  EXPECT_DOUBLE_EQ(terrain.nearest_hit({3, 4, -12}, {0.0, 0.0, 1.0}, 1e6, 0.5)->range, 10.0);
}

TEST(Terrain, RaysThatBeginOnTheGroundDoNotEndThere) {
  TerrainParts parts;
  parts.ground = Ground{0.0, {{3.0, 80.0, 100.0}}, {}};
  const Terrain terrain(parts);
  const Vector3<double> from{10, 5, parts.ground->height_at(10, 5)};
  EXPECT_FALSE(terrain.nearest_hit(from, {0, 0, 1}, 1e3, 0.5));
  EXPECT_FALSE(terrain.nearest_hit(from, {0, 0, -1}, 1e3, 0.5));
  // From a valley along the horizon: the next slope, not this one.
  const Vector3<double> valley{-20, 0, -3.0};
  const auto hit = terrain.nearest_hit(valley, normalized(Vector3<double>{1, 0, 0.05}), 1e3, 0.5);
  ASSERT_TRUE(hit);
  EXPECT_GT(hit->range, 1.0);
}

TEST(Terrain, AShotEndsInsideABushAsDeepAsItIsTold) {
  TerrainParts parts;
  parts.bushes.push_back({"bush", {1, 2}, 2.0, 6.0});
  const Terrain terrain(parts);
  // Through the middle, 3 m above the ground: 4 m of bush, beginning 9 m away.
  for (const double penetration : {0.1, 0.5, 0.9}) {
    const auto hit = terrain.nearest_hit({-10, 2, 3}, {1, 0, 0}, 1e3, penetration);
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->range, 9 + 4 * penetration, 1e-12);
    EXPECT_EQ(terrain.surface_name(hit->surface), "bush");
    // From inside only what is ahead counts.
    EXPECT_NEAR(terrain.nearest_hit({2, 2, 3}, {1, 0, 0}, 1e3, penetration)->range, penetration,
                1e-12);
  }
  EXPECT_FALSE(terrain.nearest_hit({-10, 2, 6.001}, {1, 0, 0}, 1e3, 0.5));
  EXPECT_FALSE(terrain.nearest_hit({10, 2, 3}, {1, 0, 0}, 1e3, 0.5));
  EXPECT_FALSE(terrain.nearest_hit({-10, 4.001, 3}, {1, 0, 0}, 1e3, 0.5));
}

TEST(Terrain, NoRaySlipsBetweenTwoFaces) {
  TerrainParts parts;
  parts.roofs.push_back({"house", {3, 1}, 9, 5, radians_from_degrees(35), 8, 0.37, true});
  parts.buildings.push_back({"box", {30, 1}, {9, 5}, 8, 0.37});
  const Terrain terrain(parts);
  const RandomStream random(5, 1);
  for (std::uint64_t i = 0; i < 20000; ++i) {
    // Towards points of the edges that two faces share.
    const Face& face = terrain.faces()[i % terrain.faces().size()];
    const std::size_t corner = i / terrain.faces().size() % face.corners.size();
    const Vector3<double>& a = face.corners[corner];
    const Vector3<double>& b = face.corners[(corner + 1) % face.corners.size()];
    if (a.z <= 0.01 && b.z <= 0.01) continue;  // the foot ends there
    const double part = 0.01 + 0.98 * random.uniform(4 * i);
    const Vector3<double> target = a + part * (b - a);
    if (target.z < 0.05) continue;
    // From inside, straight through the edge.
    const bool of_house = face.name.starts_with("house");
    const Vector3<double> from{of_house ? 3.0 : 30.0, 1.0, 2.0 + random.uniform(4 * i + 1)};
    const auto hit = terrain.nearest_hit(from, normalized(target - from), 1e3, 0.5);
    ASSERT_TRUE(hit) << face.name << ' ' << corner;
    ASSERT_NEAR(hit->range, norm(target - from), 1e-6);
  }
}

TEST(Terrain, TheGridMissesNothingAmongThousandsOfRoofs) {
  VillageSettings settings;
  settings.seed = 11;
  settings.half_extent = 400;
  settings.roofs = 2000;
  settings.bushes = 500;
  settings.minimum_distance = 9;
  settings.length = 8;
  settings.face_width = 5;
  settings.pitch = {radians_from_degrees(20), radians_from_degrees(45)};
  settings.ridge_height = {6, 9};
  settings.bush_radius = {0.5, 2};
  settings.bush_height = {1, 4};
  TerrainParts parts;
  add_village(settings, parts);
  parts.buildings.push_back({"long", {0, 0}, {700, 2}, 4, 0.9});  // larger than any cell
  ASSERT_EQ(parts.roofs.size(), 2000u);
  const Terrain all(parts);
  std::vector<Terrain> alone;
  for (const GableRoof& roof : parts.roofs) {
    TerrainParts one;
    one.roofs.push_back(roof);
    alone.emplace_back(one);
  }
  for (const Bush& bush : parts.bushes) {
    TerrainParts one;
    one.bushes.push_back(bush);
    alone.emplace_back(one);
  }
  TerrainParts building;
  building.buildings = parts.buildings;
  alone.emplace_back(building);
  const RandomStream random(6, 1);
  int hits = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    Vector3<double> from{900 * (random.uniform(8 * i) - 0.5),
                         900 * (random.uniform(8 * i + 1) - 0.5), 12 * random.uniform(8 * i + 2)};
    Vector3<double> towards = random_direction(random, 8 * i + 3);
    if (i % 4 == 1) towards = normalized(Vector3<double>{towards.x, towards.y, 0.01 * towards.z});
    if (i % 8 == 2) towards = {0, i % 16 == 2 ? 1.0 : -1.0, 0};
    if (i % 8 == 6) towards = {i % 16 == 6 ? 1.0 : -1.0, 0, 0};
    if (i % 8 == 7) {
      from.z = 80;
      towards = {0, 0, -1};
    }
    std::optional<double> nearest;
    std::string name;
    for (const Terrain& each : alone) {
      const auto hit = each.nearest_hit(from, towards, 1e6, 0.3);
      if (hit && (!nearest || hit->range < *nearest)) {
        nearest = hit->range;
        name = each.surface_name(hit->surface);
      }
    }
    const auto hit = all.nearest_hit(from, towards, 1e6, 0.3);
    ASSERT_EQ(hit.has_value(), nearest.has_value()) << i << ' ' << name;
    if (!hit) continue;
    ASSERT_EQ(hit->range, *nearest) << i;
    ASSERT_EQ(all.surface_name(hit->surface), name);
    ++hits;
  }
  EXPECT_GT(hits, 80);
}

TEST(Terrain, AVillageKeepsItsDistancesAndRanges) {
  VillageSettings settings;
  settings.seed = 3;
  settings.center = {100, -20};
  settings.half_extent = 50;
  settings.roofs = 20;
  settings.minimum_distance = 12;
  settings.length = 8;
  settings.face_width = 5;
  settings.pitch = {radians_from_degrees(20), radians_from_degrees(45)};
  settings.ridge_height = {6, 9};
  TerrainParts parts, again;
  add_village(settings, parts);
  add_village(settings, again);
  ASSERT_EQ(parts.roofs.size(), 20u);
  std::set<double> pitches;
  for (std::size_t i = 0; i < 20; ++i) {
    const GableRoof& roof = parts.roofs[i];
    EXPECT_EQ(roof.center, again.roofs[i].center);
    EXPECT_EQ(roof.heading, again.roofs[i].heading);
    EXPECT_LE(std::abs(roof.center[0] - 100), 50);
    EXPECT_LE(std::abs(roof.center[1] + 20), 50);
    EXPECT_GE(roof.pitch, settings.pitch[0]);
    EXPECT_LE(roof.pitch, settings.pitch[1]);
    EXPECT_GE(roof.ridge_height, 6);
    EXPECT_LE(roof.ridge_height, 9);
    pitches.insert(roof.pitch);
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GE(std::hypot(roof.center[0] - parts.roofs[j].center[0],
                           roof.center[1] - parts.roofs[j].center[1]),
                12.0);
    }
  }
  EXPECT_EQ(pitches.size(), 20u);
  settings.seed = 4;
  TerrainParts other;
  add_village(settings, other);
  EXPECT_NE(other.roofs[0].center, parts.roofs[0].center);
  settings.roofs = 200;
  EXPECT_THAT(refusal([&] { add_village(settings, other); }),
              AllOf(NamesField("of 200 roofs"), NamesField("+-50 m at 12 m")));
}

TEST(Terrain, HousesStandOnTheGroundBelowThem) {
  TerrainParts parts;
  parts.ground = Ground{10.0, {{3.0, 80.0, 100.0}}, {}};
  parts.buildings.push_back({"box", {20, 0}, {4, 4}, 5, 0});  // on the hill's top
  parts.bushes.push_back({"bush", {-20, 0}, 1, 2});           // in the valley
  const Terrain terrain(parts);
  EXPECT_NEAR(terrain.nearest_hit({20, 0, 100}, {0, 0, -1}, 1e3, 0.5)->range, 100 - 18, 1e-12);
  EXPECT_NEAR(terrain.nearest_hit({-20, 0, 100}, {0, 0, -1}, 1e3, 0.5)->range, 100 - 8, 1e-12);
}

TEST(Terrain, RefusesPartsThatMakeNoSense) {
  const auto refused = [](auto&& change) {
    TerrainParts parts = hamlet();
    change(parts);
    return refusal([&] { Terrain terrain(parts); });
  };
  EXPECT_EQ(refused([](auto&) {}), "");
  EXPECT_EQ(refusal([] { Terrain terrain(TerrainParts{}); }),
            "a terrain needs ground, roofs, buildings or bushes");
  EXPECT_EQ(refused([](auto& p) { p.ground->height = NAN; }),
            "ground.height = nan m, allowed -10000 to 10000");
  EXPECT_EQ(refused([](auto& p) { p.ground->relief[0].wavelength_x = 0; }),
            "relief.wavelength_x = 0 m, allowed 0.1 to 1000000");
  EXPECT_EQ(refused([](auto& p) { p.ground->waves.resize(100); }),
            "ground.relief and ground.waves = 101 entries, allowed 0 to 64");
  EXPECT_THAT(refused([](auto& p) { p.roofs[0].pitch = 2; }), NamesField("open.pitch"));
  EXPECT_THAT(refused([](auto& p) { p.roofs[0].ridge_height = 1; }),
              AllOf(NamesField("open"), NamesField("2.21 m"), NamesField("ridge_height")));
  EXPECT_THAT(refused([](auto& p) { p.buildings[0].size[1] = -1; }), NamesField("box.size[1]"));
  EXPECT_THAT(refused([](auto& p) { p.bushes[0].radius = 0; }), NamesField("shrub.radius"));
  EXPECT_THAT(refused([](auto& p) { p.bushes[0].center[0] = INFINITY; }),
              NamesField("shrub.center[0]"));
  EXPECT_THAT(refused([](auto& p) {
                p.origin = MapOrigin{2, 0, 0};
              }),
              NamesField("origin.latitude"));
  const Terrain terrain(hamlet());
  EXPECT_THAT(refusal([&] { static_cast<void>(terrain.surface_name(terrain.surfaces())); }),
              NamesField("surface"));
}

const std::string kVillage = R"(
planes:
  - {name: tower, distance_m: 60, normal_azimuth_deg: 0, normal_zenith_deg: 90, extent_m: [10, 80]}
terrain:
  origin: {latitude_deg: 50.1, longitude_deg: 8.6, ellipsoidal_height_m: 160}
  ground:
    height_m: 0.5
    relief: [{amplitude_m: 3, wavelength_x_m: 80, wavelength_y_m: 100}]
    waves: [{amplitude_m: 0.01, wavelength_m: 1.5, heading_deg: 30}]
  roofs:
    - {name: barn, center_m: [0, 0], length_m: 8, face_width_m: 5, pitch_deg: 30, ridge_height_m: 8, heading_deg: 90, walls: yes}
    - {center_m: [-30, 0], length_m: 8, face_width_m: 5, pitch_deg: 30, ridge_height_m: 8}
  buildings:
    - {name: garage, center_m: [15, 3], size_m: [6, 3], height_m: 2.5, heading_deg: 10}
  bushes:
    - {center_m: [5, 9], radius_m: 1, height_m: 2}
  village: {seed: 1, half_extent_m: 50, roofs: 5, minimum_distance_m: 12, length_m: 8, face_width_m: 5, pitch_deg: [20, 45], ridge_height_m: [6, 9], bushes: 3, bush_radius_m: [1, 2], bush_height_m: [1, 3]}
)";

TEST(Terrain, IsReadFromASceneBesidePlanes) {
  const Scene scene = parse_scene(kVillage, "village.yaml");
  ASSERT_TRUE(scene.terrain);
  const TerrainParts& parts = scene.terrain->parts();
  EXPECT_DOUBLE_EQ(parts.origin->latitude, radians_from_degrees(50.1));
  EXPECT_EQ(parts.origin->height, 160);
  EXPECT_EQ(parts.ground->relief[0].wavelength_y, 100);
  EXPECT_DOUBLE_EQ(parts.ground->waves[0].heading, radians_from_degrees(30));
  ASSERT_EQ(parts.roofs.size(), 7u);
  EXPECT_TRUE(parts.roofs[0].walls);
  EXPECT_EQ(parts.roofs[1].name, "roof 2");
  EXPECT_EQ(parts.roofs[2].name, "village roof 1");
  EXPECT_EQ(parts.bushes.size(), 4u);
  // Surfaces: the plane, six of the barn, two of every other roof, five of the garage, bushes,
  // ground.
  EXPECT_EQ(scene.surfaces(), 1u + 6 + 6 * 2 + 5 + 4 + 1);
  EXPECT_EQ(scene.surface_name(0), "tower");
  EXPECT_EQ(scene.surface_name(1), "barn, right face");
  EXPECT_EQ(scene.surface_name(scene.surfaces() - 1), "ground");
  const auto roof = nearest_hit(scene, {0, -1, 60}, {0, 0, -1});
  ASSERT_TRUE(roof);
  EXPECT_EQ(scene.surface_name(roof->surface), "barn, right face");
  const auto plane = nearest_hit(scene, {0, 0, 30}, {1, 0, 0});
  ASSERT_TRUE(plane);
  EXPECT_EQ(scene.surface_name(plane->surface), "tower");
  EXPECT_DOUBLE_EQ(plane->range, 60);
  EXPECT_THAT(refusal([&] {
                static_cast<void>(nearest_hit(scene, {0, 0, 9}, {1, 0, 0}, 1.0));
              }),
              NamesField("penetration"));
}

TEST(Terrain, MistakesInAFileAreToldWithTheirLine) {
  const auto message = [](const std::string& from, const std::string& to) {
    return line_and_problem([&] { parse_scene(replaced(kVillage, from, to), "village.yaml"); });
  };
  EXPECT_THAT(message("pitch_deg: 30", "pitch: 30"), NamesField("terrain.roofs[0].pitch", 11));
  EXPECT_THAT(message("length_m: 8, ", ""), NamesField("terrain.roofs[0].length_m", 11));
  EXPECT_THAT(message("pitch_deg: 30", "pitch_deg: 95"),
              NamesField("terrain.roofs[0].pitch_deg", 11));
  EXPECT_THAT(message("[0, 0], length", "[0], length"), NamesField("terrain.roofs[0].center_m"));
  EXPECT_THAT(message("walls: yes", "walls: maybe"), NamesField("terrain.roofs[0].walls"));
  EXPECT_THAT(message("name: garage", "name: barn"), NamesField("terrain.buildings[0].name", 14));
  EXPECT_THAT(message("name: garage", "name: tower"), NamesField("tower"));
  EXPECT_THAT(message("[20, 45]", "[45, 20]"), NamesField("terrain.village.pitch_deg"));
  EXPECT_THAT(message("roofs: 5", "roofs: 5000"), NamesField("+-50 m"));
  EXPECT_THAT(message("ridge_height_m: 8", "ridge_height_m: 2"),
              AllOf(NamesField("barn"), NamesField("0.5 m")));
  EXPECT_THAT(message("wavelength_m: 1.5", "wavelength_m: 0.001"),
              NamesField("terrain.ground.waves[0].wavelength_m", 9));
  EXPECT_EQ(message("wavelength_m: 1.5", "wavelength_m: 0.1"), "");
  EXPECT_THAT(message("latitude_deg: 50.1", "latitude_deg: 95"),
              NamesField("terrain.origin.latitude_deg", 5));
  EXPECT_THAT(message("buildings:\n", "building:\n"), NamesField("terrain.building", 13));
}

}  // namespace risley::scenes::terrain_test
