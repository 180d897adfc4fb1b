// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/pattern_page.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "risley/core/angle.hpp"

#include "report/page_reading.hpp"

namespace risley::report::pattern_page_test {

using testing::data;

TEST(PatternPage, DrawsItsGoldenText) {
  sensors::CoverageOptions options;
  options.after = {0.02, 0.1};
  options.field_after = 3;
  options.cell = radians_from_degrees(1.0);
  const jobs::PatternDetails details = jobs::pattern_details("mid-70", {}, options);
  const std::string page = pattern_page(details, {{"command", "risley pattern <x>"}});
  const testing::GoldenPage golden("pattern", page);
  const nlohmann::json charts = data(page);
  ASSERT_EQ(charts.size(), 5U);  // rosette, two times, share against time, rings
  const std::vector<double> covered = charts[3]["series"][0]["y"];
  EXPECT_NEAR(covered.back(), 100 * details.coverage.after[1].covered, 1e-4);
  EXPECT_TRUE(std::is_sorted(covered.begin(), covered.end()));
  EXPECT_EQ(charts[0]["grows_for"], 0.1);
  EXPECT_EQ(charts[0]["series"][0]["x"].size(), 10'000U);
  EXPECT_TRUE(charts[1]["grows_for"].is_null());
  for (const std::size_t k : {1UL, 2UL}) {
    double shots = 0;  // density times solid angle, in square degrees
    for (const double density : charts[k]["series"][0]["value"]) shots += density;
    EXPECT_NEAR(shots, static_cast<double>(details.coverage.after[k - 1].shots), 1e-3 * shots);
  }
}

TEST(PatternPage, AScanAllAroundIsAPanoramaOfAzimuthAndElevation) {
  sensors::CoverageOptions options;
  options.after = {0.1};
  options.field_after = 3;
  const jobs::PatternDetails details = jobs::pattern_details("mid-360", {}, options);
  const nlohmann::json charts = data(pattern_page(details, {}));
  ASSERT_EQ(charts.size(), 4U);
  for (const std::size_t k : {0UL, 1UL}) {
    EXPECT_EQ(charts[k]["kind"], "panorama");
    const std::vector<double> azimuth = charts[k]["series"][0]["x"];
    const std::vector<double> elevation = charts[k]["series"][0]["y"];
    EXPECT_NEAR(*std::min_element(azimuth.begin(), azimuth.end()), -180, 2);
    EXPECT_NEAR(*std::max_element(azimuth.begin(), azimuth.end()), 180, 2);
    EXPECT_NEAR(*std::min_element(elevation.begin(), elevation.end()), -7.2, 1);
    EXPECT_NEAR(*std::max_element(elevation.begin(), elevation.end()), 52.2, 1);
  }
  // Density times solid angle, of cells that narrow away from the horizon; those on the rim, which
  // the field of view does not fill, count whole.
  const nlohmann::json& cells = charts[1]["series"][0];
  const double edge = cells["cell_width"];
  EXPECT_NEAR(std::remainder(360, edge), 0, 1e-9) << "a whole number of cells goes around";
  EXPECT_LE(cells["x"].size(), 12'000U);
  double shots = 0;
  for (std::size_t i = 0; i < cells["x"].size(); ++i) {
    const double up = radians_from_degrees(cells["y"][i].get<double>());
    shots += cells["value"][i].get<double>() * edge * edge * std::cos(up);
  }
  EXPECT_NEAR(shots, static_cast<double>(details.coverage.after[0].shots), 0.08 * shots);
}

TEST(PatternPage, StaysSmallWithSmallCells) {
  sensors::CoverageOptions options;
  options.after = {0.05, 0.1, 0.15, 0.2};
  options.field_after = 3;
  options.cell = radians_from_degrees(0.2);
  const jobs::PatternDetails details = jobs::pattern_details("avia", {}, options);
  EXPECT_GT(details.coverage.cells(), 90'000U);
  EXPECT_LE(details.rosette.size(), 25'000U);
  EXPECT_LT(pattern_page(details, {}).size(), 4U << 20);
}

// Thinned so that every emitter is still seen.
TEST(PatternDetails, KeepShotsOfAllEmitters) {
  sensors::CoverageOptions options;
  options.after = {0.4};
  options.field_after = 3;
  options.cell = radians_from_degrees(2.0);
  const jobs::PatternDetails details = jobs::pattern_details("tele-15", {}, options);
  EXPECT_EQ(details.rosette_every, 5U);
  std::vector<std::size_t> of(6);
  for (const std::uint8_t emitter : details.rosette.emitter) ++of.at(emitter);
  for (const std::size_t count : of) EXPECT_NEAR(static_cast<double>(count), 3200.0, 1.0);
}

}  // namespace risley::report::pattern_page_test
