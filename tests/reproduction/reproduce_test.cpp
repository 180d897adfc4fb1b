// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Tables fail when what is reproduced is made wrong. That all of them pass is what the test of the
// command says; the quick ones pass here, too.
#include "reproduction/reproduce.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "risley/core/error.hpp"

#include "reproduction/reproduction_page.hpp"

namespace risley::reproduction::reproduce_test {

constexpr Effort kSmall{3, 1, 1, 0, 5, 1, 1};

ReproduceOptions small_options() {
  ReproduceOptions options;
  options.effort = kSmall;
  return options;
}

Table table_of(const Reproduction& all, const std::string& name) {
  const auto found = std::find_if(all.tables.begin(), all.tables.end(),
                                  [&](const Table& table) { return table.name == name; });
  if (found == all.tables.end()) throw InvalidArgument("no table " + name);
  return *found;
}

Row row_of(const Table& table, const std::string& term) {
  const auto found = std::find_if(table.rows.begin(), table.rows.end(), [&](const Row& row) {
    return row.term.find(term) != std::string::npos;
  });
  if (found == table.rows.end()) throw InvalidArgument("no row " + term);
  return *found;
}

void expect_all_pass(const Reproduction& all) {
  for (const Table& table : all.tables) {
    for (const Row& row : table.rows) {
      EXPECT_TRUE(passes(row)) << table.name << ", " << row.term << ": " << reason_text(row);
    }
  }
}

/// Every number of a result as text.
std::string text_of(const Reproduction& all) {
  std::string text;
  for (const Table& table : all.tables) {
    for (const Row& row : table.rows) {
      text += row.term + " " + std::to_string(row.ours) + " " + reason_text(row) + row.note + "\n";
    }
  }
  for (const Figure& figure : all.figures) {
    for (const report::Chart& chart : figure.charts) {
      for (const report::Series& series : chart.series) {
        for (const double y : series.y) text += std::to_string(y) + " ";
      }
    }
  }
  return text;
}

TEST(Reproduce, SpecificationsAndPatternPass) {
  expect_all_pass(specifications(small_options()));
  expect_all_pass(scan_pattern(small_options()));
}

TEST(Reproduce, APatternThatRepeatsFailsFigure2) {
  ReproduceOptions options = small_options();
  // Both prisms are back where they were after 0.03 s.
  options.type.angular_velocity = {-kTwoPi * 100.0, kTwoPi * 200.0};
  const Reproduction all = scan_pattern(options);
  EXPECT_FALSE(passes(row_of(table_of(all, "figure_2"), "share of new cells")));
}

TEST(Reproduce, ZeroPositionPassesAndAWrongIndexFails) {
  ReproduceOptions options = small_options();
  expect_all_pass(zero_position(options));
  options.type.set("refractive_index", 1.52);
  const Reproduction wrong = zero_position(options);
  for (const char* term : {"zenith in the zero", "largest zenith", "field of view"}) {
    EXPECT_FALSE(passes(row_of(table_of(wrong, "zero_position"), term))) << term;
  }
}

TEST(Reproduce, TableA1PassesAndAWrongThicknessFails) {
  ReproduceOptions options = small_options();
  expect_all_pass(beam_origin_errors(options));
  options.type.set_prism_geometry({{0.008}, {0.030}});
  const Reproduction thick = beam_origin_errors(options);
  EXPECT_FALSE(passes(row_of(table_of(thick, "table_a1"), "beam 1, Y")));
  EXPECT_TRUE(passes(row_of(table_of(thick, "table_a1"), "beam 1, azimuth")));
  options.type.set_prism_geometry({{0.007}, {0.035}});
  const Reproduction wide = beam_origin_errors(options);
  EXPECT_FALSE(passes(row_of(table_of(wide, "figure_a1"), "towards -Y")));
}

TEST(Reproduce, MoreNoiseFailsTable3) {
  ReproduceOptions options = small_options();
  options.angle_noise = radians_from_degrees(0.02);
  const Reproduction noisy = simulated_unit(options);
  const Table table = table_of(noisy, "table_3");
  EXPECT_FALSE(passes(row_of(table, "azimuth observation errors")));
  EXPECT_FALSE(passes(row_of(table_of(noisy, "table_3_filter"), "noise on angles: azimuth")));
}

TEST(Reproduce, AnotherUnitFailsTable3) {
  ReproduceOptions options = small_options();
  options.unit.set("bearing_tilt_a_vertical_deg", radians_from_degrees(0.03));
  const Reproduction other = simulated_unit(options);
  EXPECT_FALSE(passes(row_of(table_of(other, "table_3"), "vertical bearing tilt")));
}

TEST(Reproduce, AnotherUnitFailsSection33) {
  ReproduceOptions options = small_options();
  options.unit.set("incident_beam_vertical_deg", radians_from_degrees(-0.3));
  const Reproduction other = incorrect_calibration(options);
  EXPECT_FALSE(passes(row_of(table_of(other, "section_3_3"), "RMSE of the reported zenith")));
}

TEST(Reproduce, MoreNoiseFailsThreePrisms) {
  ReproduceOptions options = small_options();
  options.angle_noise = radians_from_degrees(0.02);
  const Reproduction noisy = triple_prism(options);
  EXPECT_FALSE(passes(row_of(table_of(noisy, "triple_prism"), "azimuth observation errors")));
  EXPECT_FALSE(passes(row_of(table_of(noisy, "triple_prism_models"), "practical model")));
}

TEST(Reproduce, AnotherUnitFailsThreePrisms) {
  ReproduceOptions options = small_options();
  options.triple_unit = options.triple_type;  // without errors
  const Reproduction other = triple_prism(options);
  EXPECT_FALSE(passes(row_of(table_of(other, "triple_prism"), "vertical tilt of prism B")));
  EXPECT_FALSE(passes(row_of(table_of(other, "triple_prism_models"), "ideal model")));
}

TEST(Reproduce, SameSeedSameNumbersWhateverTheThreads) {
  ReproduceOptions options = small_options();
  options.effort.wall_seeds = 3;
  options.effort.wall_full_rate_seeds = 0;
  std::string one, two;
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = text_of(incorrect_calibration(options));
  }
  {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    two = text_of(incorrect_calibration(options));
  }
  EXPECT_EQ(one, two);
  options.seed = 1;
  EXPECT_NE(one, text_of(incorrect_calibration(options)));
}

TEST(ReproductionPage, SaysTheVerdictInWords) {
  Reproduction all;
  Row good{"good row", "deg", printed("3.0"), 3.01};
  good.checks = {at_printed_digits(*good.paper, good.ours)};
  Row bad{"bad <row>", "deg", printed("3.0"), 3.2};
  bad.checks = {at_printed_digits(*bad.paper, bad.ours)};
  all.tables = {{"table_x", "Table X", "A method.", {good, bad}}};
  Figure figure{"figure_x", "table_x", "Fig. X"};
  const report::Series cells{
      "mm", "a", report::SeriesKind::cells, {0.0, 0.5}, {90.0, 90.5}, {}, {-1.0, 2.0}, {},
      0.5,  0.5};
  figure.charts = {histogram_chart("samples", "deg", std::vector<double>{1, 2, 2, 3}),
                   field_of_view_chart("corrections", cells)};
  all.figures = {figure};
  const std::string page = reproduction_page(all, {{"command", "risley reproduce"}});
  EXPECT_THAT(page, ::testing::HasSubstr("1 of 2 rows pass"));
  EXPECT_THAT(page, ::testing::HasSubstr("✗ does not pass"));
  EXPECT_THAT(page, ::testing::HasSubstr("✓ passes"));
  EXPECT_THAT(page, ::testing::HasSubstr("bad &lt;row&gt;"));
  EXPECT_THAT(page, ::testing::HasSubstr("risley reproduce"));
  EXPECT_THAT(page, ::testing::HasSubstr("Fig. X"));
  EXPECT_THAT(page, ::testing::HasSubstr("\"title\":\"samples\""));
  EXPECT_THAT(page, ::testing::HasSubstr("\"cell_width\":0.5"));
}

}  // namespace risley::reproduction::reproduce_test
