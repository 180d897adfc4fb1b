// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/campaign_page.hpp"

#include <functional>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"

#include "report/page_reading.hpp"

namespace risley::report::campaign_page_test {

using jobs::SettingSummary;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double deg(double degrees) { return radians_from_degrees(degrees); }

/// A setting of eight cells. @param nees  of the parameters; 0.8 to 1.2 is to be expected
SettingSummary setting(const std::string& noise, double nees) {
  SettingSummary one;
  one.grid = {{"simulate.noise_angle_deg", noise}};
  one.shape = {2};
  one.cells = one.answered = 8;
  one.nees = {nees, 0.8, 1.2};
  one.error_over_bound = 0.98 * nees;
  one.parameters = {
      {"refractive_index", true, 8, 1e-5, 2e-5, 3e-5, 4e-5, {0.67, 0.5, 1.4}, {1, 0.8, 1}},
      {"prism_tilt_b_vertical_deg",
       true,
       8,
       deg(-0.001),
       deg(0.006),
       deg(0.003),
       deg(0.003),
       {2, 0.5, 1.4},
       {0.5, 0.8, 1}},
      {"angular_velocity_a_deg_per_s",
       false,
       8,
       0,
       deg(0.5),
       deg(0.5),
       deg(0.5),
       {1, 0.5, 1.4},
       {1, 0.8, 1}}};
  return one;
}

/// A setting in which no cell has an answer.
SettingSummary without_answers(SettingSummary one) {
  one.answered = 0;
  one.nees = {kNaN, kNaN, kNaN};
  one.error_over_bound = kNaN;
  one.parameters.clear();
  return one;
}

jobs::CampaignResult example() {
  jobs::CampaignResult merged;
  merged.table = "cells.csv";
  merged.settings = {setting("0.01", 1.02), setting("0.02", 1.11)};
  merged.cells = merged.done = 16;
  return merged;
}

std::string page(const jobs::CampaignResult& merged) {
  return campaign_page(merged, {{"command", "risley campaign plan.yaml"}});
}

TEST(CampaignPage, MatchesItsGoldenText) {
  testing::GoldenPage golden("campaign", page(example()));
  const auto differs = [&](const std::string& when,
                           const std::function<void(jobs::CampaignResult&)>& change) {
    jobs::CampaignResult merged = example();
    change(merged);
    golden.differs(when, page(merged));
  };
  differs("cells without a result", [](auto& merged) {
    merged.done = 11;
    merged.missing = {{5, 9}};
    merged.settings[0].cells = merged.settings[0].answered = 5;
    merged.settings[1].cells = 6;
    merged.settings[1].answered = 4;
    merged.warnings = {{kWarning.input_left_out, "chunk-2-of-3.jsonl is cut off & ignored"}};
  });
  differs("one cell without a result", [](auto& merged) {
    merged.done = 15;
    merged.missing = {{15, 15}};
    merged.settings[1].cells = merged.settings[1].answered = 7;
  });
  differs("larger and smaller errors", [](auto& merged) {
    merged.settings[0].nees.value = 1.3;
    merged.settings[1].nees.value = 0.7;
  });
  differs("a setting without answers",
          [](auto& merged) { merged.settings[1] = without_answers(merged.settings[1]); });
  differs("no answers", [](auto& merged) {
    for (SettingSummary& one : merged.settings) one = without_answers(one);
  });
  const auto alone = [](double nees) {
    return [nees](auto& merged) {
      merged.settings = {setting("", nees)};
      merged.settings[0].grid.clear();
      merged.cells = merged.done = 8;
    };
  };
  differs("one setting", alone(1.02));
  differs("one setting with larger errors", alone(1.3));
  differs("one setting with smaller errors", alone(0.7));
}

TEST(CampaignPage, DrawsNumbersOfTheGridToScale) {
  jobs::CampaignResult merged = example();
  const auto drawn = testing::chart(page(merged), "Squared errors over covariances");
  EXPECT_EQ(drawn.at("x_label"), "simulate.noise_angle_deg");
  EXPECT_EQ(testing::series(drawn, "found").at("x"), (nlohmann::json{0.01, 0.02}));
  merged.settings[1].grid[0].second = "none";
  const auto places = testing::chart(page(merged), "Squared errors over covariances");
  EXPECT_EQ(places.at("x_label"), "setting, in the order of the table");
  EXPECT_EQ(testing::series(places, "found").at("x"), (nlohmann::json{1, 2}));
}

TEST(CampaignPage, StatesThatTablesOfParametersAreLimited) {
  constexpr std::size_t kTables = 60;
  jobs::CampaignResult merged = example();
  const auto tables = [&] {
    const std::string html = page(merged);
    std::size_t count = 0;
    for (std::size_t at = html.find("<th>mean error"); at != std::string::npos;
         at = html.find("<th>mean error", at + 1)) {
      ++count;
    }
    return std::pair(count, html.find("the JSON has all") != std::string::npos);
  };
  merged.settings.assign(kTables, setting("0.01", 1.02));
  EXPECT_EQ(tables(), std::pair(kTables, false));
  merged.settings.push_back(merged.settings.front());
  EXPECT_EQ(tables(), std::pair(kTables, true));
}

}  // namespace risley::report::campaign_page_test
