// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <limits>
#include <regex>
#include <set>
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

namespace risley::report::flight_report_test {

using calibration::FlightCalibration;
using calibration::FlightUnknown;
using calibration::FlightUnknowns;
using ::testing::HasSubstr;
using ::testing::Not;

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

/// The page's own part: no style, no scripts.
std::string visible(const std::string& html) {
  const std::size_t first = html.find("<main>"), last = html.find("</main>");
  EXPECT_NE(first, std::string::npos);
  EXPECT_NE(last, std::string::npos);
  return html.substr(first, last - first);
}

std::string data_text(const std::string& html) {
  const std::string start = "<script type=\"application/json\" id=\"page-data\">";
  const std::size_t first = html.find(start) + start.size();
  return html.substr(first, html.find("</script>", first) - first);
}

nlohmann::json data(const std::string& html) { return nlohmann::json::parse(data_text(html)); }

std::vector<std::string> titles(const std::string& html) {
  std::vector<std::string> found;
  const std::regex caption("<figcaption>([^<]*)</figcaption>");
  for (std::sregex_iterator i(html.begin(), html.end(), caption), end; i != end; ++i) {
    found.push_back((*i)[1]);
  }
  return found;
}

nlohmann::json chart(const std::string& html, const std::string& title) {
  for (const auto& one : data(html)) {
    if (one.at("title") == title) return one;
  }
  ADD_FAILURE() << "no diagram " << title;
  return {};
}

nlohmann::json series(const nlohmann::json& chart, const std::string& label) {
  for (const auto& one : chart.at("series")) {
    if (one.at("label") == label) return one;
  }
  ADD_FAILURE() << "no series " << label;
  return {};
}

void expect_sound(const std::string& html) {
  const std::string shown = visible(html);
  const std::regex not_finite("(^|[^A-Za-z])(nan|inf)([^A-Za-z]|$)", std::regex::icase);
  std::smatch found;
  EXPECT_FALSE(std::regex_search(shown, found, not_finite)) << found.suffix().str().substr(0, 200);
  EXPECT_FALSE(std::regex_search(data_text(html), not_finite));
  const nlohmann::json charts = data(html);
  EXPECT_EQ(charts.size(), titles(shown).size());
  const std::set<std::string> colours = {"a", "b", "c", "d", "ink", "bad"};
  for (const auto& one : charts) {
    EXPECT_THAT(shown, HasSubstr("class=\"plot\" id=\"" + one.at("id").get<std::string>() + "\""));
    for (const auto& drawn : one.at("series")) {
      EXPECT_EQ(drawn.at("x").size(), drawn.at("y").size());
      EXPECT_TRUE(colours.contains(drawn.at("colour").get<std::string>()));
      for (const auto& x : drawn.at("x")) EXPECT_TRUE(x.is_number());
    }
  }
}

TEST(FlightPage, SaysFirstWhatTheFlightFoundAndHowWell) {
  Flight flight;
  const std::string html = flight.html(), shown = visible(html);
  expect_sound(html);
  EXPECT_THAT(shown, HasSubstr("class=\"verdict ok\""));
  EXPECT_THAT(shown, HasSubstr("341.2 mm apart before and 5.4 mm after"));
  EXPECT_THAT(shown, HasSubstr("over 6 pairs of them"));
  EXPECT_THAT(shown, HasSubstr("X 6.0021° ± 0.0020°"));
  EXPECT_THAT(shown, HasSubstr("to 0.0039° (5.5 mm at 80 m)"));
  EXPECT_THAT(shown, HasSubstr("200\u202f000 shots with a range, 190\u202f000 of them used"));
  EXPECT_THAT(shown, HasSubstr("on hexacopter"));
  EXPECT_LT(shown.find("class=\"verdict"), shown.find("<h2>"));
}

TEST(FlightPage, HasEverySectionAndDiagram) {
  const std::string shown = visible(Flight().html());
  for (const char* text :
       {"<h2>How well the beams are known</h2>", "<h2>Mount, ranges and clock</h2>",
        "<h2>What this flight does not determine</h2>", "<h2>Strips before and after</h2>",
        "<h2>The flight</h2>", "<h2>Ground</h2>", "<h2>Residuals</h2>",
        "<h2>Corrections of the trajectory</h2>", "<h2>Prisms</h2>",
        "<h2>Correlations of the parameters</h2>", "<h2>Times of the recording</h2>",
        "<h2>How to make it again</h2>"}) {
    EXPECT_THAT(shown, HasSubstr(text));
  }
  EXPECT_THAT(titles(shown),
              ::testing::ElementsAre(
                  "All strips, before", "All strips, after", "All strips, after, finer colours",
                  "Strip 2 minus strip 1, before", "Strip 2 minus strip 1, after",
                  "Strip 2 minus strip 1, after, finer colours", "Strip 3 minus strip 1, before",
                  "Strip 3 minus strip 1, after", "Strip 3 minus strip 1, after, finer colours",
                  "Strip 4 minus strip 1, before", "Strip 4 minus strip 1, after",
                  "Strip 4 minus strip 1, after, finer colours", "The strips from above",
                  "How rough the ground is", "How steep the ground is", "How many strips saw it",
                  "Residuals along time", "Correction to the north", "Correction to the east",
                  "Correction of the height", "Correction of the tilt about north",
                  "Correction of the tilt about east", "Correction of the heading"));
}

TEST(FlightPage, UnknownsStandWithTheirPriorsAndTwins) {
  Flight flight;
  const std::string shown = visible(flight.html());
  // Name, value, sigma, unit, before, change, sigma before, share, twin.
  EXPECT_THAT(shown, HasSubstr("boresight_x_deg</span></th><td>6.0021</td><td>0.0020</td>"
                               "<td>deg</td><td>0.0000</td><td>6.0021</td><td>0.2</td>"
                               "<td>0 %</td><td class=\"text\">β<sub>Y</sub> (-0.43)</td>"));
  EXPECT_THAT(shown, HasSubstr("lever_arm_z_m</span></th><td>0.052</td><td>–</td><td>m</td>"
                               "<td>0.05</td><td>0.002</td><td>0.02</td>"
                               "<td class=\"text\" colspan=\"2\">held</td>"));
  EXPECT_THAT(shown, HasSubstr("clock_offset_s</span></th><td>72.00</td><td>0.20</td><td>ms</td>"));
  // No prior at all: a dash.
  EXPECT_THAT(shown, HasSubstr("range_offset_m</span></th><td>62.00</td><td>0.20</td><td>mm</td>"
                               "<td>60.00</td><td>2.00</td><td>–</td>"));
  // Prisms have a nominal value.
  EXPECT_THAT(shown, HasSubstr("<th>nominal</th>"));
  EXPECT_THAT(shown, HasSubstr("X, its optical axis, points down, its Y to the left and its Z "
                               "forward. Reference point of the trajectory: centre of the IMU."));
}

TEST(FlightPage, WhatIsHeldAndMayBeOffSaysSo) {
  Flight flight;
  flight.calibration.unknowns.back().held = true;
  EXPECT_THAT(visible(flight.html()), HasSubstr("held, but uncertain"));
}

TEST(FlightPage, SaysInWordsWhatIsNotTold) {
  Flight flight;
  std::string shown = visible(flight.html());
  EXPECT_THAT(shown, HasSubstr("<li>0.71 lever arm forward - 0.70 clock offset: 98 % of the σ "
                               "before remains. At one speed"));
  EXPECT_THAT(shown, HasSubstr("<li>boresight about the sensor&#39;s X against the heading of the "
                               "trajectory: 93 %"));
  flight.calibration.not_told = {
      {"1.00 boresight_x_deg", 1}, {"1.00 boresight_y_deg", 1}, {"1.00 lever_arm_z_m", 1}};
  shown = visible(flight.html());
  EXPECT_THAT(shown, HasSubstr("Flat ground does not show a rotation about the vertical"));
  EXPECT_THAT(shown, HasSubstr("Strips in opposite or crossing directions"));
  EXPECT_THAT(shown, HasSubstr("points of known height"));
  flight.calibration.not_told.clear();
  EXPECT_THAT(visible(flight.html()),
              HasSubstr("The flight adds to what was known of every free unknown"));
}

TEST(FlightPage, KnownGroundStandsWithWhatTheStripsSee) {
  Flight flight;
  EXPECT_THAT(visible(flight.html()), Not(HasSubstr("Known ground")));
  flight.calibration.control = {{"yard <1>", 812, true, 0.0031, 0.005, false},
                                {"field", 640, true, -0.0417, 0.005, true},
                                {"far away", 0, false, 0, 0.01, false}};
  const std::string shown = visible(flight.html());
  EXPECT_THAT(shown, HasSubstr("Known ground"));
  EXPECT_THAT(shown, HasSubstr("yard &lt;1&gt;</th><td>812</td><td>3.1</td><td>5.0</td><td></td>"));
  EXPECT_THAT(shown, HasSubstr("<td>-41.7</td><td>5.0</td><td>contradicts the flight</td>"));
  EXPECT_THAT(shown, HasSubstr("<td>–</td><td>10.0</td><td>left out</td>"));
}

TEST(FlightPage, PairsOfStripsStandBeforeAndAfter) {
  Flight flight;
  const std::string shown = visible(flight.html());
  EXPECT_THAT(
      shown, HasSubstr("strip 2 minus strip 1</th><td class=\"text\">before</td><td>1\u202f001</td>"
                       "<td>-102.4</td><td>341.2</td><td>170.6 ± 6.8</td><td>–</td>"
                       "<td>34.1 ± 3.4</td>"));
  EXPECT_THAT(shown, HasSubstr("<td class=\"text\">after</td><td>1\u202f001</td><td>-1.6</td>"
                               "<td>5.4</td>"));
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

TEST(FlightPage, OnePairAndNoPairAreSaid) {
  Flight flight;
  flight.calibration.pairs_before.resize(1);
  flight.calibration.pairs_after.resize(1);
  flight.details.pairs.resize(1);
  flight.details.pair_count = 1;
  EXPECT_THAT(visible(flight.html()), HasSubstr("over one pair of them"));
  expect_sound(flight.html());
  flight.calibration.pairs_before.clear();
  flight.calibration.pairs_after.clear();
  flight.details = {};
  const std::string html = flight.html();
  expect_sound(html);
  EXPECT_THAT(visible(html), HasSubstr("No two strips saw the same ground."));
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
  EXPECT_THAT(html, HasSubstr("Squares of 4 m, colours in mm."));
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

TEST(FlightPage, AFailureSaysWhyAndWhatToDo) {
  Flight flight;
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
  const std::string html = flight.html(), shown = visible(html);
  expect_sound(html);
  EXPECT_THAT(shown, HasSubstr("class=\"verdict bad\""));
  EXPECT_THAT(shown, HasSubstr("the adjustment had not converged &amp; more"));
  EXPECT_THAT(shown, HasSubstr("<li>a warning</li>"));
  EXPECT_THAT(shown, HasSubstr("What to do:"));
  EXPECT_EQ(data(html).size(), 0u);
}

TEST(FlightPage, APoorResultAsksForCare) {
  Flight flight;
  flight.calibration.datum.rotation = flight.calibration.datum.total = deg(3);
  EXPECT_THAT(visible(flight.html()), HasSubstr("The directions of the beams are poorly known"));
  EXPECT_THAT(visible(flight.html()), HasSubstr("class=\"verdict care\""));
  flight = {};
  flight.calibration.rms_after = 0.35;
  EXPECT_THAT(visible(flight.html()), HasSubstr("The strips fit no better than before"));
  flight = {};
  flight.calibration.warnings = {{kWarning.shots_lost, "one"}};
  flight.warnings = {{kWarning.shots_lost, "two"}};
  EXPECT_THAT(visible(flight.html()), HasSubstr("<li>two</li><li>one</li>"));
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

TEST(FlightPage, TruthStandsBesideWhatIsStated) {
  Flight flight;
  EXPECT_THAT(visible(flight.html()), Not(HasSubstr("truth")));
  flight.truth = truth_example(flight);
  const std::string shown = visible(flight.html());
  EXPECT_THAT(shown, HasSubstr("error before, against the truth</th><td>4.1</td>"));
  EXPECT_THAT(shown, HasSubstr("error after, against the truth</th><td>0.00303</td><td>0.003</td>"
                               "<td>0.0004</td><td>0.001</td><td>-0.002</td><td>0.0015</td>"
                               "<td>4.2</td><td>0.6</td>"));
  // Truth, error, error over sigma.
  EXPECT_THAT(shown, HasSubstr("<td>5.0000</td><td>1.0021</td><td class=\"far\">501.05</td>"));
  EXPECT_THAT(shown, HasSubstr("<td>0.04150</td><td>0.00050</td><td>2.50</td>"));
  EXPECT_THAT(shown, HasSubstr("<td>61.70</td><td>0.30</td><td>1.50</td>"));
  EXPECT_THAT(shown, HasSubstr("<td>70.00</td><td>2.00</td><td class=\"far\">10.00</td>"));
  EXPECT_THAT(shown, HasSubstr("held</td><td>0</td><td>0.052</td><td>–</td>"));
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
  EXPECT_THAT(html, HasSubstr("Content-Security-Policy"));
}

TEST(FlightReport, NeedsDetailsOfTheJob) {
  EXPECT_THROW(report_of(jobs::CalibratedFlight()), InvalidArgument);
}

TEST(FlightReport, WhatAPageCannotBeDrawnFromIsRefusedWithItsPlace) {
  Flight flight;
  flight.truth = truth_example(flight);
  const json::Json sound = flight.report().json;
  EXPECT_EQ(report_page(parse_report(sound.dump(), "f")), flight.html());
  for (const auto& [place, value, words] :
       std::vector<std::tuple<std::string, json::Json, std::string>>{
           {"/unknowns/boresight_x_deg/sigma", -1, "unknowns.boresight_x_deg.sigma: expected 0"},
           {"/unknowns/boresight_x_deg/value", "x", "unknowns.boresight_x_deg.value: expected"},
           {"/page/mount/body_from_sensor/1", {1, 2}, "body_from_sensor[1]: 2 values"},
           {"/page/strips/0", {{"strip", 1}}, "page.strips[0].begin_s is missing"},
           {"/strips/pairs/0/first", 0, "strips.pairs[0].first: expected 1 or more"},
           {"/charts", {{"strips", {}}}, "charts.strips"}}) {
    json::Json damaged = sound;
    damaged[json::Json::json_pointer(place)] = value;
    try {
      report_page(parse_report(damaged.dump(), "folder/report.json"));
      ADD_FAILURE() << place;
    } catch (const FileError& error) {
      EXPECT_THAT(error.what(), HasSubstr(words));
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
  EXPECT_THAT(visible(html), HasSubstr("Strip 4 minus strip 1, after"));
  EXPECT_LT(text.size(), 3'000'000u);
}

}  // namespace risley::report::flight_report_test
