// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/optics/beam_origin_map.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"

#include "optics/trains.hpp"

namespace risley::beam_origin_map_test {

const PrismGeometry kMid40{{0.007}, {0.030}};
constexpr double kCell = radians_from_degrees(0.5);

PrismTrain ideal_mid_40() { return PrismTrain(parse_face_order("PA-AP")); }

double least(const std::vector<double>& column) {
  return *std::min_element(column.begin(), column.end());
}
double greatest(const std::vector<double>& column) {
  return *std::max_element(column.begin(), column.end());
}

// [B21 Fig. A1]: corrections of up to 4.4 mm on either side, from the paper's own grid of beams.
TEST(BeamOriginMap, ReachesThePapersExtremes) {
  const BeamOriginMap map = beam_origin_map(ideal_mid_40(), kMid40, 1081, kCell);
  EXPECT_EQ(map.beams, 1081U * 1081U);
  EXPECT_NEAR(1e3 * least(map.least_y), -4.4, 0.05);
  EXPECT_NEAR(1e3 * greatest(map.greatest_y), 4.4, 0.05);
  EXPECT_NEAR(1e3 * least(map.least_z), -4.4, 0.05);
  EXPECT_NEAR(1e3 * greatest(map.greatest_z), 4.4, 0.05);
  // The field of view is a disc of 38.4 degrees across (Table 1): its area in cells.
  const double cells = kPi * 19.2 * 19.2 / 0.25;
  EXPECT_NEAR(static_cast<double>(map.size()), cells, 0.05 * cells);
}

// Table A1's two beams share a cell, and so does what they differ by.
TEST(BeamOriginMap, ACellHoldsAllOriginsOfItsDirections) {
  const BeamOriginMap map = beam_origin_map(ideal_mid_40(), kMid40, 1081, kCell);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (std::abs(degrees_from_radians(map.azimuth[i]) - 1.75) > 0.1) continue;
    if (std::abs(degrees_from_radians(map.zenith[i]) - 83.25) > 0.1) continue;
    constexpr double kHalfDigit = 0.05;
    EXPECT_LE(1e3 * map.least_y[i], -2.1 + kHalfDigit);
    EXPECT_GE(1e3 * map.greatest_y[i], 3.0 - kHalfDigit);
    EXPECT_LE(1e3 * map.least_z[i], 0.8 + kHalfDigit);
    EXPECT_GE(1e3 * map.greatest_z[i], 2.3 - kHalfDigit);
    return;
  }
  FAIL() << "no cell there";
}

// The optical axis is where four cells meet, and the field of view is as far up as down.
TEST(BeamOriginMap, CellsStandAlikeOnAllSidesOfTheAxis) {
  const BeamOriginMap map = beam_origin_map(ideal_mid_40(), kMid40, 361, kCell);
  EXPECT_NEAR(least(map.azimuth) + greatest(map.azimuth), 0, 1e-12);
  EXPECT_NEAR(least(map.zenith) + greatest(map.zenith), kPi, 1e-12);
}

TEST(BeamOriginMap, AgreesWithSingleRaysForAnyNumberOfPrisms) {
  for (const char* order : {"PA", "PA-AP", "PA-AP-AP"}) {
    const PrismTrain train = testing::imperfect_train(order, 0.5, 7);
    const BeamOriginMap map = beam_origin_map(train, kMid40, 60, radians_from_degrees(90.0));
    double y = 0;
    for (int i = 0; i < 4000; ++i) {
      std::vector<double> angles;
      angles.reserve(static_cast<std::size_t>(train.prisms()));
      for (int k = 0; k < train.prisms(); ++k)
        angles.push_back(0.37 * (i + 1) * (k + 1.3 * k * k + 1));
      const Ray ray = emergent_ray(train, kMid40, angles);
      if (ray.valid) y = std::max(y, ray.origin.y);
    }
    EXPECT_NEAR(greatest(map.greatest_y), y, 0.05 * y) << order;
  }
}

}  // namespace risley::beam_origin_map_test
