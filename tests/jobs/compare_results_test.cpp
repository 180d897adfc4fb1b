// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/compare_results.hpp"

#include <cmath>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/compare_series.hpp"
#include "risley/sensors/preset.hpp"

namespace risley::jobs::compare_results_test {

using ::testing::HasSubstr;

constexpr const char* kTilt = "incident_beam_vertical_deg";
constexpr const char* kWedge = "wedge_angle_deg";
constexpr double kSigma = 1e-5, kHeldSigma = 1e-3, kResponse = 0.5;  // rad, rad, 1

class CompareResults : public ::testing::Test {
 protected:
  CompareResults()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ("compare_results_" +
                 std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~CompareResults() override { std::filesystem::remove_all(folder_); }

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
    const std::filesystem::path folder = folder_ / name;
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

  std::filesystem::path folder_;
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
  EXPECT_FALSE(other.held_alike);
  EXPECT_NEAR(row(other, kTilt).sigma, std::sqrt(2.0) * all, 1e-6 * all);
  EXPECT_NEAR(row(other, kWedge).sigma, std::sqrt(2.0) * kHeldSigma, 1e-9);

  sensors::Sensor held_elsewhere = result("A1");
  held_elsewhere.set(kWedge, held_elsewhere.get(kWedge) + 1e-4);
  const ResultComparison elsewhere = compare_results(a, saved("d", held_elsewhere));
  EXPECT_TRUE(elsewhere.same_unit);
  EXPECT_FALSE(elsewhere.held_alike);
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

// A turn of all beams that nobody knows does not hide a change of their shape, nor count as one.
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
  CompareSeriesOptions options;
  options.results = {saved("a", result("")), saved("b", result("")), saved("c", moved)};
  const ComparedSeries series = compare_series(options);
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
  EXPECT_THROW(compare_series(options), InvalidArgument);
  options.results = {"mid-40", "mid-40"};
  options.false_alarm = 2;
  EXPECT_THROW(compare_series(options), InvalidArgument);
}

TEST_F(CompareResults, IsOfSensorsOfOneKind) {
  try {
    compare_results("mid-40", "horizon");
    FAIL();
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), HasSubstr("the first has 2 prisms (PA-AP) and 1 emitters"));
  }
  // Six emitters, three prisms: all of it at once.
  EXPECT_EQ(compare_results("horizon", "horizon").beams.errors.total, 0);
}

TEST_F(CompareResults, SaysWhatIsMissing) {
  try {
    compare_results(folder_.string(), "mid-40");
    FAIL();
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("calibration.yaml"));
    EXPECT_THAT(error.what(), HasSubstr("is missing"));
  }
}

}  // namespace risley::jobs::compare_results_test
