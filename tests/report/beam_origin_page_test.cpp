// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/beam_origin_page.hpp"

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/sensors/preset.hpp"

#include "report/page_reading.hpp"

namespace risley::report::beam_origin_page_test {

TEST(BeamOriginPage, MatchesItsGoldenText) {
  const sensors::Sensor sensor = sensors::load_sensor("mid-40");
  const BeamOriginMap map =
      beam_origin_map(sensor.train, sensor.geometry, 361, radians_from_degrees(1.0));
  const testing::GoldenPage golden(
      "beam_origin", beam_origin_page(map, sensor, {{"command", "risley cloud <x>"}}));
}

}  // namespace risley::report::beam_origin_page_test
