// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/cloud_page.hpp"

#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "risley/core/error.hpp"
#include "risley/jobs/compare_clouds.hpp"
#include "risley/json/results.hpp"

#include "report/page_reading.hpp"

namespace risley::report::cloud_page_test {

using ::testing::Contains;

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
    const auto number = static_cast<float>(i);
    sample.x.push_back(number);
    sample.y.push_back(-number);
    sample.z.push_back(0.1F * number);
    sample.range.push_back(3 + number);
    sample.total_sigma.push_back(0.001F * (number + 1));
    sample.incidence.push_back(i == 0 ? std::numeric_limits<float>::quiet_NaN() : 0.01F * number);
    sample.intensity.push_back(static_cast<std::uint8_t>(i));
  }
  return cloud;
}

TEST(CloudPage, MatchesItsGoldenText) {
  cloud::CloudSummary cloud = some_cloud();
  cloud.warnings = {{kWarning.points_missing, "a <warning>"}};
  testing::GoldenPage golden("cloud", cloud_page(cloud, "a <scan>", {{"command", "risley"}}));
  cloud.sample->total_sigma.clear();
  cloud.sample->points = cloud.points = 100;
  golden.differs("points without covariance",
                 cloud_page(cloud, "a <scan>", {{"command", "risley"}}));
}

TEST(CloudPage, ColoursPointsByWhatIsKnown) {
  cloud::CloudSummary cloud = some_cloud();
  const auto viewer = [&] { return testing::data(cloud_page(cloud, "scan", {}), "viewer-data"); };
  const auto labels = [&] {
    std::vector<std::string> found;
    const nlohmann::json shown = viewer();
    for (const auto& one : shown.at("colourings")) found.push_back(one.at("label"));
    return found;
  };
  const std::vector<std::string> all = labels();
  EXPECT_THAT(all, Contains("angle of incidence, deg"));
  EXPECT_THAT(all, Contains("intensity"));
  EXPECT_EQ(viewer().at("offset_m"), nlohmann::json::array({691000, 0, 0}));
  for (float& one : cloud.sample->incidence) one = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(labels().size(), all.size() - 1);
}

TEST(CloudPage, RefusesACloudWithoutASample) {
  EXPECT_THROW(cloud_page({}, "scan", {}), InvalidArgument);
}

TEST(ComparedCloudsJson, SaysWhichCloudHasWhichPoints) {
  jobs::ComparedClouds compared;
  compared.a = "a.las";
  compared.b = "b.las";
  compared.points_a = 1000;
  compared.points_b = 2000;
  cloud::SurfaceCell cell;
  cell.points_a = 10;
  cell.points_b = 20;
  compared.change.cells = {cell};
  const json::Json found = json::of(compared);
  EXPECT_EQ(found["a"], (json::Json{{"path", "a.las"}, {"points", 1000}}));
  EXPECT_EQ(found["b"], (json::Json{{"path", "b.las"}, {"points", 2000}}));
  EXPECT_EQ(found["cells"][0]["points"], json::Json::array({10, 20}));
}

}  // namespace risley::report::cloud_page_test
