// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/rays.hpp"

#include <cstdint>

#include <gtest/gtest.h>

#include "risley/sensors/preset.hpp"

namespace risley::calibration::rays_test {

TEST(Rays, OfSomeRowsAreThoseOfAll) {
  const PrismTrain train = sensors::load_sensor("horizon").train;
  constexpr std::size_t kShots = 70000;  // more than one task works on
  RangedShots shots;
  shots.resize(train.prisms(), kShots);
  for (std::size_t i = 0; i < kShots; ++i) {
    for (std::size_t k = 0; k < shots.rotation_angle.size(); ++k) {
      shots.rotation_angle[k][i] = 0.001 * static_cast<double>((k + 3) * i);
    }
    shots.beam[i] = static_cast<std::uint8_t>(i % static_cast<std::size_t>(train.emitters()));
  }
  const PrismGeometry geometry;
  const Rays all(train, geometry, shots);
  for (const estimation::ShotRange rows :
       {estimation::ShotRange{0, kShots}, estimation::ShotRange{65536, kShots},
        estimation::ShotRange{3, 69001}, estimation::ShotRange{7, 7}}) {
    const Rays some(train, geometry, shots, rows);
    ASSERT_EQ(some.size(), rows.size());
    for (std::size_t i = 0; i < some.size(); i += 101) {
      const Vector3<double> found = some.point(i, 10), expected = all.point(rows.begin + i, 10);
      EXPECT_EQ(found.x, expected.x);
      EXPECT_EQ(found.y, expected.y);
      EXPECT_EQ(found.z, expected.z);
    }
  }
}

}  // namespace risley::calibration::rays_test
