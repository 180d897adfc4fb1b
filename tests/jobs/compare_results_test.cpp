// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/compare_results.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/compare_units.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/tables/table_file.hpp"

#include "io/test_folder.hpp"
#include "refusal.hpp"

namespace risley::jobs::compare_results_test {

using ::testing::HasSubstr;

constexpr const char* kTilt = "incident_beam_vertical_deg";
constexpr const char* kWedge = "wedge_angle_deg";
constexpr double kSigma = 1e-5, kHeldSigma = 1e-3, kResponse = 0.5;  // rad, rad, 1

class CompareResults : public ::testing::Test {
 protected:
  /// A result that knows a tilt by kSigma, if the wedge is as held; each wedge error moves it.
  static sensors::Sensor result(const std::string& serial) {
    sensors::Sensor sensor = sensors::load_sensor("mid-40");
    sensor.serial = serial;
    sensor.covariance_names = {kWedge, kTilt};
    sensor.covariance.resize(2, 2);
    const double held = kHeldSigma * kHeldSigma;
    sensor.covariance << held, kResponse * held, kResponse * held,
        kSigma * kSigma + kResponse * kResponse * held;
    sensor.set_knowledge({kWedge, kHeldSigma, "assumed"});
    sensor.set_knowledge({kTilt, kSigma, "calibrated", std::sqrt(sensor.covariance(1, 1))});
    return sensor;
  }

  std::string saved(const std::string& name, const sensors::Sensor& sensor) const {
    const std::filesystem::path folder = folder_.path() / name;
    std::filesystem::create_directories(folder);
    io::write_text_file((folder / "calibration.yaml").string(), sensors::preset_text(sensor));
    return folder.string();
  }

  static const ParameterDifference& row(const ResultComparison& c, const std::string& name) {
    for (const ParameterDifference& one : c.parameters) {
      if (one.name == name) return one;
    }
    throw std::out_of_range(name);
  }

  io::TestFolder folder_;
};

TEST_F(CompareResults, OfOneResultWithItselfHasNoDifference) {
  const std::string path = saved("one", result("A1"));
  const ResultComparison c = compare_results(path, path);
  EXPECT_TRUE(c.same_unit);
  EXPECT_TRUE(c.held_alike);
  for (const ParameterDifference& one : c.parameters) EXPECT_EQ(one.difference, 0) << one.name;
  EXPECT_EQ(c.beams.errors.total, 0);
  EXPECT_EQ(c.parameters.back().name, "range_offset_m");
}

TEST_F(CompareResults, ATruthAndABeliefAreTwoThings) {
  sensors::Sensor belief = result("A1"), truth = result("A1");
  belief.reference = sensors::CalibrationReference::directions;
  truth.reference = sensors::CalibrationReference::planes;
  truth.set(kTilt, truth.get(kTilt) + 20 * kSigma);
  const std::string a = saved("a", belief), b = saved("b", truth), c = saved("c", belief);
  EXPECT_THROW(compare_units({{a, b}, 0.01}), InvalidArgument);
  EXPECT_TRUE(compare_units({{a, b}, 0.01, false, true}).pairs.at(0).changed);
  const ComparedUnits found = compare_units({{a, b, c}, 0.01});
  ASSERT_EQ(found.pairs.size(), 1U);  // a and c
  EXPECT_FALSE(found.pairs[0].changed);
  EXPECT_EQ(found.left_out.size(), 2U);
}

TEST_F(CompareResults, TwoUnitsAreNotOneThatChanged) {
  sensors::Sensor other = result("B2");
  other.set(kTilt, other.get(kTilt) + 20 * kSigma);
  const ComparedUnits found = compare_units({{saved("a", result("A1")), saved("b", other)}, 0.01});
  ASSERT_EQ(found.pairs.size(), 1U);
  EXPECT_LT(found.pairs[0].comparison.change.p_value, 1e-6);
  EXPECT_FALSE(found.pairs[0].changed);
}

// Turning the incident beam turns all beams alike, to a twentieth.
TEST_F(CompareResults, SaysHowFarDirectionsDiffer) {
  sensors::Sensor turned = result("A1");
  const double turn = radians_from_degrees(0.1);
  turned.set(kTilt, turned.get(kTilt) + turn);
  turned.range_offset += 0.01;
  const ResultComparison c = compare_results(saved("a", result("A1")), saved("b", turned));
  EXPECT_NEAR(row(c, kTilt).difference, turn, 1e-12);
  EXPECT_NEAR(row(c, "range_offset_m").difference, 0.01, 1e-12);
  EXPECT_EQ(row(c, "range_offset_m").sigma, 0);
  EXPECT_NEAR(c.beams.errors.total, turn, 0.05 * turn);
  EXPECT_LT(c.beams.errors.shape, 0.05 * turn);
  EXPECT_NEAR(c.beams.total_sigma, std::sqrt(2.0) * kSigma, 0.1 * kSigma);
}

// What both held at the same value is off by the same in both, if they are of one unit.
TEST_F(CompareResults, LeavesOutWhatBothHeldAlike) {
  const std::string a = saved("a", result("A1"));
  const ResultComparison same = compare_results(a, saved("b", result("A1")));
  EXPECT_NEAR(row(same, kTilt).sigma_a, kSigma, 1e-6 * kSigma);
  EXPECT_NEAR(row(same, kTilt).sigma, std::sqrt(2.0) * kSigma, 1e-6 * kSigma);
  EXPECT_EQ(row(same, kWedge).sigma, 0);

  const double all = std::hypot(kSigma, kResponse * kHeldSigma);
  const ResultComparison other = compare_results(a, saved("c", result("B2")));
  EXPECT_FALSE(other.same_unit);
  EXPECT_EQ(one_unit_words(same), "yes");
  EXPECT_EQ(one_unit_words(other), "no");
  EXPECT_EQ(one_unit_words(compare_results(a, "mid-40")), "not known");
  EXPECT_FALSE(other.held_alike);
  EXPECT_NEAR(row(other, kTilt).sigma, std::sqrt(2.0) * all, 1e-6 * all);
  EXPECT_NEAR(row(other, kWedge).sigma, std::sqrt(2.0) * kHeldSigma, 1e-9);

  sensors::Sensor held_elsewhere = result("A1");
  held_elsewhere.set(kWedge, held_elsewhere.get(kWedge) + 1e-4);
  const ResultComparison elsewhere = compare_results(a, saved("d", held_elsewhere));
  EXPECT_TRUE(elsewhere.same_unit);
  EXPECT_FALSE(elsewhere.held_alike);
}

// Sizes of prisms that walls found are compared, too, and say nothing of the directions.
TEST_F(CompareResults, TellsSizesOfPrismsApart) {
  sensors::Sensor one = result("A1");
  one.geometry = {{0.007, 0.007}, {0.03}};
  one.covariance_names.emplace_back("prism_thickness_b_m");
  one.covariance.conservativeResizeLike(Eigen::MatrixXd::Zero(3, 3));
  one.covariance(2, 2) = 1e-8;
  one.covariance(1, 2) = one.covariance(2, 1) = 1e-10;
  sensors::Sensor other = one;
  other.geometry.thickness[1] = 0.008;
  const ResultComparison c = compare_results(saved("a", one), saved("b", other));
  EXPECT_NEAR(row(c, "prism_thickness_b_m").difference, 0.001, 1e-12);
  EXPECT_NEAR(row(c, "prism_thickness_b_m").sigma, std::sqrt(2e-8), 1e-9);
  EXPECT_EQ(c.change.degrees_of_freedom, 1);
  EXPECT_EQ(c.change.chi2, 0);
  EXPECT_EQ(c.beams.errors.total, 0);
  EXPECT_EQ(file_unit_of("prism_thickness_b_m", {2}).unit, "m");
  EXPECT_EQ(file_unit_of("range_emitter_1_m", {2}).unit, "m");
  EXPECT_EQ(file_unit_of("range_incidence", {2}).unit, "1");
}

// Of one parameter that is not held alike: a squared normal value, which is beyond 1.96 sigmas with
// a probability of 5 %.
TEST_F(CompareResults, TestsWhetherTheUnitChanged) {
  const std::string a = saved("a", result("A1"));
  const ResultComparison same = compare_results(a, a);
  EXPECT_EQ(same.change.chi2, 0);
  EXPECT_EQ(same.change.degrees_of_freedom, 1);
  EXPECT_EQ(same.change.p_value, 1);
  sensors::Sensor moved = result("A1");
  moved.set(kTilt, moved.get(kTilt) + 1.959964 * std::sqrt(2.0) * kSigma);
  const ResultComparison apart = compare_results(a, saved("b", moved));
  EXPECT_NEAR(apart.change.chi2, 3.841459, 1e-5);
  EXPECT_NEAR(apart.change.p_value, 0.05, 1e-6);
  EXPECT_EQ(compare_results("mid-40", "mid-40").change.degrees_of_freedom, 0);
}

// An unknown turn of all beams does not hide a change of their shape, nor count as one.
TEST_F(CompareResults, WhatIsHardlyKnownHardlyCounts) {
  sensors::Sensor one = sensors::load_sensor("mid-40");
  constexpr const char* kOther = "incident_beam_horizontal_deg";
  constexpr double kUnknown = 1e-2;
  one.serial = "A1";
  one.covariance_names = {kTilt, kOther};
  one.covariance.resize(2, 2);
  const double common = kUnknown * kUnknown, own = kSigma * kSigma;
  one.covariance << common + own, common, common, common + own;
  for (const char* name : {kTilt, kOther}) one.set_knowledge({name, kUnknown, "calibrated"});
  sensors::Sensor turned = one, bent = one;
  for (const char* name : {kTilt, kOther}) turned.set(name, turned.get(name) + kUnknown);
  bent.set(kTilt, bent.get(kTilt) + 10 * kSigma);
  const std::string a = saved("a", one);
  EXPECT_GT(compare_results(a, saved("b", turned)).change.p_value, 0.5);
  EXPECT_LT(compare_results(a, saved("c", bent)).change.p_value, 1e-4);
}

TEST_F(CompareResults, OfASeriesEachIsComparedWithTheOneBeforeAndTheFirst) {
  sensors::Sensor moved = result("");
  moved.set(kTilt, moved.get(kTilt) + 20 * kSigma);
  CompareUnitsOptions options;
  options.results = {saved("a", result("")), saved("b", result("")), saved("c", moved)};
  const ComparedUnits series = compare_units(options);
  ASSERT_EQ(series.pairs.size(), 3U);
  EXPECT_DOUBLE_EQ(series.least_p_value, 0.01 / 3);
  const auto is = [&](std::size_t pair, std::size_t a, std::size_t b, bool changed) {
    const ComparedPair& one = series.pairs[pair];
    return one.a == a && one.b == b && one.changed == changed && one.comparison.held_alike &&
           !one.comparison.same_unit;
  };
  EXPECT_TRUE(is(0, 0, 1, false));
  EXPECT_TRUE(is(1, 1, 2, true));
  EXPECT_TRUE(is(2, 0, 2, true));
  options.results.resize(1);
  EXPECT_THROW(compare_units(options), InvalidArgument);
  options.results = {"mid-40", "mid-40"};
  options.false_alarm = 2;
  EXPECT_THROW(compare_units(options), InvalidArgument);
}

/// A table whose rows lead to results, as a fleet's.
std::string table_of(const std::filesystem::path& path,
                     const std::vector<std::vector<tables::TableCell>>& rows) {
  tables::TableFile table(
      path.string(),
      {{"input"}, {"output"}, {"exit_status", tables::CellKind::integer}, {"message"}}, {});
  for (const auto& row : rows) table.add(row);
  table.close();
  return path.string();
}

TEST_F(CompareResults, OfATableFollowsItsRows) {
  sensors::Sensor moved = result("A1");
  moved.set(kTilt, moved.get(kTilt) + 20 * kSigma);
  saved("a1/may", result("A1"));
  saved("b2/may", result("B2"));
  saved("a1/june", moved);
  std::filesystem::create_directories(folder_.path() / "b2/july");
  std::filesystem::create_directories(folder_.path() / "c3");
  io::write_text_file((folder_.path() / "c3/calibration.yaml").string(), "model: {");
  const std::int64_t done = 0, failed = 3;
  for (const char* name : {"table.csv", "table.nc"}) {
    SCOPED_TRACE(name);
    const std::string table =
        table_of(folder_.path() / name, {{"a/may.lvx", "a1/may", done, {}},
                                         {"b/may.lvx", "b2/may", done, {}},
                                         {"a/june.lvx", "a1/june", done, {}},
                                         {"b/june.lvx", {}, failed, "is cut off"},
                                         {"b/july.lvx", "b2/july", done, {}},
                                         {"c/may.lvx", "c3", done, {}},
                                         {"c/june.lvx", {}, done, {}}});
    const ComparedUnits found = compare_units({{table}, 0.01});
    ASSERT_EQ(found.results.size(), 3U);
    ASSERT_EQ(found.units.size(), 2U);
    EXPECT_EQ(found.units[0].serial, "A1");
    EXPECT_THAT(found.units[0].results, ::testing::ElementsAre(0, 2));
    EXPECT_TRUE(found.units[0].changed);
    EXPECT_FALSE(found.units[1].changed);
    ASSERT_EQ(found.pairs.size(), 2U);  // A1 over time, and A1 with B2
    EXPECT_TRUE(found.pairs[0].comparison.same_unit);
    EXPECT_TRUE(found.pairs[0].changed);
    EXPECT_EQ(found.pairs[1].a, 1U);
    EXPECT_EQ(found.pairs[1].b, 2U);
    EXPECT_FALSE(found.pairs[1].comparison.same_unit);
    EXPECT_TRUE(found.fleets.empty());
    ASSERT_EQ(found.left_out.size(), 4U);
    const auto is = [&](std::size_t i, const char* input, bool is_failure, const char* reason) {
      EXPECT_EQ(found.left_out[i].name, input);
      EXPECT_EQ(found.left_out[i].failed, is_failure) << input;
      EXPECT_THAT(found.left_out[i].reason, HasSubstr(reason));
    };
    is(0, "b/june.lvx", false, "is cut off");
    is(1, "b/july.lvx", false, "has no calibration.yaml");
    is(2, "c/may.lvx", true, "calibration.yaml");
    is(3, "c/june.lvx", true, "names no output");
  }
}

TEST_F(CompareResults, OfATableWithoutResultsSaysWhy) {
  const std::int64_t done = 0;
  const std::string table = table_of(folder_.path() / "t.csv", {{"a.lvx", "nowhere", done, {}}});
  try {
    compare_units({{table}, 0.01});
    FAIL();
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), ::testing::AllOf(NamesField("1 rows"), HasSubstr("nowhere")));
  }
}

TEST_F(CompareResults, OfManyUnitsEachStandsBesideTheOthers) {
  std::vector<std::vector<tables::TableCell>> rows;
  CompareUnitsOptions named;
  const auto add = [&](const std::string& name, const sensors::Sensor& sensor) {
    named.results.push_back(saved(name, sensor));
    rows.push_back({name + ".lvx", name, std::int64_t{0}, {}});
  };
  for (int unit = 0; unit < 6; ++unit) {
    const std::string serial = "U" + std::to_string(unit);
    sensors::Sensor one = result(serial);
    add(serial + "/may", one);
    if (unit == 4) one.set(kTilt, one.get(kTilt) + 1000 * kSigma);
    add(serial + "/june", one);
  }
  add("unknown", result(""));
  const CompareUnitsOptions options{{table_of(folder_.path() / "t.csv", rows)}, 0.01};
  std::vector<double> reported;
  const ComparedUnits found =
      compare_units(options, Progress([&](double fraction) { reported.push_back(fraction); }));
  EXPECT_EQ(found.units.size(), 6U);
  EXPECT_EQ(found.pairs.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(found.units[i].changed, i == 4) << i;
  ASSERT_EQ(found.fleets.size(), 1U);
  const ComparedFleet& fleet = found.fleets.front();
  ASSERT_EQ(fleet.units.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(fleet.fleet.units[i].outlier, i == 4) << i;
  ASSERT_EQ(found.left_out.size(), 1U);
  EXPECT_THAT(found.left_out[0].reason, NamesField("6 units"));
  EXPECT_EQ(reported.back(), 1);

  // The same by their names, in order of time.
  const ComparedUnits series = compare_units(named);
  EXPECT_EQ(series.pairs.size(), 23U);
  EXPECT_TRUE(series.left_out.empty());
  EXPECT_EQ(series.units.size(), 7U);

  CancelFlag flag;
  flag.set();
  EXPECT_THROW(compare_units(options, Progress([](double) {}, &flag)), Cancelled);
}

TEST_F(CompareResults, IsOfSensorsOfOneKind) {
  try {
    compare_results("mid-40", "horizon");
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), NamesField("2 prisms (PA-AP) and 1 emitters"));
  }
  // Six emitters, three prisms: all of it at once.
  EXPECT_EQ(compare_results("horizon", "horizon").beams.errors.total, 0);
}

TEST_F(CompareResults, SaysWhatIsMissing) {
  try {
    compare_results(folder_.path().string(), "mid-40");
    FAIL();
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), NamesField("calibration.yaml"));
  }
}

TEST_F(CompareResults, ATableOpensNothingOutsideOfItsFolder) {
  const std::int64_t done = 0;
  std::filesystem::create_directories(folder_.path() / "below");
  saved("a", result("A1"));
  saved("b", result("B2"));
  std::filesystem::create_symlink(folder_.path() / "b", folder_.path() / "below/b");
  const std::string table = table_of(folder_.path() / "below/table.csv",
                                     {{"a.lvx", (folder_.path() / "a").string(), done, {}},
                                      {"b.lvx", "b", done, {}},
                                      {"zero", "/dev/zero", done, {}}});
  EXPECT_THROW(compare_units({{table}, 0.01}), FileError);
  const ComparedUnits found = compare_units({{table}, 0.01, true});
  EXPECT_EQ(found.results.size(), 2U);
  ASSERT_EQ(found.left_out.size(), 1U);
  EXPECT_EQ(found.left_out[0].name, "zero");
}

}  // namespace risley::jobs::compare_results_test
