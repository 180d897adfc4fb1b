// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/flight_details.hpp"

#include <cmath>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "risley/calibration/flight_calibration.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/progress.hpp"

#include "calibration/flights.hpp"
#include "refusal.hpp"

namespace risley::jobs::flight_details_test {

using calibration::FlightCalibration;
using calibration::FlightCalibrationOptions;
using testing::FlightSettings;
using testing::SimulatedFlight;

/// A small flight and its calibration.
struct Calibrated {
  FlightSettings settings;
  SimulatedFlight flight;
  FlightCalibrationOptions options;
  FlightCalibration found;

  explicit Calibrated(const FlightSettings& wanted = small())
      : settings(wanted), flight(settings), options(flight.options()) {
    options.knot_spacing = 2;
    options.cell_size = 3;
    found = calibration::calibrate_flight(flight.shots, flight.trajectory, options);
  }
  static FlightSettings small() {
    FlightSettings settings;
    settings.strip_length = 25;
    settings.shot_rate = 2000;
    return settings;
  }
  FlightDetails details(const FlightDetailsOptions& bounds = {}) const {
    return flight_details(flight.shots, flight.trajectory, options, found, bounds);
  }
};

double rms(const std::vector<double>& values) {
  double squares = 0, count = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    squares += value * value;
    ++count;
  }
  return std::sqrt(squares / count);
}

std::size_t finite(const std::vector<double>& values) {
  std::size_t count = 0;
  for (const double value : values) count += std::isfinite(value);
  return count;
}

void expect_bounded(const FlightDetails& details, std::size_t most_squares) {
  const FlightGround& ground = details.ground;
  EXPECT_LE(ground.east.size(), most_squares);
  for (const auto* column : {&ground.north, &ground.before, &ground.after, &ground.roughness,
                             &ground.slope, &ground.strips}) {
    EXPECT_EQ(column->size(), ground.east.size());
  }
  EXPECT_LE(details.pairs.size(), 6u);
  for (const StripDifferences& pair : details.pairs) {
    EXPECT_LT(pair.first, pair.second);
    EXPECT_LE(pair.east.size(), most_squares);
    EXPECT_EQ(pair.north.size(), pair.east.size());
    EXPECT_EQ(pair.before.size(), pair.east.size());
    EXPECT_EQ(pair.after.size(), pair.east.size());
  }
}

TEST(FlightDetails, ShowHowTheStripsLieBeforeAndAfter) {
  const Calibrated one;
  const FlightDetails details = one.details();
  EXPECT_EQ(details.shots, one.flight.shots.size());
  EXPECT_EQ(details.pair_count, 6u);
  ASSERT_EQ(details.pairs.size(), 6u);
  expect_bounded(details, 2000);
  const FlightGround& ground = details.ground;
  ASSERT_GT(ground.east.size(), 100u);
  // Cells are other ones than those of the calibration.
  EXPECT_NEAR(rms(ground.before) / one.found.rms_before, 1, 0.4);
  EXPECT_GT(rms(ground.before), 10 * rms(ground.after));
  EXPECT_LT(rms(ground.after), 2.5 * one.found.rms_after);
  EXPECT_NEAR(details.square_size / details.plane_size,
              std::round(details.square_size / details.plane_size), 1e-12);
  // Flat ground between roofs.
  std::size_t level = 0, plain = 0, seen = 0;
  for (std::size_t i = 0; i < ground.east.size(); ++i) {
    EXPECT_LT(std::abs(ground.east[i]), 60);
    level += ground.slope[i] < radians_from_degrees(3);
    plain += std::abs(ground.roughness[i] - one.settings.range_noise) < 0.01;
    seen += ground.strips[i] >= 2;
    EXPECT_FALSE(ground.strips[i] > 4);
  }
  EXPECT_GT(level, ground.east.size() / 3);
  EXPECT_GT(plain, ground.east.size() / 3);
  EXPECT_GT(seen, ground.east.size() / 2);
}

TEST(FlightDetails, KnowTheStripsAsTheyWereFlown) {
  FlightSettings settings = Calibrated::small();
  settings.attitude_rms_deg = 1;
  const Calibrated one(settings);
  const FlightDetails details = one.details();
  ASSERT_EQ(details.strips.size(), 4u);
  EXPECT_EQ(details.strip_count, 4u);
  double last = -1;
  std::size_t shots = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const FlightStrip& strip = details.strips[i];
    EXPECT_EQ(strip.strip, i);
    EXPECT_GT(strip.begin, last);
    last = strip.begin + strip.duration;
    EXPECT_NEAR(strip.duration, 5, 0.01);
    EXPECT_NEAR(strip.speed, 5, 0.3);
    EXPECT_LT(std::abs(wrap_to_pi(strip.course - radians_from_degrees(settings.headings_deg[i]))),
              radians_from_degrees(5));
    EXPECT_NEAR(strip.range, 82, 4);
    // Two angles, over a piece of a slow motion.
    EXPECT_NEAR(strip.sway, radians_from_degrees(std::sqrt(2.0)), radians_from_degrees(0.6));
    EXPECT_EQ(strip.east.size(), strip.north.size());
    EXPECT_LE(strip.east.size(), 200u);
    shots += strip.shots;
  }
  EXPECT_EQ(details.strips[0].begin, 0);
  EXPECT_EQ(shots, details.shots);
}

TEST(FlightDetails, AreBoundedAndSayTheSameOfASample) {
  const Calibrated one;
  const FlightDetails all = one.details();
  FlightDetailsOptions bounds;
  bounds.most_shots = 15000;
  bounds.most_squares = 60;
  const FlightDetails some = one.details(bounds);
  EXPECT_NEAR(static_cast<double>(some.shots), 15000, 500);
  expect_bounded(some, 60);
  EXPECT_GT(some.square_size, all.square_size);
  EXPECT_GE(some.plane_size, all.plane_size);
  EXPECT_GT(finite(some.ground.after), 15u);
  EXPECT_GT(rms(some.ground.before), 5 * rms(some.ground.after));
}

TEST(FlightDetails, OfAPerfectStartShowNothing) {
  FlightSettings settings = Calibrated::small();
  settings.trajectory_errors = false;
  settings.ground = testing::Ground::flat;
  Calibrated one(settings);
  one.options.sensor = one.flight.sensor;
  one.options.sensor.range_offset = settings.range_offset;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    one.options.mount.boresight[i].value = radians_from_degrees(settings.boresight_deg[axis]);
    one.options.mount.lever_arm[i].value = settings.lever_arm[axis];
  }
  one.options.mount.clock_offset.value = settings.clock_offset;
  const FlightDetails details = one.details();
  // Means of five shots and more of 20 mm, most of many more.
  EXPECT_GT(finite(details.ground.before), 50u);
  EXPECT_LT(rms(details.ground.before), 0.015);
  for (const StripDifferences& pair : details.pairs) EXPECT_LT(rms(pair.before), 0.015);
}

TEST(FlightDetails, RefuseWhatDoesNotBelongTogether) {
  const Calibrated one;
  const auto refused = [&](const auto& damage) {
    Calibrated damaged = one;
    FlightDetailsOptions bounds;
    damage(damaged, bounds);
    return refusal([&] { damaged.details(bounds); });
  };
  EXPECT_NE(refused([](Calibrated&, auto& bounds) { bounds.most_shots = 0; }), "");
  EXPECT_NE(refused([](Calibrated&, auto& bounds) { bounds.most_squares = 0; }), "");
  EXPECT_NE(refused([](Calibrated& c, auto&) { c.found.model.knots = {}; }), "");
  EXPECT_NE(refused([](Calibrated& c, auto&) { c.found.model.corrections.resize(6, 1); }), "");
  EXPECT_NE(refused([](Calibrated& c, auto&) { c.options.mount.nominal *= 2; }), "");
  EXPECT_NE(refused([](Calibrated& c, auto&) { c.found.range_sigma = -1; }), "");
  EXPECT_NE(refused([](Calibrated& c, auto&) {
              for (auto& time : c.flight.shots.time_ns) time += 604'800'000'000'000;
            }),
            "");
  CancelFlag cancel;
  cancel.set();
  EXPECT_THROW(flight_details(one.flight.shots, one.flight.trajectory, one.options, one.found, {},
                              Progress([](double) {}, &cancel)),
               Cancelled);
}

}  // namespace risley::jobs::flight_details_test
