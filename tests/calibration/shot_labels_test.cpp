// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/shot_labels.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "risley/sensors/preset.hpp"

#include "calibration/walls.hpp"

namespace risley::calibration::shot_labels_test {
namespace {

using testing::wall;

void append(RangedShots& all, const RangedShots& more) {
  const auto join = [](auto& column, const auto& rest) {
    column.insert(column.end(), rest.begin(), rest.end());
  };
  for (std::size_t k = 0; k < all.rotation_angle.size(); ++k) {
    join(all.rotation_angle[k], more.rotation_angle[k]);
  }
  for (std::size_t k = 0; k < all.angle_covariance.size(); ++k) {
    join(all.angle_covariance[k], more.angle_covariance[k]);
  }
  join(all.range, more.range);
  join(all.beam, more.beam);
  join(all.intensity, more.intensity);
}

class ShotLabels : public ::testing::Test {
 protected:
  const sensors::Sensor sensor_ = sensors::load_sensor("mid-40");
  const PrismGeometry geometry_;
  const testing::ShotSettings settings_{20000, 0.02, 1e-5, 0, 3};

  /// Labels of the shots of a scene, plane after plane, in a problem that knows the first only.
  std::vector<std::vector<int>> labels_of(const scenes::Scene& scene) const {
    scenes::Scene known;
    known.planes.push_back(scene.planes.front());
    PlanarProblem problem =
        testing::planar_problem(sensor_.train, geometry_, known, settings_.range_noise, settings_);
    const std::vector<RangedShots> planes =
        testing::shots_of_planes(sensor_.train, geometry_, scene, {}, settings_);
    RangedShots all = planes.front();
    for (std::size_t p = 1; p < planes.size(); ++p) append(all, planes[p]);
    const std::vector<int> labels = label_shots(problem, 0, all, 1e-5).view;
    std::vector<std::vector<int>> of_planes;
    auto begin = labels.begin();
    for (const RangedShots& plane : planes) {
      of_planes.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(plane.size()));
      begin += static_cast<std::ptrdiff_t>(plane.size());
    }
    return of_planes;
  }
};

double share_of_first(const std::vector<int>& labels) {
  return static_cast<double>(std::ranges::count(labels, 0)) / static_cast<double>(labels.size());
}

TEST_F(ShotLabels, AWallHasItsShotsButThoseBeyondTheGate) {
  scenes::Scene scene;
  scene.planes.push_back(wall("ahead", 0, 90, 4));
  EXPECT_NEAR(share_of_first(labels_of(scene).front()), 0.9973, 0.002);
}

TEST_F(ShotLabels, AWallGetsNoShotsOfASurfaceThatTheProblemDoesNotKnow) {
  scenes::Scene scene;
  scene.planes.push_back(wall("ahead", 0, 90, 4));
  scene.planes.push_back(wall("beside", 90, 90, 1.2));
  const auto labels = labels_of(scene);
  ASSERT_GT(labels[1].size(), 300U);
  EXPECT_EQ(std::ranges::count(labels[1], 0), 0);
  EXPECT_GT(share_of_first(labels[0]), 0.8);
}

}  // namespace
}  // namespace risley::calibration::shot_labels_test
