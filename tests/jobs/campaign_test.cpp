// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Campaigns: what a plan says, cells that depend on their number alone, parts and their merge.
#include "risley/jobs/campaign.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/hashes/sha256.hpp"
#include "risley/io/folder.hpp"

#include "jobs/campaign_chunk.hpp"
#include "refusal.hpp"
#include "source_tree.hpp"
#include "warning_codes.hpp"

namespace risley::jobs::campaign_test {

namespace fs = std::filesystem;

constexpr const char* kSimulate =
    "simulate: {sensor: mid-40-table3, duration_s: 0.2, rate_hz: 2000, noise_angle_deg: 0.01}\n";
constexpr const char* kPlan =
    "simulate: {sensor: mid-40-table3, duration_s: 0.2, rate_hz: 2000, noise_angle_deg: 0.01, "
    "format: sequence.csv}\n"
    "estimate: {sensor: mid-40, noise_angle_deg: 0.01}\n"
    "grid:\n"
    "  simulate.noise_angle_deg: [0.01, 0.02]\n"
    "  simulate.rotor: [constant, hunting, sinusoidal]\n"
    "seeds: {first: 5, count: 2}\n";

class CampaignTest : public ::testing::Test {
 protected:
  CampaignTest() : folder_(1e6) {}

  std::string file(const std::string& name) const {
    return (fs::path(folder_.path()) / name).string();
  }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
  }
  static std::string read(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
  CampaignPlan plan(const std::string& text = kPlan) const {
    write("plan.yaml", text);
    return load_campaign_plan(file("plan.yaml"));
  }
  CampaignOptions options(const std::string& name) const { return {file(name), "risley test"}; }

  io::TemporaryFolder folder_;
};

TEST_F(CampaignTest, APlanIsAGridTimesSeeds) {
  const CampaignPlan found = plan();
  ASSERT_EQ(found.settings.size(), 6U);
  EXPECT_EQ(found.cells(), 12U);
  EXPECT_EQ(grid_words(found.settings[1].grid),
            "simulate.noise_angle_deg 0.01, simulate.rotor hunting");
  const simulation::SimulationSettings& last = found.settings[5].simulations.front();
  EXPECT_EQ(last.rotor, simulation::RotorKind::sinusoidal);
  EXPECT_DOUBLE_EQ(*last.angle_noise, radians_from_degrees(0.02));
  EXPECT_EQ(found.cell(0).seed, 5U);
  EXPECT_EQ(found.cell(7).setting, 1U);
  EXPECT_EQ(found.cell(7).seed, 6U);
  const CampaignPlan other = load_campaign_plan(file("plan.yaml"), 100);
  EXPECT_EQ(other.cell(7).seed, 106U);
  EXPECT_NE(other.work, found.work);
  EXPECT_NE(refusal([&] { load_campaign_plan(file("plan.yaml"), ~std::uint64_t{0}); }).find("seed"),
            std::string::npos);
}

TEST_F(CampaignTest, CommentsAndOrderAreNotTheWorkButFilesAre) {
  const std::string work = plan().work;
  EXPECT_EQ(plan(std::string("# noted\n") + kPlan).work, work);
  EXPECT_EQ(plan("estimate: {noise_angle_deg: 0.01, sensor: mid-40}\nseeds: {count: 2, first: 5}\n"
                 "simulate: {rate_hz: 2000, noise_angle_deg: 0.01, duration_s: 0.2, sensor: "
                 "mid-40-table3, format: sequence.csv}\n"
                 "grid: {simulate.noise_angle_deg: [0.01, 0.02], simulate.rotor: [constant, "
                 "hunting, sinusoidal]}\n")
                .work,
            work);
  std::string other = kPlan;
  other.replace(other.find("2000"), 4, "2001");
  EXPECT_NE(plan(other).work, work);
  write("wall.yaml",
        "planes: [{name: wall, distance_m: 30, normal_azimuth_deg: 10, "
        "normal_zenith_deg: 80}]\n");
  const std::string with_scene =
      "simulate: {duration_s: 0.2, rate_hz: 2000, scene: wall.yaml}\ncalibrate:\nseeds: {count: "
      "1}\n";
  const std::string scene_work = plan(with_scene).work;
  EXPECT_EQ(plan(with_scene).work, scene_work);
  write("wall.yaml",
        "planes: [{name: wall, distance_m: 31, normal_azimuth_deg: 10, "
        "normal_zenith_deg: 80}]\n");
  EXPECT_NE(plan(with_scene).work, scene_work);
}

TEST_F(CampaignTest, WhatIsNoPlanIsToldBeforeTheFirstCell) {
  const auto expect = [&](const std::string& text, const std::string& words) {
    EXPECT_THROW(plan(text), Error) << text;
    try {
      plan(text);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << text << "\n"
                                                                          << error.what();
    }
  };
  const std::string simulate = kSimulate;
  expect("estimate:\nseeds: {count: 1}\n", "simulate is missing");
  expect(simulate + "seeds: {count: 1}\n", "either estimate or calibrate");
  expect(simulate + "estimate:\ncalibrate:\nseeds: {count: 1}\n", "either estimate or calibrate");
  expect(simulate + "estimate:\n", "seeds is missing");
  expect(simulate + "estimate:\nseeds: {count: 0}\n", "seeds.count = 0, allowed");
  expect(simulate + "estimate: {metod: map}\nseeds: {count: 1}\n", "estimate.metod");
  expect(simulate + "estimate: {method: mop}\nseeds: {count: 1}\n", "allowed: map, ekf");
  expect(simulate + "estimate: {fix: {wedge_angle_deg: 300}}\nseeds: {count: 1}\n",
         "wedge_angle_deg");
  expect(simulate + "estimate: {free: [nonsense]}\nseeds: {count: 1}\n", "nonsense");
  expect(simulate + "estimate:\ngrid: {simulate.rotor: constant}\nseeds: {count: 1}\n",
         "expected a list");
  expect(simulate + "estimate:\ngrid: {rotor: [constant]}\nseeds: {count: 1}\n",
         "below simulate, estimate or calibrate");
  expect(simulate + "estimate:\ngrid: {simulate.rotor: [constant, fast]}\nseeds: {count: 1}\n",
         "\"fast\"");
  expect(simulate + "estimate:\ngrid: {simulate.rate_hz: [1000, 0]}\nseeds: {count: 1}\n",
         "simulate.rate_hz 0");
  expect(simulate + "calibrate:\nseeds: {count: 1}\n", "simulate.scene is missing");
  expect("simulate: {scene: nowhere.yaml}\ncalibrate:\nseeds: {count: 1}\n", "nowhere.yaml");
  expect("simulate: {sensor: mid-4o}\nestimate:\nseeds: {count: 1}\n", "mid-4o");
}

TEST_F(CampaignTest, AnyWayToDivideItGivesTheSameTable) {
  const CampaignPlan all = plan();
  run_chunk(all, {1, 1}, options("one"));
  const CampaignResult one = merge_chunks(all, file("one.csv"), options("one"));
  EXPECT_EQ(one.cells, 12U);
  EXPECT_EQ(one.done, 12U);
  EXPECT_TRUE(one.missing.empty());
  EXPECT_TRUE(one.warnings.empty());
  // Some parts twice, in another order, and parts of several divisions, which overlap.
  for (const auto& [number, count] :
       std::vector<std::pair<int, int>>{{7, 7}, {3, 7}, {1, 7}, {3, 7}, {2, 3}, {6, 7}, {1, 12}}) {
    run_chunk(all, {static_cast<std::uint64_t>(number), static_cast<std::uint64_t>(count)},
              options("many"));
  }
  const CampaignResult some = merge_chunks(all, file("some.csv"), options("many"));
  EXPECT_LT(some.done, 12U);
  std::uint64_t missing = 0;
  for (const auto& [first, last] : some.missing) missing += last - first + 1;
  EXPECT_EQ(some.done + missing, 12U);
  for (const int number : {2, 4, 5}) {
    run_chunk(all, {static_cast<std::uint64_t>(number), 7}, options("many"));
  }
  const CampaignResult many = merge_chunks(all, file("many.csv"), options("many"));
  EXPECT_EQ(many.done, 12U);
  EXPECT_EQ(read(file("many.csv")), read(file("one.csv")));
  EXPECT_EQ(many.settings.size(), 6U);
  EXPECT_EQ(many.settings[4].cells, 2U);
}

TEST_F(CampaignTest, AChunkThatIsThereAndWholeIsNotComputedAgain) {
  const CampaignPlan all = plan();
  const CampaignChunk first = run_chunk(all, {2, 6}, options("a"));
  EXPECT_FALSE(first.made_before);
  EXPECT_EQ(first.first, 2U);
  EXPECT_EQ(first.cells, 2U);
  const std::string text = read(first.file);
  EXPECT_TRUE(run_chunk(all, {2, 6}, options("a")).made_before);
  // Cut, changed in one number, or of another program: made again, to the same bytes.
  const std::string digit = text.substr(0, 400) + (text[400] == '1' ? '2' : '1') + text.substr(401);
  for (const std::string& damaged : {text.substr(0, text.size() / 2), digit, text + "more\n"}) {
    std::ofstream(first.file) << damaged;
    EXPECT_FALSE(run_chunk(all, {2, 6}, options("a")).made_before);
    EXPECT_EQ(read(first.file), text);
  }
  CampaignOptions newer = options("a");
  newer.program = "risley newer";
  EXPECT_FALSE(run_chunk(all, {2, 6}, newer).made_before);
  EXPECT_NE(read(first.file), text);
}

TEST_F(CampaignTest, FilesThatDoNotCountAreNamed) {
  const CampaignPlan all = plan();
  const CampaignChunk good = run_chunk(all, {1, 2}, options("a"));
  const CampaignChunk cut = run_chunk(all, {2, 2}, options("a"));
  const std::string text = read(cut.file);
  std::ofstream(cut.file) << text.substr(0, text.size() - 100);
  std::string other = kPlan;
  other.replace(other.find("2000"), 4, "2001");
  run_chunk(plan(other), {2, 3}, options("a"));
  const CampaignResult merged = merge_chunks(all, file("a.csv"), options("a"));
  EXPECT_EQ(merged.done, 6U);
  ASSERT_EQ(merged.missing.size(), 1U);
  EXPECT_EQ(merged.missing.front().first, 6U);
  EXPECT_EQ(merged.missing.front().second, 11U);
  EXPECT_THAT(codes_of(merged.warnings),
              ::testing::ElementsAre("input_left_out", "input_left_out"));
}

TEST_F(CampaignTest, CellsOfSettingsThatThePlanDoesNotHaveDoNotCount) {
  const CampaignPlan all = plan();
  const CampaignChunk chunk = run_chunk(all, {1, 1}, options("a"));
  std::string text = read(chunk.file);
  text.resize(text.rfind('\n', text.size() - 2) + 1);  // without the line of the hash
  const std::string name = "\"setting\":";
  text.insert(text.find_first_of("0123456789", text.find(name) + name.size()), "214748364");
  text += "{\"sha256\": \"" + hashes::sha256(text) + "\"}\n";
  std::ofstream(chunk.file) << text;
  const CampaignResult merged = merge_chunks(all, file("a.csv"), options("a"));
  EXPECT_EQ(merged.done, 0U);
  ASSERT_EQ(merged.warnings.size(), 1U);
  EXPECT_THAT(merged.warnings[0].message, ::testing::HasSubstr("214748364"));
}

TEST_F(CampaignTest, WhatIsRefusedIsAnOutcomeWithItsReason) {
  // Ten shots are too few.
  const CampaignPlan few =
      plan("simulate: {duration_s: 0.01, rate_hz: 1000}\nestimate:\nseeds: {first: 1, count: 2}\n");
  const CellOutcome outcome = run_cell(few, 0);
  EXPECT_FALSE(outcome.answered);
  EXPECT_FALSE(outcome.message.empty());
  EXPECT_EQ(outcome.message.find("risley-"), std::string::npos) << outcome.message;
  run_chunk(few, {1, 1}, options("few"));
  const CampaignResult merged = merge_chunks(few, file("few.csv"), options("few"));
  EXPECT_EQ(merged.done, 2U);
  EXPECT_EQ(merged.settings.front().answered, 0U);
  EXPECT_TRUE(merged.settings.front().parameters.empty());
}

TEST_F(CampaignTest, CalibrationsOnWallsFromSeveralStationsAreJudgedToo) {
  fs::copy_file(in_source_tree("data/stations.yaml"), file("stations.yaml"));
  const CampaignPlan walls = plan(
      "simulate: {sensor: mid-40-table3, reported: nominal, duration_s: 1, rate_hz: 5000, scene: "
      "stations.yaml, stations: [upright right, flipped left], noise_angle_deg: 0.01}\n"
      "calibrate: {known_stations: yes, noise_angle_deg: 0.01}\nseeds: {first: 3, count: 1}\n");
  const CellOutcome outcome = run_cell(walls, 0);
  ASSERT_TRUE(outcome.answered) << outcome.message;
  ASSERT_EQ(outcome.errors.size(), 3U);
  EXPECT_EQ(outcome.errors[0].name, "directions");
  EXPECT_LT(outcome.errors[0].rms, 5.0 * outcome.errors[0].sigma);
  EXPECT_LT(outcome.errors[0].rms, outcome.errors[2].rms);
  EXPECT_LT(outcome.nees, 4.0);
}

TEST_F(CampaignTest, AChunkThatIsCancelledLeavesNothing) {
  const CampaignPlan all = plan();
  int told = 0;
  EXPECT_THROW(run_chunk(all, {1, 2}, options("a"),
                         [&](double) {
                           if (++told == 3) throw Cancelled();
                         }),
               Cancelled);
  EXPECT_TRUE(fs::is_empty(file("a/chunks")));
}

TEST_F(CampaignTest, WhatAFormatCannotHoldIsToldWithTheSetting) {
  const CampaignPlan lvx =
      plan(std::string(kSimulate) +
           "estimate:\ngrid: {simulate.format: [nc, lvx]}\nseeds: {count: 1}\n");
  EXPECT_EQ(refusal([&] { run_cell(lvx, 0); }), "");
  const std::string words = refusal([&] { run_cell(lvx, 1); });
  EXPECT_NE(words.find("plan.yaml: simulate.format lvx: 1.lvx: LVX needs ranges"),
            std::string::npos)
      << words;
}

TEST_F(CampaignTest, ChunksThatThereAreNotAreRefused) {
  const CampaignPlan all = plan();
  const auto refused = [&](const ChunkNumber& which) {
    return refusal([&] { run_chunk(all, which, options("a")); });
  };
  EXPECT_EQ(refused({0, 3}), "option chunk = 0/3, wanted I/N with I from 1 to N");
  EXPECT_EQ(refused({4, 3}), "option chunk = 4/3, wanted I/N with I from 1 to N");
  EXPECT_EQ(refused({1, 13}), "option chunk = 1/13: the plan has 12 cells, so N is at most 12");
}

TEST_F(CampaignTest, SumsAreThoseOfTheCells) {
  const CampaignPlan two = plan(std::string(kSimulate) + "estimate:\nseeds: {count: 3}\n");
  std::vector<CellOutcome> outcomes(3);
  const double errors[] = {1.0, -2.0, 3.0};
  for (std::size_t i = 0; i < 3; ++i) {
    outcomes[i].cell = two.cell(i);
    outcomes[i].answered = i != 2;
    outcomes[i].nees = errors[i];
    outcomes[i].degrees_of_freedom = 2;
    outcomes[i].nees_rotation_angles = std::numeric_limits<double>::quiet_NaN();
    if (i != 2) outcomes[i].parameters = {{"refractive_index", 1.5, errors[i], 4.0, 2.0}};
  }
  fs::create_directories(chunk_folder(file("a")));
  save_chunk((fs::path(chunk_folder(file("a"))) / "x.jsonl").string(),
             {two.work, "risley test", 0, 3}, outcomes);
  const CampaignResult merged = merge_chunks(two, file("a.csv"), options("a"));
  ASSERT_EQ(merged.done, 3U) << merged.warnings.front().message;
  const SettingSummary& summary = merged.settings.front();
  EXPECT_EQ(summary.cells, 3U);
  EXPECT_EQ(summary.answered, 2U);
  ASSERT_EQ(summary.parameters.size(), 1U);
  const ParameterSummary& index = summary.parameters.front();
  EXPECT_DOUBLE_EQ(index.bias, -0.5);
  EXPECT_DOUBLE_EQ(index.rmse, std::sqrt(2.5));
  EXPECT_DOUBLE_EQ(index.bound, 2.0);
  EXPECT_DOUBLE_EQ(index.sigma, 4.0);
  EXPECT_DOUBLE_EQ(index.error_over_bound.value, std::sqrt(2.5) / 2.0);
  EXPECT_DOUBLE_EQ(index.within_two_sigma.value, 1.0);
  EXPECT_DOUBLE_EQ(summary.nees.value, -0.5);
  // Chi-square over 4 degrees: 0.48442 and 11.14329 hold 95 of 100.
  EXPECT_NEAR(summary.nees.low, 0.48442 / 4.0, 1e-5);
  EXPECT_NEAR(summary.nees.high, 11.14329 / 4.0, 1e-5);
  EXPECT_TRUE(std::isnan(summary.nees_rotation_angles));
  EXPECT_NE(read(file("a.csv")).find("\n2,0,2,0,,,"), std::string::npos) << read(file("a.csv"));
}

}  // namespace risley::jobs::campaign_test
