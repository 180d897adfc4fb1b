// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/beam_origin_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::report::beam_origin_page_test {

TEST(BeamOriginPage, ShowsSixMapsWithTheirExtremes) {
  const sensors::Sensor sensor = sensors::load_sensor("mid-40");
  const BeamOriginMap map =
      beam_origin_map(sensor.train, sensor.geometry, 361, radians_from_degrees(1.0));
  const std::string page = beam_origin_page(map, sensor, {{"command", "risley cloud <x>"}});
  std::size_t maps = 0;
  for (std::size_t at = page.find("<figure"); at != std::string::npos;
       at = page.find("<figure", at + 1)) {
    ++maps;
  }
  EXPECT_EQ(maps, 6U);
  EXPECT_THAT(page, ::testing::HasSubstr("Prisms 7 ± 1 mm thick"));
  EXPECT_THAT(page, ::testing::HasSubstr("faces 30 ± 3 mm apart"));
  EXPECT_THAT(page, ::testing::HasSubstr("From -4.4 to"));
  EXPECT_THAT(page, ::testing::HasSubstr("to 4.4 mm"));
  EXPECT_THAT(page, ::testing::HasSubstr("risley cloud &lt;x&gt;"));
}

}  // namespace risley::report::beam_origin_page_test
