// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/report_file.hpp"

#include <cmath>
#include <fstream>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"

#include "io/test_folder.hpp"

namespace risley::report::report_file_test {

using ::testing::HasSubstr;

/// Every field with a value that tells it from the others.
EstimateReport estimate_example() {
  EstimateReport r;
  r.recording = {"a <b>.lvx", "lvx-1.1", "PPS", {}};
  r.recording.audit.observations = 3000000;
  r.recording.audit.shots = 2999999;
  r.recording.audit.first_time_ns = -1234567890123456789;
  r.recording.audit.duration_s = 30.25;
  r.recording.audit.gaps = {2, 0.5, 0.375, 99, 1234};
  r.recording.audit.azimuth = recordings::ValueRange{-0.33, 0.34};
  r.sensor = "mid-40";
  r.prisms = 2;
  r.combination = 2;
  r.mirrored = true;
  r.method = "map";
  r.converged = true;
  r.warnings = {"one", "two \"quoted\""};
  r.shots = 2999999;
  r.outliers = 17;
  r.parameters = {
      {"refractive_index", 1.5090001, 2.1e-7, 1.9e-7, 1.51, kUnknown, 1.509, 1e-7, 0.48},
      {"rotation_angle_a_deg", 0.1, 1e-5, 1e-5, kUnknown, kUnknown, kUnknown, kUnknown, kUnknown}};
  r.free = {"refractive_index", "wedge_angle_deg"};
  r.covariance.resize(2, 2);
  r.covariance << 4.41e-14, 1e-15, 1e-15, 9e-12;
  r.unobservable = {{{{"refractive_index", 0.71}, {"wedge_angle_deg", -0.7}}, 1e-6, 0.9}};
  r.advice = {"hold the wedge angle"};
  r.azimuth_residuals = {2999982, 1e-9, 8.6e-5, 8.6e-5, 0.01, -0.14};
  r.zenith_residuals = {2999982, 2e-9, 8.7e-5, 8.7e-5, 0.02, -0.15};
  r.expected_residual = 8.6e-5;
  r.variance = {1.01, 1.02, 1.03};
  r.unevenness = {0.9, 1.1};
  r.truth = {{5e-6, 6e-6}, 1.1, 0.9};
  r.pieces = {19, 1, 1.0, 1.05, 144};
  Chart map{"a map", "x", "y", {}, "thinned", ChartKind::map};
  map.series.push_back({"cells", "ink", SeriesKind::cells, {1, 2}, {3, kUnknown}, {}, {0.1, 0.2}});
  map.series.back().cell_width = 0.5;
  map.value_label = "mean";
  map.palette = Palette::diverging;
  map.value_range = {-0.2, 0.2};
  r.residual_charts = {map};
  r.rotor_charts = {{"a line", "t", "w", {{"", "a", SeriesKind::line, {0, 1}, {5, 6}}}, ""}};
  r.provenance = {{"command", "risley estimate 'a <b>.lvx'"}, {"seed", "7"}};
  return r;
}

CalibrationReport calibration_example() {
  CalibrationReport r;
  r.recordings = {{"hall.lvx", "lvx-1.1", "sensor", {}}};
  r.observations = 1000000;
  r.sensor = "mid-40";
  r.serial = "1PQD";
  r.preset = "mid-40";
  r.prisms = 2;
  r.method = calibration::CalibrationMethod::paper;
  r.reason = "two walls are not enough";
  r.points = 993551;
  r.parameters = {
      {"prism_tilt_a_vertical_deg", 0.0016, 1e-6, {}, 0, 0.001, kUnknown, kUnknown, kUnknown}};
  r.numbers = {{"range_offset_m", 0.012, 0.0, 0.05, 0.001, 0.001}};
  r.wall_shape = calibration::ShapeParameters{0.002, 1.4, 0.0005};
  r.free = {"prism_tilt_a_vertical_deg"};
  r.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-12);
  r.datum_kind = calibration::DatumKind::both;
  r.datum = {1, 2, 3, 4, 5, 6};
  r.datum_without_common = {6, 5, 4, 3, 2, 1};
  r.verdict = {"bent", "reported directions are off", "use it"};
  r.pointing_error = {{1, 2, 3, 4, 5, 6, 7, {8, 9, 10}}, 11, 12, 13, 20, 14, 15};
  r.prior_tests = {{"flipped", true, 0.01, 4.5, 3, 21.1}};
  calibration::CalibratedPlane plane;
  plane.name = "floor";
  plane.normal = {0, 0, -1};
  plane.distance = 1.5;
  plane.points = 361320;
  plane.rms = kUnknown;
  r.planes = {plane};
  r.steps = {{0, 0, -0.02, 0.1, 1.6, 0.05, 341}};
  r.rms_before = 0.011;
  r.rms_after = 0.0106;
  r.sigma0 = 0.999;
  r.truth = {{1, 2, 3, 4, 5, 6, 7, {8, 9, 10}}, {2, 3, 4, 5, 6, 7, 8, {9, 10, 11}}};
  Chart space{"walls",         "X", "Y", {{"", "a", SeriesKind::points, {1}, {2}, {3}, {4}}}, "",
              ChartKind::space};
  space.z_label = "Z";
  r.wall_charts = {space};
  r.pointing_charts = {{{"pointing", "x", "y", {}, "", ChartKind::map}}};
  return r;
}

class ReportFile : public ::testing::Test {
 protected:
  std::string path() const { return folder_.file("report.json"); }
  void write(const std::string& text) const { std::ofstream(path()) << text; }
  std::string error() const {
    try {
      read_report(path());
    } catch (const FileError& found) {
      return found.what();
    }
    return "no error";
  }
  io::TestFolder folder_;
};

TEST_F(ReportFile, AnEstimateComesBackAsItWas) {
  const Report report = estimate_example();
  write_report(path(), report);
  const Report again = read_report(path());
  ASSERT_TRUE(std::holds_alternative<EstimateReport>(again));
  EXPECT_EQ(report_page(again), report_page(report));
  const auto& r = std::get<EstimateReport>(again);
  EXPECT_EQ(r.recording.audit.first_time_ns, -1234567890123456789);
  EXPECT_EQ(r.recording.audit.gaps.largest_at_row, 1234u);
  ASSERT_TRUE(r.recording.audit.azimuth);
  EXPECT_EQ(r.recording.audit.azimuth->max, 0.34);
  EXPECT_FALSE(r.recording.audit.range);
  EXPECT_EQ(r.parameters[0].value, 1.5090001);
  EXPECT_TRUE(std::isnan(r.parameters[0].believed));
  EXPECT_EQ(r.covariance(1, 1), 9e-12);
  EXPECT_EQ(r.unobservable[0].weights[1].second, -0.7);
  EXPECT_EQ(r.pieces->failed, 1u);
  EXPECT_TRUE(std::isnan(r.residual_charts[0].series[0].y[1]));
  // Writing what was read gives the same bytes.
  const std::string first = io::read_text_file(path());
  write_report(path(), again);
  EXPECT_EQ(io::read_text_file(path()), first);
}

TEST_F(ReportFile, ACalibrationComesBackAsItWas) {
  const Report report = calibration_example();
  write_report(path(), report);
  const Report again = read_report(path());
  ASSERT_TRUE(std::holds_alternative<CalibrationReport>(again));
  EXPECT_EQ(report_page(again), report_page(report));
  const auto& r = std::get<CalibrationReport>(again);
  EXPECT_EQ(r.method, calibration::CalibrationMethod::paper);
  EXPECT_EQ(r.datum_kind, calibration::DatumKind::both);
  EXPECT_EQ(r.planes[0].normal.z, -1);
  EXPECT_TRUE(std::isnan(r.planes[0].rms));
  EXPECT_EQ(r.truth->after.rotation.y, 10);
  EXPECT_EQ(r.verdict->words, "reported directions are off");
  EXPECT_EQ(r.pointing_error->worst_shape, 14);
  EXPECT_EQ(r.wall_charts[0].series[0].z[0], 3);
  EXPECT_EQ(r.pointing_charts->at(0).title, "pointing");
  const std::string first = io::read_text_file(path());
  write_report(path(), again);
  EXPECT_EQ(io::read_text_file(path()), first);
}

TEST_F(ReportFile, DiagramsKeepTheDigitsThatCanBeSeen) {
  EstimateReport report = estimate_example();
  Series& line = report.rotor_charts[0].series[0];
  line.x = {1.0 / 3.0, -2.0 / 3.0};
  line.y = {-43789.81234567, -43789.81234568};  // a rotor that hardly changes its speed
  write_report(path(), report);
  const auto again = std::get<EstimateReport>(read_report(path()));
  EXPECT_EQ(again.rotor_charts[0].series[0].x, (std::vector<double>{0.3333333, -0.6666667}));
  EXPECT_EQ(again.rotor_charts[0].series[0].y, line.y);
}

TEST_F(ReportFile, ACutFileNamesTheByteWhereItBreaksOff) {
  write_report(path(), estimate_example());
  const std::string text = io::read_text_file(path());
  write(text.substr(0, text.size() / 2));
  EXPECT_THAT(error(), HasSubstr(path()));
  EXPECT_THAT(error(), HasSubstr("byte"));
}

TEST_F(ReportFile, EveryMissingFieldIsNamed) {
  write_report(path(), estimate_example());
  const std::string text = io::read_text_file(path());
  for (const char* field : {"recording", "converged", "parameters", "covariance", "provenance",
                            "residual_charts", "verb"}) {
    std::string cut = text;
    const std::string key = std::string("\"") + field + "\":";
    cut.replace(cut.find(key), key.size(), "\"other\":");
    write(cut);
    EXPECT_THAT(error(), HasSubstr(std::string(field) + " is missing"));
  }
}

TEST_F(ReportFile, AFieldOfAnotherKindIsNamedWithWhatWasFound) {
  write_report(path(), estimate_example());
  std::string text = io::read_text_file(path());
  text.replace(text.find("\"outliers\":17"), 13, "\"outliers\":\"many\"");
  write(text);
  EXPECT_THAT(error(), HasSubstr("outliers: expected a whole number, found string"));
  write_report(path(), estimate_example());
  text = io::read_text_file(path());
  const std::string kind = "\"kind\":\"cells\"";
  text.replace(text.find(kind), kind.size(), "\"kind\":\"clouds\"");
  write(text);
  EXPECT_THAT(error(), HasSubstr("residual_charts[0].series[0].kind: unknown name 'clouds'"));
}

TEST_F(ReportFile, SomethingElseIsRefused) {
  write("[1, 2]");
  EXPECT_THAT(error(), HasSubstr("expected an object, found array"));
  write("{\"format\": \"a dog\"}");
  EXPECT_THAT(error(), HasSubstr("expected 'risley report', found 'a dog'"));
  write("{\"format\": \"risley report\", \"format_version\": 99}");
  EXPECT_THAT(error(), HasSubstr("format_version: expected 1, found 99"));
}

TEST_F(ReportFile, WhatAPageCannotBeDrawnFromIsRefusedWithItsPlace) {
  // What is done to a sound report, and what the message says.
  const std::vector<std::pair<std::function<void(EstimateReport&)>, std::string>> cases = {
      {[](auto& r) { r.covariance = Eigen::MatrixXd::Ones(60, 60); }, "covariance: 60 rows"},
      {[](auto& r) { r.covariance = Eigen::MatrixXd::Ones(2, 3); }, "covariance: 2 rows of 3"},
      {[](auto& r) { r.covariance(1, 0) = kUnknown; }, "covariance[1]: expected finite numbers"},
      {[](auto& r) { r.covariance(0, 0) = -1; }, "covariance[0]"},
      {[](auto& r) { r.free[1] = "<b>"; }, "free[1]: "},
      {[](auto& r) { r.parameters[0].name = "colour"; }, "parameters[0].name: "},
      {[](auto& r) { r.parameters[0].sigma_given_held = 1; }, "[0].sigma_given_held: is larger"},
      {[](auto& r) { r.parameters[1].value = kUnknown; }, "parameters[1].value: expected a num"},
      {[](auto& r) { r.prisms = 99; }, "prisms"},
      {[](auto& r) { r.emitters = -1; }, "emitters"},
      {[](auto& r) { r.combination = 3; }, "combination: "},
      {[](auto& r) { r.method = "guess"; }, "unknown method 'guess'"},
      {[](auto& r) { r.unevenness.resize(5); }, "chi2_per_bin: 5 values, expected 2"},
      {[](auto& r) { r.truth->rotation_angle_rmse.resize(40); }, "truth.rotation_angle_rmse: 40"},
      {[](auto& r) { r.residual_charts[0].series[0].y.pop_back(); }, "series[0].y: 1 values"},
      {[](auto& r) { r.residual_charts[0].series[0].value.clear(); }, "series[0].value: 0 val"},
      {[](auto& r) { r.residual_charts[0].series[0].colour = "x"; }, "unknown colour 'x'"},
      {[](auto& r) { r.residual_charts[0].kind = ChartKind::space; }, "series[0].z: 0 values"},
      {[](auto& r) {
         r.residual_charts[0].value_range = {1, -1};
       },
       "value_range: "},
      {[](auto& r) { r.rotor_charts[0].grows_for = -1; }, "rotor_charts[0].grows_for: "},
  };
  for (const auto& [damage, words] : cases) {
    EstimateReport report = estimate_example();
    damage(report);
    write_report(path(), report);
    EXPECT_THAT(error(), HasSubstr(words));
    EXPECT_THAT(error(), HasSubstr(path()));
  }
  EstimateReport failed = estimate_example();  // has no numbers to promise
  failed.converged = false;
  failed.parameters[0].value = failed.covariance(0, 0) = kUnknown;
  write_report(path(), failed);
  EXPECT_EQ(error(), "no error");
  CalibrationReport calibration = calibration_example();
  calibration.wall_charts[0].series[0].z.clear();
  write_report(path(), calibration);
  EXPECT_THAT(error(), HasSubstr("wall_charts[0].series[0].z: 0 values, expected 1"));
}

TEST_F(ReportFile, NumbersThatDoNotFitAreRefused) {
  const std::pair<const char*, const char*> cases[] = {
      {"\"outliers\":-17", "outliers: -17 is out of range"},
      {"\"outliers\":1e999", "the JSON cannot be read"},
      {"\"outliers\":1.5", "outliers: expected a whole number"}};
  for (const auto& [damage, words] : cases) {
    write_report(path(), estimate_example());
    std::string text = io::read_text_file(path());
    text.replace(text.find("\"outliers\":17"), 13, damage);
    write(text);
    EXPECT_THAT(error(), HasSubstr(words));
  }
}

}  // namespace risley::report::report_file_test
