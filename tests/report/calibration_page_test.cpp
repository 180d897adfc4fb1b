// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/core/random.hpp"
#include "risley/report/report_file.hpp"
#include "risley/sensors/preset.hpp"

#include "refusal.hpp"
#include "report/page_reading.hpp"

namespace risley::report::calibration_page_test {

using calibration::Calibration;
using testing::chart;
using testing::expect_sound;
using testing::GoldenPage;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::series;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kNoise = 0.015;  // of the distances, m

double deg(double degrees) { return radians_from_degrees(degrees); }

calibration::CalibratedPlane wall(const std::string& name, std::size_t recording, double azimuth,
                                  double zenith, double distance) {
  calibration::CalibratedPlane plane;
  plane.name = name;
  plane.recording = recording;
  plane.normal = direction_from_angles<double>({deg(azimuth), deg(zenith)});
  plane.distance = distance;
  plane.points = 20000;
  plane.outliers = 7;
  plane.rms = 0.0151;
  plane.rms_before = 0.0214;
  plane.range_sigma = 0.0149;
  return plane;
}

calibration::ThicknessProfile profile(const std::string& variable, double from, double to,
                                      std::size_t bins) {
  calibration::ThicknessProfile result;
  result.variable = variable;
  for (std::size_t i = 0; i < bins; ++i) {
    const double width = (to - from) / double(bins), left = from + double(i) * width;
    result.from.push_back(left);
    result.to.push_back(left + width);
    const bool empty = i == 2;
    result.count.push_back(empty ? 0 : 1000 + i);
    result.mean_before.push_back(empty ? kNaN : 0.01 * std::sin(2 * left));
    result.mean_after.push_back(empty ? kNaN : 0.0005 * std::sin(5 * left));
    result.rms_before.push_back(empty ? kNaN : std::hypot(kNoise, result.mean_before.back()));
    result.rms_after.push_back(empty ? kNaN : kNoise);
  }
  return result;
}

/// Shots of a rosette on the nearest plane of their recording; one in 20 hits none.
std::vector<jobs::SamplePoint> sample_on(const std::vector<calibration::CalibratedPlane>& planes,
                                         std::size_t recordings, std::size_t points) {
  const RandomStream noise(1, 0);
  std::vector<jobs::SamplePoint> sample;
  for (std::size_t i = 0; i < points; ++i) {
    jobs::SamplePoint one;
    one.recording = i % recordings;
    const double turn = 0.0137 * double(i);
    one.azimuth = deg(19.2) * std::cos(turn) * std::cos(3.11 * turn);
    one.zenith = deg(90) + deg(19.2) * std::cos(turn) * std::sin(3.11 * turn);
    const Vector3<double> beam = direction_from_angles<double>({one.azimuth, one.zenith});
    double range = 100;
    for (std::size_t k = 0; k < planes.size(); ++k) {
      const double hit = planes[k].distance / dot(planes[k].normal, beam);
      if (planes[k].recording != one.recording || !(hit > 0) || hit >= range) continue;
      range = hit;
      one.plane = static_cast<int>(k);
    }
    one.after = kNoise * noise.normal(2 * i);
    one.before = one.after + 0.01 * std::sin(4 * one.azimuth / deg(19.2));
    if (i % 20 == 0) {
      one.plane = -1;
      one.before = one.after = kNaN;
      range *= 0.3 + 0.7 * noise.uniform(2 * i + 1);
    }
    one.point = range * beam;
    one.off = {0, deg(0.2), deg(-0.1) * one.azimuth};
    sample.push_back(one);
  }
  return sample;
}

/// A calibration as two recordings of rooms would give it.
Calibration example() {
  Calibration c;
  c.converged = true;
  c.sensor = sensors::load_sensor("mid-40");
  c.sensor.serial = "1PQD&7";
  c.believed = c.sensor.train;
  c.free = estimation::free_parameters(estimation::default_free_names({2}), {2});
  const auto n = static_cast<Eigen::Index>(c.free.size());
  c.parameters.resize(n);
  c.covariance = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::string& name = c.free[static_cast<std::size_t>(i)].name;
    c.parameters[i] = c.sensor.get(name) + deg(0.013) * double(i + 1);
    for (Eigen::Index j = 0; j < n; ++j) {
      c.covariance(i, j) = std::pow(-0.7, std::abs(i - j)) * deg(0.002) * deg(0.002);
    }
  }
  c.numbers = {{"range_offset_m", -0.0123, 0.0, 0.05, 0.0021, 0.0021}};
  c.planes = {wall("front <wall> & door", 0, 5, 92, 8.0), wall("left", 0, 70, 90, 3.0),
              wall("floor", 0, 0, 178, 1.2), wall("hall", 1, -55, 88, 6.0)};
  c.steps.push_back({0, 0, -0.0213, deg(3.2), deg(91.5), deg(2.5), 341});
  c.datum_kind = calibration::DatumKind::none;
  c.datum = {deg(0.0041), deg(0.0123), deg(0.0098), deg(0.0157), deg(0.0032), deg(0.016)};
  c.datum_without_common = {deg(0.002), deg(0.01), deg(0.008), deg(0.013), deg(0.0021), deg(0.013)};
  c.prior_tests = {{"flipped <180>", true, deg(0.02), 4.5, 3, 21.1},
                   {"ceiling", false, deg(0.4), 80.5, 2, 18.4},
                   {"untested wall", false, kNaN, kNaN, 2, 18.4},
                   {"unseen", true, 0, 0, 0, 0}};
  c.pointing_error = {{deg(0.07), deg(0.35), 0, 0, deg(0.3571), deg(0.3502), deg(0.0231), {}},
                      deg(0.0016),
                      deg(0.0017),
                      deg(0.00031),
                      deg(0.0015),
                      deg(0.0512),
                      deg(0.0006)};
  c.verdict = {calibration::CalibrationCode::as_believed, "walls <confirm> the belief", "nothing"};
  c.sigma0 = 0.98;
  c.shape = {0.0014, 2.1, 0.0005};
  c.iterations = 6;
  c.rms_before = 0.0214;
  c.rms_after = 0.0151;
  c.points = 80000;
  c.profiles = {profile("incidence", 0, deg(80), 16), profile("rotation_angle_a", -kPi, kPi, 36),
                profile("rotation_angle_b", -kPi, kPi, 36)};
  return c;
}

jobs::ReadRecording recording(const std::string& path, std::uint64_t observations) {
  jobs::ReadRecording read;
  read.path = path;
  read.header.format = "lvx-1.1";
  read.header.devices.emplace_back();
  read.header.devices.front().serial = "1PQD&7";
  read.audit.observations = observations;
  return read;
}

/// What the page is made of, with everything that belongs to it.
struct Page {
  sensors::Sensor nominal = sensors::load_sensor("mid-40");
  Calibration calibration = example();
  std::vector<jobs::SamplePoint> sample;
  std::optional<jobs::BeamComparison> truth;
  std::vector<Warning> warnings;

  explicit Page(std::size_t points = 2000) : sample(sample_on(calibration.planes, 2, points)) {}

  Report report() const {
    jobs::CalibratedRecordings found;
    found.recordings = {recording("folder/room <1>.lvx", 60000), recording("hall.lvx", 40000)};
    found.choice.sensor = found.nominal = nominal;
    found.choice.words = "the file says so";
    found.calibration = calibration;
    found.truth = truth;
    found.details = jobs::calibration_details(calibration, found.recordings.size(), sample, truth);
    found.provenance = {{"command", "risley calibrate \"room <1>.lvx\" hall.lvx"},
                        {"version", "0.1.0"}};
    found.warnings = warnings;
    return report_of(found);
  }
  std::string html() const { return report_page(report()); }
};

jobs::BeamComparison example_truth() {
  jobs::BeamComparison truth;
  truth.before = {deg(0.10), deg(0.11), deg(0.05), deg(-0.06),
                  deg(0.15), deg(0.12), deg(0.09), {deg(0.01), deg(0.06), deg(-0.05)}};
  truth.after = {deg(0.01),   deg(0.012), deg(0.005),  deg(-0.006),
                 deg(0.0156), deg(0.015), deg(0.0043), {deg(0.001), deg(0.006), deg(-0.005)}};
  truth.truth = sensors::load_sensor("mid-40");
  for (int i = 0; i < 1000; ++i) {
    truth.azimuth_before.push_back(deg(0.05 + 0.01 * std::sin(i)));
    truth.zenith_before.push_back(deg(-0.06 + 0.01 * std::cos(i)));
    truth.azimuth_after.push_back(deg(0.005 + 0.001 * std::sin(i)));
    truth.zenith_after.push_back(deg(-0.006 + 0.001 * std::cos(i)));
  }
  return truth;
}

TEST(CalibrationPage, MatchesItsGoldenText) {
  Page whole(20000);
  whole.truth = example_truth();
  GoldenPage golden("calibration", whole.html());
  const auto differs = [&](const std::string& when, const std::function<void(Page&)>& change) {
    Page page = whole;
    change(page);
    golden.differs(when, page.html());
  };
  const auto verdict = [&](calibration::CalibrationCode code) {
    return [=](Page& page) {
      page.calibration.verdict = {code, "directions are off", "use the calibration"};
    };
  };
  differs("no truth", [](Page& page) { page.truth.reset(); });
  differs("bent", verdict(calibration::CalibrationCode::bent));
  differs("not better", verdict(calibration::CalibrationCode::not_better));
  differs("within the tolerance", verdict(calibration::CalibrationCode::off_within_tolerance));
  differs("warnings", [](Page& page) {
    page.calibration.warnings = {{kWarning.uneven_plane, "the walls are uneven"}};
    page.warnings = {{kWarning.shots_lost, "a gap of 2 s", {{}, 3}}};
  });
  differs("a datum that is good enough", [](Page& page) {
    page.calibration.datum.sigma_pitch = deg(0.03);
    page.calibration.datum.sigma_yaw = deg(0.039);
  });
  differs("a poor datum", [](Page& page) {
    page.calibration.datum.sigma_pitch = deg(0.03);
    page.calibration.datum.sigma_yaw = deg(0.041);
  });
  differs("an unknown datum", [](Page& page) { page.calibration.datum.sigma_yaw = kNaN; });
  differs("a single parameter", [](Page& page) {
    Calibration& c = page.calibration;
    c.free = estimation::free_parameters({"prism_tilt_a_vertical_deg"}, {2});
    c.parameters = Eigen::VectorXd::Constant(1, deg(0.3));
    c.covariance = Eigen::MatrixXd::Constant(1, 1, deg(0.02) * deg(0.02));
    c.believed.set("prism_tilt_a_vertical_deg", deg(0.11));
    page.truth->truth.set("prism_tilt_a_vertical_deg", deg(0.22));
  });
  differs("held ranges", [](Page& page) { page.calibration.numbers.clear(); });
  differs("a failure", [](Page& page) {
    page.calibration = Calibration();
    page.sample.clear();
    page.calibration.sensor = sensors::load_sensor("mid-40");
    page.calibration.believed = page.calibration.sensor.train;
    page.calibration.reason = "the walls do not determine pitch & yaw";
    page.calibration.warnings = {{kWarning.poor_datum, "a single wall"}};
    page.calibration.rms_after = kNaN;
    page.calibration.datum.sigma_pitch = std::numeric_limits<double>::infinity();
    page.calibration.unobservable = {
        {{{"prism_tilt_a_vertical_deg", 0.8}, {"incident_beam_vertical_deg", -0.6}}, 1e-9, 40}};
    page.truth->before.azimuth_rmse = kNaN;
  });
}

TEST(CalibrationPage, TheMapsMeanIsWhatItsBeamsAreOffBy) {
  const auto map = chart(Page().html(), "Error of reported directions over the field of view");
  for (const auto& value : map.at("series")[0].at("value")) {
    EXPECT_NEAR(value.get<double>(), 0.2, 0.01);
  }
}

TEST(CalibrationPage, EscapesNames) {
  Page page;
  page.warnings = {{kWarning.shots_lost, "<script>alert(1)</script>"}};
  const std::string html = page.html();
  expect_sound(html);
  EXPECT_THAT(html, HasSubstr("<title>risley calibrate: room &lt;1&gt;.lvx and 1 more</title>"));
  EXPECT_THAT(html, Not(HasSubstr("<wall>")));
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
}

TEST(CalibrationPage, NumbersThatAreNotFiniteAreDashes) {
  Page page;
  Calibration& c = page.calibration;
  page.truth = example_truth();
  c.planes[1].rms_before = c.planes[1].distance = kNaN;
  c.parameters[2] = kNaN;
  c.covariance(3, 3) = kNaN;
  c.covariance(4, 4) = -1.0;
  c.numbers.front().value = kNaN;
  c.shape.sigma = std::numeric_limits<double>::infinity();
  c.steps[0].height = kNaN;
  auto& sample = page.sample;
  sample[1].azimuth = sample[2].point.x = sample[3].after = sample[4].before = kNaN;
  c.profiles[0].from[1] = kNaN;
  c.profiles[1].rms_before.assign(36, kNaN);
  expect_sound(page.html());
}

TEST(CalibrationPage, RotationAnglesRunFromZeroToAFullTurn) {
  const auto drawn = chart(Page().html(), "Thickness over the rotation angle of prism A");
  EXPECT_EQ(drawn.at("kind"), "full_turn");
  const auto after = series(drawn, "RMS after");
  const auto x = after.at("x").get<std::vector<double>>();
  EXPECT_TRUE(std::is_sorted(x.begin(), x.end()));
  EXPECT_NEAR(x.front(), 5, 1e-4);
  EXPECT_NEAR(x.back(), 355, 1e-4);
  // The bin from -160 to -150 degrees is empty.
  EXPECT_NEAR(x[20], 205, 1e-4);
  EXPECT_TRUE(after.at("y").at(20).is_null());
  EXPECT_NEAR(after.at("y").at(0), 1000 * kNoise, 1e-3);
}

TEST(CalibrationPage, TheHistogramCountsEverySamplePointOnAPlane) {
  const std::string html = Page().html();
  const auto drawn = chart(html, "Histogram of the distances from the planes");
  for (const char* label : {"before", "after"}) {
    double sum = 0;
    const auto counts = series(drawn, label).at("y");
    for (const auto& count : counts) sum += count.get<double>();
    EXPECT_EQ(sum, 1900);
  }
  EXPECT_EQ(series(drawn, "before").at("x"), series(drawn, "after").at("x"));
}

TEST(CalibrationPage, CellMeansShowAPlaneThatIsBent) {
  Page page(20000);
  for (auto& point : page.sample) {
    if (point.plane >= 0) point.after = point.azimuth > 0 ? 0.001 : -0.001;
  }
  const std::string html = page.html();
  const auto drawn = chart(html, "Mean distance from the planes over the field of view, after");
  EXPECT_EQ(drawn.at("kind"), "map");
  EXPECT_EQ(drawn.at("palette"), "diverging");
  const auto& cells = drawn.at("series").at(0);
  EXPECT_EQ(cells.at("kind"), "cells");
  ASSERT_GT(cells.at("x").size(), 100u);
  for (std::size_t i = 0; i < cells.at("x").size(); ++i) {
    EXPECT_NEAR(cells.at("value").at(i), cells.at("x").at(i) > 0 ? 1.0 : -1.0, 1e-6);
  }
  // Both pictures have the same colours, or they could not be compared.
  const auto before = chart(html, "Mean distance from the planes over the field of view, before");
  EXPECT_EQ(before.at("value_range"), drawn.at("value_range"));
}

TEST(CalibrationPage, WallsInSpaceStandOffTheirPlanesByTheirEnlargedMeans) {
  Page page(20000);
  Calibration& c = page.calibration;
  c.planes = {wall("front", 0, 0, 90, 8.0)};
  page.sample = sample_on(c.planes, 1, 20000);
  for (auto& point : page.sample) {
    if (point.plane < 0) continue;
    point.after = 0;
    point.point = (8.0 / point.point.x) * point.point;
    point.before = 0.004;
  }
  const std::string html = page.html();
  const auto before = chart(html, "Walls before the calibration: room <1>.lvx");
  const auto after = chart(html, "Walls after the calibration: room <1>.lvx");
  EXPECT_EQ(before.at("kind"), "space");
  const auto& lifted = before.at("series").at(0);
  ASSERT_GT(lifted.at("x").size(), 100u);
  for (std::size_t i = 0; i < lifted.at("x").size(); ++i) {
    // 4 mm on a wall 8 m away: a power of ten below 0.03 * 9 m / 4 mm is 10.
    EXPECT_NEAR(lifted.at("x").at(i), 8.04, 1e-5);
    EXPECT_NEAR(after.at("series").at(0).at("x").at(i), 8.0, 1e-5);
    EXPECT_NEAR(lifted.at("value").at(i), 4.0, 1e-5);
  }
}

TEST(CalibrationPage, ErrorsOfBeamsWithKnownTruthAreCountedBeforeAndAfter) {
  Page page;
  page.truth = example_truth();
  const std::string html = page.html();
  for (const char* title : {"Errors of the azimuth before", "Errors of the zenith angle after"}) {
    const auto drawn = chart(html, title);
    double sum = 0;
    const auto counts = series(drawn, "errors").at("y");
    for (const auto& count : counts) sum += count.get<double>();
    EXPECT_EQ(sum, 1000) << title;
  }
}

TEST(CalibrationPage, ViewsAreThinnedAndSayHow) {
  Page page(20000);
  const std::string html = page.html();
  const auto drawn = chart(html, "From above: room <1>.lvx");
  std::size_t points = 0;
  for (const auto& one : drawn.at("series")) points += one.at("x").size();
  EXPECT_LE(points, 4001u);
  EXPECT_EQ(series(drawn, "no plane").at("colour"), "ink");
  EXPECT_EQ(series(drawn, "front <wall> & door").at("colour"), "a");
  EXPECT_EQ(series(drawn, "sensor").at("x").at(0), 0);
  // Every point of the floor, which rises by 2 degrees, stands where it is below the sensor.
  const auto floor = series(chart(html, "From the side: room <1>.lvx"), "floor");
  ASSERT_GT(floor.at("x").size(), 10u);
  for (std::size_t i = 0; i < floor.at("x").size(); ++i) {
    const auto x = floor.at("x")[i].get<double>(), above = floor.at("y")[i].get<double>();
    EXPECT_NEAR(above, -(1.2 - std::sin(deg(2)) * x) / std::cos(deg(2)), 1e-5);
  }
}

/// What reading a file of this text says; nothing where it is taken.
std::string error_of(const std::string& text) {
  try {
    report_page(parse_report(text, "folder/report.json"));
  } catch (const FileError& found) {
    EXPECT_EQ(found.path(), "folder/report.json");
    return found.what();
  }
  return "";
}

TEST(ReportFile, AReportComesBackAsItWas) {
  Page page;
  page.truth = example_truth();
  page.calibration.planes[1].rms = kNaN;
  const Report report = page.report();
  const Report again = parse_report(report_text(report), "report.json");
  EXPECT_EQ(report_page(again), report_page(report));
  EXPECT_EQ(report_text(again), report_text(report));
  EXPECT_EQ(verb_of(again), "calibrate");
  // What --json prints, in the same units.
  EXPECT_NEAR(again.json["pointing_error"]["total_deg"]["value"].get<double>(), 0.3571, 1e-12);
  EXPECT_TRUE(again.json["planes"][1]["rms_m"].is_null());
}

TEST(ReportFile, WhatIsNoReportIsRefused) {
  const std::string text = report_text(Page().report());
  EXPECT_THAT(error_of(text.substr(0, text.size() / 2)), NamesField("byte"));
  EXPECT_THAT(error_of("[1, 2]"), NamesField("array"));
  EXPECT_THAT(error_of("{\"format\": \"a dog\"}"), NamesField("format_version"));
  EXPECT_THAT(error_of("{\"format\": \"risley report\", \"format_version\": 1}"),
              NamesField("format_version"));
  EXPECT_THAT(error_of("{\"format\": 1e999}"), NamesField("JSON"));
}

TEST(ReportFile, WhatIsMissingOrWrongIsNamed) {
  Page page;
  page.truth = example_truth();
  const json::Json sound = page.report().json;
  const json::Json cell_chart = sound["charts"]["pointing"][0];
  ASSERT_EQ(cell_chart["series"][0]["kind"], "cells");
  for (const auto& [place, value, named] :
       std::vector<std::tuple<std::string, json::Json, std::string>>{
           {"/verb", "dog", "verb"},
           {"/points", -17, "found -17"},
           {"/points", 1.5, "found 1.5"},
           {"/points", "many", "points"},
           {"/converged", false, "reason"},
           {"/page/prisms", 99, "page.prisms: expected 4"},
           {"/page/emitters", -1, "page.emitters"},
           {"/page/recordings/0/format", 7, "page.recordings[0].format"},
           {"/planes/0/normal", {1, 2}, "planes[0].normal: 2"},
           {"/datum/sigma_yaw_deg", -1, "datum.sigma_yaw_deg"},
           {"/provenance/0", {"command"}, "provenance[0]: 1"},
           {"/charts/pointing/0/kind", "clouds", "charts.pointing[0].kind"},
           {"/charts/pointing/0/kind", "space", "series[0].z: 0"},
           {"/charts/pointing/0/value_range", {1}, "value_range: 1"},
           {"/charts/pointing/0/grows_for", -1, "grows_for: expected 0"},
           {"/charts/pointing/0/series/0/colour", "x", "series[0].colour"},
           {"/charts/pointing/0/series/0/y", {1}, "series[0].y: 1"},
           {"/charts/pointing/0/series/0/value", json::Json::array(), "series[0].value: 0"},
           {"/charts/pointing/0/series/0/cell_width", -1, "cell_width"}}) {
    json::Json damaged = sound;
    damaged[json::Json::json_pointer(place)] = value;
    EXPECT_THAT(error_of(damaged.dump()), NamesField(named)) << place;
  }
}

/// Every key of objects that is not one of many names.
void collect(const json::Json& value, const std::string& place, std::vector<std::string>& places) {
  if (value.is_array() && !value.empty()) collect(value.front(), place + "/0", places);
  if (!value.is_object()) return;
  for (const auto& [name, one] : value.items()) {
    const std::string inside = place + "/" + name;
    places.push_back(inside);
    collect(one, inside, places);
  }
}

TEST(ReportFile, NothingThatIsMissingOrOfAnotherKindIsAFault) {
  Page page(50);
  page.truth = example_truth();
  json::Json sound = page.report().json;
  for (json::Json& charts : sound["charts"]) {
    if (charts.size() > 1) charts = json::Json::array({charts.front()});
  }
  std::vector<std::string> places;
  collect(sound, "", places);
  EXPECT_GT(places.size(), 200u);
  for (const std::string& place : places) {
    const json::Json::json_pointer pointer(place);
    for (const json::Json& value :
         {json::Json(), json::Json("x"), json::Json(1e300), json::Json::array({1, "x"})}) {
      json::Json damaged = sound;
      damaged[pointer] = value;
      error_of(damaged.dump());
    }
    json::Json cut = sound;
    cut[pointer.parent_pointer()].erase(pointer.back());
    error_of(cut.dump());
  }
}

}  // namespace risley::report::calibration_page_test
