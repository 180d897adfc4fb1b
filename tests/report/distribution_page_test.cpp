// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/distribution_page.hpp"

#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace risley::report::distribution_page_test {

using ::testing::HasSubstr;
using ::testing::Not;

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

TEST(DistributionPage, SaysAndDrawsWhatWasCounted) {
  const std::string page =
      distribution_page(some_distribution(2), "a <flight>", {{"command", "risley"}});
  for (const char* words :
       {"Density from above", "Strips that see the ground", "Density across the strips", "ANPD",
        "1.23 %", "321", "a &lt;flight&gt;", "&lt;east&gt;"}) {
    EXPECT_THAT(page, HasSubstr(words));
  }
  EXPECT_THAT(page, Not(HasSubstr("<east>")));
  EXPECT_THAT(page, Not(HasSubstr("strips.</p>")));
}

TEST(DistributionPage, StaysSmallForManyStrips) {
  const std::string page = distribution_page(some_distribution(900), "many", {});
  EXPECT_THAT(page, HasSubstr("The first 6 of 900 strips."));
  EXPECT_THAT(page, HasSubstr("The first 200 of 900 strips."));
}

TEST(DistributionPage, HasADashForWhatIsNotKnown) {
  cloud::PointDistributionSummary d = some_distribution(1);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  d.density = d.spacing = d.covered = d.overlap = nan;
  d.strips[0].empty_share = d.strips[0].density = nan;
  d.strips[0].profile = {};
  d.map.clear();
  EXPECT_THAT(distribution_page(d, "nothing", {}), Not(HasSubstr(">nan")));
}

}  // namespace risley::report::distribution_page_test
