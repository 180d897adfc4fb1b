// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/comparison_page.hpp"

#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

#include "report/comparison_example.hpp"
#include "report/page_reading.hpp"

namespace risley::report::comparison_page_test {

double deg(double degrees) { return radians_from_degrees(degrees); }

/// What the page takes from a result.
Report result_of(const std::string& verb, const json::Json& verdict, const std::string& recording) {
  return {{{"verb", verb},
           {"converged", true},
           {"reason", ""},
           {"verdict", verdict},
           {"warnings", json::Json::array()},
           {"page", {{"recordings", {{{"name", recording}}}}}}}};
}

/// What the page is made of.
struct Page {
  Report a = result_of("estimate",
                       {{"code", "consistent"},
                        {"words", "the directions <agree>"},
                        {"to_do", "calibrate the unit on walls"}},
                       "march.lvx");
  Report b = result_of(
      "calibrate",
      {{"code", "bent"}, {"words", "directions are off"}, {"to_do", "use the calibration"}},
      "hall.lvx");
  jobs::ResultComparison comparison =
      testing::compared({{"refractive_index", 1.51, 2e-5},
                         {"wedge_angle_deg", deg(18), 0},
                         {"prism_tilt_b_vertical_deg", 0, deg(0.01)},
                         {"range_offset_m", 0, 0.001},
                         {"range_near_m", 0, 0.001},
                         {"range_incidence", 0, 0.0002},
                         {"range_per_decade_m", 0, 0.001},
                         {"range_emitter_1_m", 0, 0.001},
                         {"prism_thickness_a_m", 0.007, 0.001},
                         {"prism_spacing_a_m", 0.03, 0.003}},
                        {{"refractive_index", 1.51003, 1e-5},
                         {"wedge_angle_deg", deg(18), 0},
                         {"prism_tilt_b_vertical_deg", deg(-0.38), deg(0.02)},
                         {"range_offset_m", -0.012, 0.002},
                         {"range_near_m", 0.002, 0.001},
                         {"range_incidence", 0.0003, 0.0002},
                         {"range_per_decade_m", 0.001, 0.002},
                         {"range_emitter_1_m", 0.001, 0.001},
                         {"prism_thickness_a_m", 0.0072, 0.001},
                         {"prism_spacing_a_m", 0.031, 0.003}},
                        0.36);

  Page() { comparison.held_alike = true; }
  std::string html() const {
    return comparison_page({"march <1>", a}, {"hall", b}, comparison,
                           {{"command", "risley report \"march <1>\" hall"}});
  }
};

TEST(ComparisonPage, MatchesItsGoldenText) {
  testing::GoldenPage golden("comparison", Page().html());
  const auto differs = [&](const std::string& when, const std::function<void(Page&)>& change) {
    Page page;
    change(page);
    golden.differs(when, page.html());
  };
  differs("held at other values", [](Page& page) {
    jobs::ParameterDifference& wedge = page.comparison.parameters[1];
    wedge.value_b = deg(18.05);
    wedge.difference = deg(0.05);
    page.comparison.held_alike = false;
  });
  differs("two units", [](Page& page) { testing::of_two_units(page.comparison); });
  differs("a unit of no known serial number", [](Page& page) {
    testing::of_two_units(page.comparison);
    page.comparison.b.serial.clear();
  });
  differs("warnings and other verdicts", [](Page& page) {
    page.a.json["verdict"]["code"] = "unusual";
    page.a.json["warnings"] = {{{"message", "a <gap> of 2 s"}}};
    page.b.json["verdict"]["code"] = "off_within_tolerance";
    page.b.json["page"]["recordings"].push_back({{"name", "stairs.lvx"}});
  });
}

TEST(ComparisonPage, DrawsWhatHasASigma) {
  const Page page;
  const auto drawn =
      testing::chart(page.html(), "Differences of the parameters").at("series").at(0);
  EXPECT_EQ(drawn.at("x"), (nlohmann::json{1, 3, 4, 5, 6, 7, 8, 9, 10}));
  EXPECT_NEAR(drawn.at("y").at(5), 0.001 / 0.002236068, 1e-6);
}

}  // namespace risley::report::comparison_page_test
