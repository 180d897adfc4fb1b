// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "risley/calibration/trajectory_knots.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/jobs/flight_details.hpp"
#include "risley/report/report_file.hpp"
#include "risley/sensors/preset.hpp"

#include "calibration/flights.hpp"
#include "refusal.hpp"
#include "report/page_reading.hpp"

namespace risley::report::flight_report_test {

using calibration::FlightCalibration;
using calibration::FlightUnknown;
using calibration::FlightUnknowns;
using testing::chart;
using testing::expect_sound;
using testing::GoldenPage;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::series;
using testing::visible;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kStrips = 4, kKnotsOfStrip = 9;

double deg(double degrees) { return radians_from_degrees(degrees); }

calibration::StripPair pair(std::uint16_t first, std::uint16_t second, double rms) {
  calibration::StripPair own;
  own.first = first;
  own.second = second;
  own.cells = 1000 + 10 * first + second;
  own.mean = -0.3 * rms;
  own.rms = rms;
  own.shift = {0.5 * rms, -0.4 * rms, 0.1 * rms};
  own.sigma = {0.02 * rms, 1.0, 0.01 * rms};  // the north is undetermined
  return own;
}

/// Knots every two seconds of strips that take 16 s, with turns between.
calibration::TrajectoryKnots knots() {
  calibration::TrajectoryKnots own;
  for (std::size_t s = 0; s < kStrips; ++s) {
    for (std::size_t k = 0; k < kKnotsOfStrip; ++k) {
      own.time_ns.push_back(1'300'000'000'000'000'000 +
                            static_cast<std::int64_t>(36 * s + 2 * k) * 1'000'000'000);
      own.strip.push_back(static_cast<std::uint16_t>(s));
      if (k == 0) continue;
      const std::size_t knot = own.time_ns.size() - 2;
      own.intervals.push_back({knot, own.time_ns[knot], own.time_ns[knot + 1], 0, 0});
    }
  }
  return own;
}

/// A calibration with distinct numbers.
FlightCalibration calibrated_example() {
  FlightCalibration c;
  c.converged = true;
  c.verdict = {calibration::CalibrationCode::as_believed, "strips confirm the belief", "nothing"};
  c.sensor = sensors::load_sensor("mid-40");
  c.sensor.serial = "1PQD&7";
  c.model.train = c.sensor.train;
  c.model.free =
      estimation::free_parameters({"prism_tilt_a_vertical_deg", "incident_beam_vertical_deg"}, {2});
  c.model.knots = knots();
  const auto columns = static_cast<Eigen::Index>(c.model.knots.size());
  c.model.corrections = Eigen::MatrixXd::Zero(calibration::kCorrections, columns);
  c.correction_sigma = Eigen::MatrixXd::Zero(calibration::kCorrections, columns);
  for (Eigen::Index row = 0; row < calibration::kCorrections; ++row) {
    const double size = row < 3 ? 0.001 : deg(0.001);
    for (Eigen::Index knot = 0; knot < columns; ++knot) {
      c.model.corrections(row, knot) = size * static_cast<double>(10 * (row + 1) + knot);
      c.correction_sigma(row, knot) = size * static_cast<double>(row + 1);
    }
  }
  const std::vector<std::string> names = calibration::unknown_names(c.model);
  const auto n = static_cast<Eigen::Index>(names.size());
  c.covariance = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    FlightUnknown own;
    own.name = names[static_cast<std::size_t>(i)];
    own.sigma = i < 3 || i >= FlightUnknowns::parameter(0) ? deg(0.002) : 0.0002;
    own.start = 0.01 * static_cast<double>(i);
    own.value = own.start + 10 * own.sigma;
    own.prior_sigma = 100 * own.sigma;
    own.prior_share = 1e-4;
    own.twin = names[static_cast<std::size_t>((i + 1) % n)];
    own.twin_correlation = -0.43;
    c.unknowns.push_back(own);
    for (Eigen::Index j = 0; j <= i; ++j) {
      c.covariance(i, j) = c.covariance(j, i) = std::pow(-0.7, static_cast<double>(i - j)) *
                                                own.sigma *
                                                c.unknowns[static_cast<std::size_t>(j)].sigma;
    }
  }
  c.unknowns[0].value = deg(6.0021);
  c.unknowns[5].held = true;
  c.unknowns[5].sigma = 0;
  c.unknowns[5].twin = "";
  c.covariance.row(5).setZero();
  c.covariance.col(5).setZero();
  c.unknowns[6].prior_sigma = kInfinity;
  c.unknowns[6].prior_share = 0;
  c.datum = {deg(0.0018), deg(0.0023), deg(0.0024), deg(0.0038), deg(0.0004), deg(0.0039), 80.2};
  c.not_told = {{"0.71 lever_arm_x_m - 0.70 clock_offset_s", 0.98},
                {"boresight_x_deg against the heading of the trajectory", 0.93}};
  for (std::uint16_t i = 0; i < kStrips; ++i) {
    for (std::uint16_t j = i + 1; j < kStrips; ++j) {
      c.pairs_before.push_back(pair(i, j, 0.3412));
      c.pairs_after.push_back(pair(i, j, 0.0054));
    }
  }
  c.rms_before = 0.3412;
  c.rms_after = 0.0054;
  c.sigma0 = 0.981;
  c.range_sigma = 0.0196;
  c.shots = 200000;
  c.without_pose = 1234;
  c.used = 190000;
  c.outliers = 777;
  c.cells = 1525;
  c.rough_cells = 31;
  for (std::size_t i = 0; i + 1 < c.model.knots.size(); ++i) {
    if (c.model.knots.strip[i] != c.model.knots.strip[i + 1]) continue;
    c.piece_time.push_back(
        1e-9 * static_cast<double>(c.model.knots.time_ns[i] - c.model.knots.time_ns[0]) + 1);
    c.piece_rms.push_back(0.019 + 1e-5 * static_cast<double>(i));
  }
  return c;
}

jobs::FlightDetails details_example() {
  jobs::FlightDetails d;
  d.shots = 200000;
  d.plane_size = 2;
  d.square_size = 4;
  d.strip_count = kStrips;
  d.pair_count = 6;
  for (std::uint16_t s = 0; s < kStrips; ++s) {
    const double course = kPi / 2 * s;
    d.strips.push_back({s,
                        50000,
                        36.0 * s,
                        16,
                        course,
                        5.01,
                        81.9,
                        deg(2.8),
                        {-40 * std::sin(course), 40 * std::sin(course)},
                        {-40 * std::cos(course), 40 * std::cos(course)}});
  }
  for (std::uint16_t s = 1; s < kStrips; ++s) {
    d.pairs.push_back({0, s, {-2, 2, 6}, {2, 2, 2}, {0.3, -0.2, kNaN}, {0.004, kNaN, -0.006}});
  }
  d.ground = {{-2, 2, 6},         {2, 2, 2},   {0.3, 0.2, kNaN}, {0.004, 0.005, kNaN},
              {0.02, 0.04, kNaN}, {0, 0.5, 1}, {2, 4, kNaN}};
  return d;
}

/// What a page is made of, with everything that belongs to it.
struct Flight {
  FlightCalibration calibration = calibrated_example();
  sensors::Sensor nominal = sensors::load_sensor("mid-40");
  trajectories::Mount mount;
  jobs::FlightDetails details = details_example();
  std::optional<jobs::FlightTruth> truth;
  std::vector<Warning> warnings;
  std::string recording = "strips <1>.lvx";

  Flight() {
    mount.name = "hexacopter";
    mount.reference_point = "centre of the IMU";
    mount.nominal << 0, 0, 1, 0, -1, 0, 1, 0, 0;
  }
  Report report() const {
    jobs::CalibratedFlight found;
    for (const std::string& path : {recording, std::string("more.lvx")}) {
      found.recordings.emplace_back();
      found.recordings.back().path = path;
      found.recordings.back().header.devices.emplace_back();
      found.recordings.back().header.devices.front().serial = calibration.sensor.serial;
    }
    found.choice.sensor = found.nominal = nominal;
    found.choice.words = "the file says so";
    found.calibration = calibration;
    found.mount = mount;
    found.details = details;
    found.strips.resize(kStrips);
    found.truth = truth;
    found.warnings = warnings;
    found.provenance = {{"command", "risley calibrate \"strips <1>.lvx\""}, {"seed", "0"}};
    return report_of(found);
  }
  std::string html() const { return report_page(report()); }
};

jobs::FlightTruth truth_example(const Flight& flight) {
  jobs::FlightTruth truth;
  truth.sensor = sensors::load_sensor("mid-40");
  truth.sensor.range_offset = 0.0617;
  truth.mount = flight.mount;
  truth.mount.boresight[0].value = deg(5.0);
  truth.mount.lever_arm[1].value = 0.0415;
  truth.mount.clock_offset.value = 0.07;
  truth.before.gauge = deg(4.1);
  truth.before.shape = deg(0.0231);
  truth.before.rotation = {deg(2.7), deg(-1.5), deg(1.9)};
  truth.after.gauge = deg(0.003);
  truth.after.shape = deg(0.0004);
  truth.after.rotation = {deg(0.001), deg(-0.002), deg(0.0015)};
  return truth;
}

TEST(FlightPage, MatchesItsGoldenText) {
  GoldenPage golden("flight", Flight().html());
  const auto differs = [&](const std::string& when, const std::function<void(Flight&)>& change) {
    Flight flight;
    change(flight);
    golden.differs(when, flight.html());
  };
  differs("a held unknown that may be off",
          [](Flight& flight) { flight.calibration.unknowns.back().held = true; });
  differs("what flights over flat ground do not tell", [](Flight& flight) {
    flight.calibration.not_told = {
        {"1.00 boresight_x_deg", 1}, {"1.00 boresight_y_deg", 1}, {"1.00 lever_arm_z_m", 1}};
  });
  differs("all told", [](Flight& flight) { flight.calibration.not_told.clear(); });
  differs("known ground", [](Flight& flight) {
    flight.calibration.control = {{"yard <1>", 812, true, 0.0031, 0.005, false},
                                  {"field", 640, true, -0.0417, 0.005, true},
                                  {"far away", 0, false, 0, 0.01, false}};
  });
  differs("one pair of strips", [](Flight& flight) {
    flight.calibration.pairs_before.resize(1);
    flight.calibration.pairs_after.resize(1);
    flight.details.pairs.resize(1);
    flight.details.pair_count = 1;
  });
  differs("no pair", [](Flight& flight) {
    flight.calibration.pairs_before.clear();
    flight.calibration.pairs_after.clear();
    flight.details = {};
  });
  differs("a failure", [](Flight& flight) {
    FlightCalibration failed;
    failed.unknowns = flight.calibration.unknowns;  // every result has them
    failed.covariance.setZero(flight.calibration.covariance.rows(),
                              flight.calibration.covariance.cols());
    flight.calibration = failed;
    flight.calibration.sensor = sensors::load_sensor("mid-40");
    flight.calibration.reason = "the adjustment had not converged & more";
    flight.calibration.rms_before = flight.calibration.rms_after = kNaN;
    flight.calibration.warnings = {{kWarning.shots_lost, "a warning"}};
    flight.details = {};
  });
  differs("a poor datum", [](Flight& flight) {
    flight.calibration.datum.rotation = flight.calibration.datum.total = deg(3);
  });
  differs("strips that fit no better", [](Flight& flight) { flight.calibration.rms_after = 0.35; });
  differs("warnings", [](Flight& flight) {
    flight.calibration.warnings = {{kWarning.shots_lost, "one"}};
    flight.warnings = {{kWarning.shots_lost, "two"}};
  });
  differs("the truth", [](Flight& flight) { flight.truth = truth_example(flight); });
}

TEST(FlightPage, ManyPairsAreThoseWithTheMostGround) {
  Flight flight;
  flight.calibration.pairs_before.clear();
  flight.calibration.pairs_after.clear();
  for (std::uint16_t i = 0; i < 40; ++i) {
    for (std::uint16_t j = i + 1; j < 40; ++j) {
      flight.calibration.pairs_before.push_back(pair(i, j, 0.3));
      flight.calibration.pairs_after.push_back(pair(i, j, 0.005));
    }
  }
  const std::string shown = visible(flight.html());
  EXPECT_THAT(shown, HasSubstr("The 200 pairs with the most ground in common, of 780."));
  EXPECT_THAT(shown, HasSubstr("strip 40 minus strip 39"));
  EXPECT_THAT(shown, Not(HasSubstr("strip 2 minus strip 1<")));
}

TEST(FlightPage, BothPicturesOfADifferenceHaveTheSameColours) {
  const std::string html = Flight().html();
  for (const std::string who : {"All strips", "Strip 2 minus strip 1"}) {
    const auto before = chart(html, who + ", before"), after = chart(html, who + ", after"),
               fine = chart(html, who + ", after, finer colours");
    EXPECT_EQ(before.at("kind"), "ground");
    EXPECT_EQ(before.at("value_range"), after.at("value_range"));
    EXPECT_LT(fine.at("value_range")[1], after.at("value_range")[1]);
    EXPECT_EQ(fine.at("series"), after.at("series"));
  }
  // Squares that were compared before and after.
  const auto after = chart(html, "Strip 2 minus strip 1, after").at("series").at(0);
  EXPECT_EQ(after.at("x"), nlohmann::json::array({-2.0}));
  EXPECT_EQ(after.at("value"), nlohmann::json::array({4.0}));
  EXPECT_EQ(after.at("cell_width"), 4.0);
  // Without any each picture has its own.
  Flight flight;
  flight.details.pairs[0].after = {kNaN, kNaN, 0.001};
  const std::string apart = flight.html();
  const auto squares = [&](const char* title) {
    return chart(apart, title).at("series").at(0).at("x");
  };
  EXPECT_EQ(squares("Strip 2 minus strip 1, before"), (nlohmann::json::array({-2.0, 2.0})));
  EXPECT_EQ(squares("Strip 2 minus strip 1, after"), nlohmann::json::array({6.0}));
}

TEST(FlightPage, CorrectionsHaveTheSignsAndUnitsOfTheirErrors) {
  const std::string html = Flight().html();
  const auto value = [&](const char* title) {
    return series(chart(html, title), "correction").at("y").at(0).get<double>();
  };
  // Row r of the corrections begins at 10 (r + 1) mm or 0.001 degrees.
  EXPECT_NEAR(value("Correction to the east"), 10, 1e-4);
  EXPECT_NEAR(value("Correction to the north"), 20, 1e-4);
  EXPECT_NEAR(value("Correction of the height"), 30, 1e-4);
  EXPECT_NEAR(value("Correction of the tilt about east"), 0.040, 1e-6);
  EXPECT_NEAR(value("Correction of the tilt about north"), 0.050, 1e-6);
  EXPECT_NEAR(value("Correction of the heading"), -0.060, 1e-6);  // about down
  const auto north = chart(html, "Correction to the north");
  const auto line = series(north, "correction"), band = series(north, "± σ");
  // A break between strips, and none else.
  ASSERT_EQ(line.at("x").size(), kStrips * kKnotsOfStrip + kStrips - 1);
  EXPECT_TRUE(line.at("y").at(kKnotsOfStrip).is_null());
  EXPECT_EQ(std::count(line.at("y").begin(), line.at("y").end(), nullptr), kStrips - 1);
  EXPECT_EQ(line.at("x").at(kKnotsOfStrip + 1), 36.0);
  EXPECT_EQ(band.at("x").size(), 2 * line.at("x").size() + 1);
  EXPECT_NEAR(band.at("y").at(0), 22, 1e-4);
}

TEST(FlightPage, ResidualsBreakBetweenStrips) {
  const auto line = series(chart(Flight().html(), "Residuals along time"), "residuals, RMS");
  ASSERT_EQ(line.at("x").size(), kStrips * (kKnotsOfStrip - 1) + kStrips - 1);
  EXPECT_EQ(std::count(line.at("y").begin(), line.at("y").end(), nullptr), kStrips - 1);
  EXPECT_NEAR(line.at("y").at(0), 19, 1e-4);
}

TEST(FlightPage, LongFlightsAreThinned) {
  Flight flight;
  FlightCalibration& c = flight.calibration;
  calibration::TrajectoryKnots& own = c.model.knots;
  own = {};
  c.piece_time.clear();
  c.piece_rms.clear();
  for (std::size_t i = 0; i < 50000; ++i) {
    own.time_ns.push_back(static_cast<std::int64_t>(i) * 250'000'000);
    own.strip.push_back(static_cast<std::uint16_t>(i / 1000));
    c.piece_time.push_back(0.25 * static_cast<double>(i) + 0.1);
    c.piece_rms.push_back(0.02);
  }
  c.model.corrections = c.correction_sigma = Eigen::MatrixXd::Constant(6, 50000, 0.01);
  const std::string html = flight.html();
  expect_sound(html);
  EXPECT_LT(series(chart(html, "Correction to the north"), "correction").at("x").size(), 1500u);
  const auto rms = series(chart(html, "Residuals along time"), "residuals, RMS");
  EXPECT_LT(rms.at("x").size(), 1500u);
  EXPECT_NEAR(rms.at("y").at(0), 20, 1e-4);
  EXPECT_THAT(visible(html), HasSubstr("One in 42 of the 50\u202f000 knots is drawn"));
}

TEST(FlightPage, NumbersThatAreNotFiniteAreDashes) {
  Flight flight;
  FlightCalibration& c = flight.calibration;
  c.unknowns[0].value = c.unknowns[1].sigma = c.unknowns[2].start = kNaN;
  c.unknowns[3].prior_share = c.unknowns[4].twin_correlation = kNaN;
  c.covariance(2, 3) = c.covariance(4, 4) = kNaN;
  c.covariance(6, 6) = -1;
  c.datum.total = c.datum.height = kInfinity;
  c.not_told[0].sigma = kNaN;
  c.pairs_after[0].mean = c.pairs_after[1].shift[0] = c.pairs_after[2].sigma[2] = kNaN;
  c.sigma0 = c.range_sigma = c.rms_after = kNaN;
  c.model.corrections(0, 3) = c.correction_sigma(5, 2) = kNaN;
  c.piece_rms[4] = kInfinity;
  flight.details.strips[0].speed = flight.details.strips[1].sway = kNaN;
  flight.details.ground.after.assign(3, kNaN);
  expect_sound(flight.html());
}

TEST(FlightPage, EscapesNames) {
  Flight flight;
  const std::string bad = "<script>alert(1)</script>";
  flight.mount.name = flight.mount.reference_point = bad;
  flight.recording = bad;
  flight.warnings = {{kWarning.shots_lost, bad}};
  flight.calibration.sensor.serial = bad;
  flight.calibration.not_told = {{bad, 1}};
  const std::string html = flight.html();
  expect_sound(html);
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(visible(html), HasSubstr("on &lt;script&gt;alert(1)"));
}

TEST(FlightReport, NeedsDetailsOfTheJob) {
  EXPECT_THROW(report_of(jobs::CalibratedFlight()), InvalidArgument);
}

TEST(FlightReport, WhatAPageCannotBeDrawnFromIsRefusedWithItsPlace) {
  Flight flight;
  flight.truth = truth_example(flight);
  const json::Json sound = flight.report().json;
  EXPECT_EQ(report_page(parse_report(sound.dump(), "f")), flight.html());
  for (const auto& [place, value, named] :
       std::vector<std::tuple<std::string, json::Json, std::string>>{
           {"/unknowns/boresight_x_deg/sigma", -1, "unknowns.boresight_x_deg.sigma"},
           {"/unknowns/boresight_x_deg/value", "x", "unknowns.boresight_x_deg.value"},
           {"/page/mount/body_from_sensor/1", {1, 2}, "body_from_sensor[1]: 2"},
           {"/page/strips/0", {{"strip", 1}}, "page.strips[0].begin_s"},
           {"/strips/pairs/0/first", 0, "strips.pairs[0].first: expected 1"},
           {"/charts", {{"strips", {}}}, "charts.strips"}}) {
    json::Json damaged = sound;
    damaged[json::Json::json_pointer(place)] = value;
    try {
      report_page(parse_report(damaged.dump(), "folder/report.json"));
      ADD_FAILURE() << place;
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), NamesField(named));
    }
  }
}

TEST(FlightReport, OfARealCalibrationMakesTheSamePageAgain) {
  testing::FlightSettings settings;
  settings.strip_length = 25;
  settings.shot_rate = 2000;
  const testing::SimulatedFlight simulated(settings);
  calibration::FlightCalibrationOptions options = simulated.options();
  options.knot_spacing = 2;
  options.cell_size = 3;
  Flight flight;
  flight.mount = options.mount;
  flight.calibration =
      calibration::calibrate_flight(simulated.shots, simulated.trajectory, options);
  flight.details =
      jobs::flight_details(simulated.shots, simulated.trajectory, options, flight.calibration);
  const Report report = flight.report();
  const std::string text = report_text(report), html = report_page(parse_report(text, "f"));
  EXPECT_EQ(html, report_page(report));
  expect_sound(html);
  chart(html, "Strip 4 minus strip 1, after");  // throws where there is none
  EXPECT_LT(text.size(), 3'000'000u);
}

}  // namespace risley::report::flight_report_test
