// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/plane_segmentation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "risley/calibration/fitted_plane.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/optics/batch.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::calibration::plane_segmentation_test {

constexpr double kNoise = 0.02;
constexpr int kClutter = -1, kDoubtful = -2;  // true labels that are no row of the planes

/// Directions of a Mid-40 at 1 kHz.
std::vector<Vector3<double>> rosette(std::size_t shots) {
  const sensors::Sensor sensor = sensors::load_sensor("mid-40");
  std::vector<std::vector<double>> angles(2, std::vector<double>(shots));
  for (std::size_t i = 0; i < shots; ++i) {
    for (std::size_t rotor : {0, 1}) {
      angles[rotor][i] = wrap_to_pi(1e-3 * static_cast<double>(i) * sensor.angular_velocity[rotor]);
    }
  }
  std::vector<double> x(shots), y(shots), z(shots);
  const std::vector<std::span<const double>> columns(angles.begin(), angles.end());
  DirectionColumns out;
  out.x = x;
  out.y = y;
  out.z = z;
  observe_batch(sensor.train, columns, out);
  std::vector<Vector3<double>> directions(shots);
  for (std::size_t i = 0; i < shots; ++i) directions[i] = {x[i], y[i], z[i]};
  return directions;
}

/// A plane whose normal stands so far to the left of X and above it, degrees.
Plane wall(double left_deg, double up_deg, double distance) {
  return plane_from_angles({radians_from_degrees(left_deg), radians_from_degrees(90.0 - up_deg)},
                           distance);
}

struct Cloud {
  std::vector<Plane> planes;
  std::vector<Vector3<double>> direction, point;  // points with noise
  std::vector<int> truth;                         // row of planes, kClutter or kDoubtful
};

/// Endless planes seen from within. Points near an edge, where another plane is less than 0.2 m
/// further along the beam, are doubtful.
Cloud seen(const std::vector<Plane>& planes, std::size_t shots, std::uint64_t seed = 1) {
  Cloud cloud{planes, rosette(shots), {}, {}};
  const RandomStream noise(seed, 1);
  for (std::size_t i = 0; i < shots; ++i) {
    const Vector3<double>& u = cloud.direction[i];
    double first = std::numeric_limits<double>::infinity(), second = first;
    int truth = kClutter;
    for (std::size_t k = 0; k < planes.size(); ++k) {
      const double range = hit_distance(planes[k], {}, u);
      if (!(range > 0) || range >= second) continue;
      if (range >= first) {
        second = range;
        continue;
      }
      second = first;
      first = range;
      truth = static_cast<int>(k);
    }
    cloud.point.push_back((first + kNoise * noise.normal(i)) * u);
    cloud.truth.push_back(second - first < 0.2 ? kDoubtful : truth);
  }
  return cloud;
}

/// Replaces a share of the points by returns from anywhere in front of the wall.
void add_short_returns(Cloud& cloud, double share) {
  const RandomStream choice(11, 1), range(11, 2);
  for (std::size_t i = 0; i < cloud.point.size(); ++i) {
    if (choice.uniform(i) >= share) continue;
    const double part = range.uniform(i);
    cloud.point[i] = part * cloud.point[i];
    cloud.truth[i] = part < 0.95 ? kClutter : kDoubtful;
  }
}

/// Moves a square region of the walls, 0.13 of the range wide, away from the sensor: a recess, a
/// twentieth of the field of view.
void add_recess(Cloud& cloud, double depth) {
  for (std::size_t i = 0; i < cloud.point.size(); ++i) {
    const Vector3<double>& u = cloud.direction[i];
    if (cloud.truth[i] < 0 || std::abs(u.y - 0.1) > 0.066 || std::abs(u.z + 0.08) > 0.066) continue;
    const Plane& plane = cloud.planes[cloud.truth[i]];
    cloud.point[i] += (depth / dot(plane.normal, u)) * u;
    cloud.truth[i] = kDoubtful;
  }
}

/// Puts a box in front of the walls: its middle, and its size along X, Y, Z. Its points fill it, as
/// those of a person in clothes do.
void add_body(Cloud& cloud, const Vector3<double>& middle, const Vector3<double>& size) {
  const RandomStream depth(12, 1);
  for (std::size_t i = 0; i < cloud.point.size(); ++i) {
    const Vector3<double>& u = cloud.direction[i];
    const double x = middle.x + size.x * (depth.uniform(i) - 0.5);
    const Vector3<double> p = (x / u.x) * u;
    if (std::abs(p.y - middle.y) > 0.5 * size.y || std::abs(p.z - middle.z) > 0.5 * size.z) {
      continue;
    }
    cloud.point[i] = p;
    cloud.truth[i] = kClutter;
  }
}

/// Bends the directions smoothly: a shape error that no rotation explains, of that RMS, rad.
void bend(Cloud& cloud, double rms) {
  for (std::size_t i = 0; i < cloud.point.size(); ++i) {
    const double range = norm(cloud.point[i]);
    const double y = cloud.point[i].y / (0.33 * range), z = cloud.point[i].z / (0.33 * range);
    const double dy = 1.6 * rms * (y * y - z * z + 0.5 * y), dz = 1.6 * rms * (y * z + 0.7 * y * y);
    cloud.point[i] =
        range * normalized(cloud.point[i] + Vector3<double>{0, range * dy, range * dz});
  }
}

struct Agreement {
  double labels = 0;      // share of the points with an undoubted plane that have its label
  double clutter = 0;     // share of the points of planes that are clutter
  double normal_deg = 0;  // largest difference from the truth
  double distance = 0;    // m
  std::size_t extra = 0;  // planes that are none
  bool all = true;        // every plane was found
};

Agreement compare(const Cloud& cloud, const Segmentation& found) {
  Agreement result;
  std::vector<int> match(cloud.planes.size(), -1);
  std::vector<bool> used(found.planes.size(), false);
  for (std::size_t k = 0; k < cloud.planes.size(); ++k) {
    for (std::size_t j = 0; j < found.planes.size(); ++j) {
      const double angle =
          degrees_from_radians(angle_between(cloud.planes[k].normal, found.planes[j].normal));
      const double distance = std::abs(cloud.planes[k].distance - found.planes[j].distance);
      if (used[j] || match[k] >= 0 || angle > 1.0 || distance > 0.5) continue;
      match[k] = static_cast<int>(j);
      used[j] = true;
      result.normal_deg = std::max(result.normal_deg, angle);
      result.distance = std::max(result.distance, distance);
    }
    result.all = result.all && match[k] >= 0;
  }
  result.extra = static_cast<std::size_t>(std::ranges::count(used, false));
  double right = 0, known = 0, on_planes = 0, strays = 0;
  for (std::size_t i = 0; i < cloud.truth.size(); ++i) {
    if (cloud.truth[i] >= 0) {
      ++known;
      right += found.label[i] >= 0 && found.label[i] == match[cloud.truth[i]];
    }
    if (found.label[i] < 0 || !used[found.label[i]]) continue;
    ++on_planes;
    strays += cloud.truth[i] == kClutter;
  }
  result.labels = right / std::max(known, 1.0);
  result.clutter = strays / std::max(on_planes, 1.0);
  return result;
}

/// Segments and expects what every scene must reach.
void expect_found(const Cloud& cloud, const SegmentationOptions& options = {},
                  double normal_deg = 0.1, double distance = 0.05) {
  const Segmentation found = segment_planes(cloud.point, options);
  const Agreement agreement = compare(cloud, found);
  EXPECT_TRUE(agreement.all) << found.planes.size() << " planes";
  EXPECT_EQ(agreement.extra, 0u);
  EXPECT_GE(agreement.labels, 0.98);
  EXPECT_LE(agreement.clutter, 0.005);
  EXPECT_LE(agreement.normal_deg, normal_deg);
  EXPECT_LE(agreement.distance, distance);
  EXPECT_FALSE(found.on_one_line);
  for (std::size_t k = 0; k < found.planes.size(); ++k) {
    EXPECT_GE(found.points[k == 0 ? 0 : k - 1], found.points[k]);
    EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(found.label, static_cast<int>(k))),
              found.points[k]);
    EXPECT_GE(found.planes[k].distance, 0.0);
    EXPECT_NEAR(norm(found.planes[k].normal), 1.0, 1e-12);
  }
  ::testing::Test::RecordProperty("label_agreement", std::to_string(agreement.labels));
  ::testing::Test::RecordProperty("normal_deg", std::to_string(agreement.normal_deg));
  ::testing::Test::RecordProperty("distance_m", std::to_string(agreement.distance));
}

const std::vector<Plane> kOneWall{wall(10, 10, 30)};
const std::vector<Plane> kSteepWall{wall(60, 0, 15)};
const std::vector<Plane> kCubeCorner{wall(54.7356, 0, 10), wall(-35.2644, 45, 10),
                                     wall(-35.2644, -45, 10)};
const std::vector<Plane> kCorridor{wall(0, 0, 15), wall(90, 0, 2), wall(-90, 0, 2), wall(0, 90, 2),
                                   wall(0, -90, 2)};
const std::vector<Plane> kHall{wall(0, 0, 30), wall(90, 0, 5), wall(-90, 0, 5), wall(0, 90, 5),
                               wall(0, -90, 5)};
const std::vector<Plane> kPyramid{wall(55, 0, 10), wall(-55, 0, 10), wall(0, 55, 10),
                                  wall(0, -55, 10)};

struct NamedScene {
  const char* name;
  const std::vector<Plane>& planes;
};

class PlaneScenes : public ::testing::TestWithParam<NamedScene> {};

TEST_P(PlaneScenes, EveryPointFindsItsPlane) { expect_found(seen(GetParam().planes, 10000)); }

TEST_P(PlaneScenes, AlsoBehindShortReturns) {
  Cloud cloud = seen(GetParam().planes, 10000);
  add_short_returns(cloud, 0.05);
  expect_found(cloud);
}

TEST_P(PlaneScenes, AlsoBehindAPerson) {
  Cloud cloud = seen(GetParam().planes, 10000);
  add_body(cloud, {5.0, 0.4, -0.3}, {0.3, 0.5, 1.8});
  expect_found(cloud);
}

TEST_P(PlaneScenes, AlsoWithDirectionsThatAreBent) {
  Cloud cloud = seen(GetParam().planes, 10000);
  const double rms = radians_from_degrees(0.1);
  bend(cloud, rms);
  SegmentationOptions options;
  options.pointing_noise = rms;
  expect_found(cloud, options, 0.6, 0.3);
}

TEST_P(PlaneScenes, AlsoWithManyPoints) { expect_found(seen(GetParam().planes, 60000, 2)); }

TEST_P(PlaneScenes, ARecessIsAPlaneOfItsOwnOrNone) {
  Cloud cloud = seen(GetParam().planes, 10000);
  add_recess(cloud, 0.2);
  const Agreement agreement = compare(cloud, segment_planes(cloud.point, {}));
  EXPECT_TRUE(agreement.all);
  EXPECT_LE(agreement.extra, 1u);
  EXPECT_GE(agreement.labels, 0.98);
  EXPECT_LE(agreement.normal_deg, 0.1);
  EXPECT_LE(agreement.distance, 0.05);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, PlaneScenes,
    ::testing::Values(NamedScene{"OneWall", kOneWall}, NamedScene{"SteepWall", kSteepWall},
                      NamedScene{"CubeCorner", kCubeCorner}, NamedScene{"Corridor", kCorridor},
                      NamedScene{"Hall", kHall}, NamedScene{"Pyramid", kPyramid}),
    [](const auto& scene) { return scene.param.name; });

TEST(PlaneSegmentation, NoiseAtEdgesBiasesOnlyPointsThatMayBeLeftOut) {
  const Cloud cloud = seen(kPyramid, 60000);
  SegmentationOptions options;
  const Segmentation nearest = segment_planes(cloud.point, options);
  options.leave_out_edges = true;
  const Segmentation without = segment_planes(cloud.point, options);
  ASSERT_EQ(nearest.planes.size(), 4u);
  ASSERT_EQ(without.planes.size(), 4u);
  // Distances from the true planes in sigmas, at the edges and elsewhere.
  std::array<double, 2> sum{}, count{};
  for (std::size_t i = 0; i < cloud.point.size(); ++i) {
    if (nearest.label[i] < 0) continue;
    const Plane& own = nearest.planes[nearest.label[i]];
    for (const Plane& truth : cloud.planes) {
      if (angle_between(own.normal, truth.normal) > 0.01) continue;
      const std::size_t inside = without.label[i] >= 0 ? 1 : 0;
      sum[inside] +=
          signed_distance(truth, cloud.point[i]) / distance_sigma(truth, cloud.point[i], {});
      count[inside] += 1.0;
    }
  }
  EXPECT_NEAR(count[0] / (count[0] + count[1]), 0.058, 0.01);
  EXPECT_LT(sum[0] / count[0], -0.1);
  EXPECT_LT(std::abs(sum[1] / count[1]), 3.0 / std::sqrt(count[1]));
}

TEST(PlaneSegmentation, AFlatPersonTakesNoPointsOfTheWall) {
  Cloud cloud = seen(kOneWall, 10000);
  add_body(cloud, {6.0, 0.3, 0.2}, {0.01, 0.6, 1.8});
  const Segmentation found = segment_planes(cloud.point, {});
  const Agreement agreement = compare(cloud, found);
  EXPECT_GE(agreement.labels, 0.98);
  EXPECT_LE(agreement.extra, 1u);
  EXPECT_LT(agreement.normal_deg, 0.02);
}

TEST(PlaneSegmentation, ARecessTakesNoTailOfTheWallsNoise) {
  Cloud cloud = seen({wall(0, 0, 20)}, 30000);
  add_recess(cloud, 0.1);
  const Segmentation found = segment_planes(cloud.point, {});
  ASSERT_EQ(found.planes.size(), 2u);
  // 2.5 sigmas in front of the recess, points far from it still belong to the wall.
  std::size_t tail = 0, kept = 0;
  for (std::size_t i = 0; i < cloud.point.size(); ++i) {
    const double sigmas = signed_distance(cloud.planes[0], cloud.point[i]) /
                          distance_sigma(cloud.planes[0], cloud.point[i], {});
    if (cloud.direction[i].y > -0.05 || sigmas < 2.55 || sigmas > 2.95) continue;
    ++tail;
    kept += found.label[i] == 0;
  }
  EXPECT_GT(tail, 30u);
  EXPECT_EQ(kept, tail);
}

TEST(PlaneSegmentation, OneSurfaceIsOnePlane) {
  // A wall bent by more than the stated noise explains falls apart at first.
  Cloud cloud = seen({wall(30, 20, 20)}, 10000);
  bend(cloud, radians_from_degrees(0.05));
  SegmentationOptions options;
  options.pointing_noise = radians_from_degrees(0.03);
  EXPECT_EQ(segment_planes(cloud.point, options).planes.size(), 1u);
}

TEST(PlaneSegmentation, PointsOnOneLineAreNoPlane) {
  for (const double width : {0.0, 0.01}) {
    Cloud cloud = seen(kOneWall, 10000);
    std::vector<Vector3<double>> strip;
    for (std::size_t i = 0; i < cloud.point.size(); ++i) {
      const double range = norm(cloud.point[i]);
      Vector3<double> u = cloud.direction[i];
      u.z = 0.3 * u.y + width * u.z;
      strip.push_back(range * normalized(u));
    }
    Segmentation found = segment_planes(strip, {});
    EXPECT_TRUE(found.on_one_line);
    EXPECT_TRUE(found.planes.empty());
    EXPECT_EQ(std::ranges::count(found.label, -1), 10000);
    // Strays all around make no area of it.
    const RandomStream choice(5, 0), range(5, 1);
    for (std::size_t i = 0; i < strip.size(); ++i) {
      if (choice.uniform(i) < 0.1) strip[i] = (30.0 * range.uniform(i)) * cloud.direction[i];
    }
    found = segment_planes(strip, {});
    EXPECT_TRUE(found.on_one_line);
    EXPECT_TRUE(found.planes.empty());
  }
}

TEST(PlaneSegmentation, ScatteredPointsAreNoPlane) {
  Cloud cloud = seen(kOneWall, 5000);
  add_short_returns(cloud, 1.0);
  const Segmentation found = segment_planes(cloud.point, {});
  EXPECT_TRUE(found.planes.empty());
  EXPECT_FALSE(found.on_one_line);
  EXPECT_EQ(std::ranges::count(found.label, -1), 5000);
}

TEST(PlaneSegmentation, TooFewPointsAreNoPlane) {
  Cloud cloud = seen(kOneWall, 99);
  for (const std::size_t size : {0u, 1u, 3u, 99u}) {
    const Segmentation found = segment_planes(std::span(cloud.point).first(size), {});
    EXPECT_TRUE(found.planes.empty());
    EXPECT_TRUE(found.points.empty());
    EXPECT_FALSE(found.on_one_line);
    EXPECT_EQ(found.label, std::vector<int>(size, -1));
  }
}

TEST(PlaneSegmentation, PointsThatAreNoNumbersAreClutter) {
  Cloud cloud = seen(kHall, 10000);
  const Segmentation before = segment_planes(cloud.point, {});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<Vector3<double>> points;
  for (std::size_t i = 0; i < cloud.point.size(); ++i) {
    points.push_back(cloud.point[i]);
    if (i % 7 == 0) points.push_back({nan, nan, nan});
    if (i % 11 == 0) points.push_back({0, 0, 0});
  }
  const Segmentation found = segment_planes(points, {});
  ASSERT_EQ(found.label.size(), points.size());
  std::vector<int> labels;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (norm(points[i]) > 0) {
      labels.push_back(found.label[i]);
    } else {
      EXPECT_EQ(found.label[i], -1);
    }
  }
  EXPECT_EQ(labels, before.label);
  EXPECT_TRUE(segment_planes(std::vector<Vector3<double>>(500, {nan, 0, 0}), {}).planes.empty());
}

TEST(PlaneSegmentation, ASeedGivesTheSameResultAndAnotherOneTheSamePlanes) {
  Cloud cloud = seen(kCorridor, 10000);
  add_short_returns(cloud, 0.05);
  const Segmentation a = segment_planes(cloud.point, {}), b = segment_planes(cloud.point, {});
  EXPECT_EQ(a.label, b.label);
  EXPECT_EQ(a.points, b.points);
  ASSERT_EQ(a.planes.size(), b.planes.size());
  for (std::size_t k = 0; k < a.planes.size(); ++k) {
    EXPECT_EQ(a.planes[k].distance, b.planes[k].distance);
  }
  SegmentationOptions options;
  for (options.seed = 1; options.seed < 20; ++options.seed) {
    const Agreement agreement = compare(cloud, segment_planes(cloud.point, options));
    EXPECT_TRUE(agreement.all && agreement.extra == 0) << "seed " << options.seed;
    EXPECT_GE(agreement.labels, 0.98);
  }
}

TEST(PlaneSegmentation, TheNumberOfPlanesHasALimit) {
  SegmentationOptions options;
  options.most_planes = 2;
  EXPECT_EQ(segment_planes(seen(kHall, 10000).point, options).planes.size(), 2u);
}

TEST(PlaneSegmentation, SmallPlanesAreClutter) {
  SegmentationOptions options;
  options.least_fraction = 0.4;  // each of the four walls has a quarter
  EXPECT_TRUE(segment_planes(seen(kPyramid, 10000).point, options).planes.empty());
}

TEST(DistanceSigma, RangeNoiseCountsAlongTheNormalAndPointingNoiseAcross) {
  const Plane plane = wall(60, 0, 10);  // met at 60 degrees by a beam along X, at 20 m
  SegmentationOptions options;
  options.range_noise = 0.02;
  EXPECT_NEAR(distance_sigma(plane, {20, 0, 0}, options), 0.01, 1e-12);
  options.pointing_noise = 1e-3;
  EXPECT_NEAR(distance_sigma(plane, {20, 0, 0}, options),
              std::hypot(0.01, 20 * 1e-3 * std::sqrt(0.75)), 1e-12);
  EXPECT_NEAR(distance_sigma(wall(0, 0, 20), {20, 0, 0}, options), 0.02, 1e-12);
}

TEST(FittedPlane, IsThePlaneThatThePointsLieOn) {
  const Plane truth = wall(20, -35, 12);
  const std::vector<Vector3<double>> directions = rosette(100);
  std::vector<Vector3<double>> points;
  std::vector<std::size_t> use;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    points.push_back(hit_distance(truth, {}, directions[i]) * directions[i]);
    if (i % 3 == 0) {
      points.back() = {1, 2, 3};
    } else {
      use.push_back(i);
    }
  }
  const Plane plane = fitted_plane(points, use);
  EXPECT_NEAR(angle_between(plane.normal, truth.normal), 0.0, 1e-12);
  EXPECT_NEAR(plane.distance, 12.0, 1e-11);
}

TEST(FittedPlane, RefusesWhatDoesNotFixAPlane) {
  const std::vector<Vector3<double>> points{{1, 0, 0}, {2, 1, 3}, {3, 2, 6}, {4, 3, 9}, {1, 1, 1}};
  EXPECT_THROW(fitted_plane(points, std::vector<std::size_t>{0, 4}), EstimationError);
  EXPECT_THROW(fitted_plane(points, std::vector<std::size_t>{0, 1, 2, 3}), EstimationError);
  EXPECT_NO_THROW(fitted_plane(points, std::vector<std::size_t>{0, 1, 4}));
}

}  // namespace risley::calibration::plane_segmentation_test
