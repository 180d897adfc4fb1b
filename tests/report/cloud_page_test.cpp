// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/cloud_page.hpp"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"

namespace risley::report::cloud_page_test {

using ::testing::HasSubstr;
using ::testing::Not;

cloud::CloudSummary some_cloud() {
  cloud::CloudSummary cloud;
  cloud.points = 1'234'567;
  cloud.observations = 1'300'000;
  cloud.no_return = 65'432;
  cloud.frame = "of the <sensor>";
  cloud::PointSample& sample = cloud.sample.emplace();
  sample.points = cloud.points;
  sample.frame.offset = {691'000, 0, 0};
  for (int i = 0; i < 100; ++i) {
    sample.x.push_back(i + 0.0004);
    sample.y.push_back(-i);
    sample.z.push_back(0.1 * i);
    sample.range.push_back(3 + i);
    sample.total_sigma.push_back(0.001 * (i + 1));
    sample.incidence.push_back(i == 0 ? std::numeric_limits<double>::quiet_NaN() : 0.01 * i);
    sample.intensity.push_back(static_cast<std::uint8_t>(i));
  }
  return cloud;
}

TEST(CloudPage, SaysHowSureThePointsAre) {
  cloud::CloudSummary cloud = some_cloud();
  cloud.warnings = {{kWarning.points_missing, "a <warning>"}};
  const std::string page = cloud_page(cloud, "a <scan>", {{"command", "risley"}});
  for (const char* words : {"a &lt;scan&gt;", "of the &lt;sensor&gt;", "a &lt;warning&gt;",
                            "50.0 mm", "95.0 mm", "forward − 691000 m", "\"left, m\"",
                            "100 of the 1\u202f234\u202f567 points are drawn, chosen at random",
                            "20 to 50 m", "99.0 %", "angle of incidence, deg", "intensity"}) {
    EXPECT_THAT(page, HasSubstr(words));
  }
  EXPECT_THAT(page, HasSubstr("[0.0,1.0,2.0,"));  // millimetres are enough
}

TEST(CloudPage, OfPointsWithoutCovarianceHasTheirPicture) {
  cloud::CloudSummary cloud = some_cloud();
  cloud.sample->total_sigma.clear();
  cloud.sample->points = cloud.points = 100;
  const std::string page = cloud_page(cloud, "scan", {});
  EXPECT_THAT(page, HasSubstr("All 100 points are drawn."));
  EXPECT_THAT(page, Not(HasSubstr("Uncertainty of the points")));
}

TEST(CloudPage, LeavesOutColoursThatNobodyKnows) {
  cloud::CloudSummary cloud = some_cloud();
  for (double& one : cloud.sample->incidence) one = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(cloud_page(cloud, "scan", {}), Not(HasSubstr("\"label\":\"angle of incidence")));
}

TEST(CloudPage, RefusesACloudWithoutASample) {
  EXPECT_THROW(cloud_page({}, "scan", {}), InvalidArgument);
}

}  // namespace risley::report::cloud_page_test
