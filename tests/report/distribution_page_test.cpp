// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/distribution_page.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/page_reading.hpp"

namespace risley::report::distribution_page_test {

using ::testing::HasSubstr;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

cloud::PointDistributionSummary some_distribution(std::size_t strips) {
  cloud::PointDistributionSummary d;
  d.empty_circle = 0.25;
  d.density_cell = 0.5;
  d.square = 1;
  d.points = 123'456;
  d.area = 1000;
  d.density = 123.456;
  d.spacing = 0.09;
  d.map = {{0.5, 0.5, 100, 1}, {1.5, 0.5, 200, 2}};
  for (std::size_t i = 0; i < strips; ++i) {
    cloud::StripDistribution strip;
    strip.strip = static_cast<std::uint16_t>(i + 1);
    strip.name = "<east>";
    strip.density = 321;
    strip.empty_share = 0.0123;
    strip.profile = {1, {-0.5, 0.5}, {300, 340}};
    d.strips.push_back(strip);
  }
  return d;
}

TEST(DistributionPage, MatchesItsGoldenText) {
  const auto page = [](const cloud::PointDistributionSummary& distribution) {
    return distribution_page(distribution, "a <flight>", {{"command", "risley"}});
  };
  testing::GoldenPage golden("distribution", page(some_distribution(2)));
  cloud::PointDistributionSummary d = some_distribution(2);
  d.density = d.spacing = d.covered = d.overlap = kUnknown;
  for (cloud::StripDistribution& strip : d.strips) {
    strip.empty_share = strip.density = kUnknown;
    strip.profile = {};
  }
  d.map.clear();
  golden.differs("little known", page(d));
}

TEST(DistributionPage, StaysSmallForManyStrips) {
  const std::string page = distribution_page(some_distribution(900), "many", {});
  EXPECT_THAT(page, HasSubstr("The first 6 of 900 strips."));
  EXPECT_THAT(page, HasSubstr("The first 200 of 900 strips."));
}

}  // namespace risley::report::distribution_page_test
