// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "risley/identification/line_spectrum.hpp"
#include "risley/identification/shot_grid.hpp"
#include "risley/identification/train_fit.hpp"

#include "identification/scans.hpp"
#include "refusal.hpp"

namespace risley::identification::parts_test {

TEST(ShotGrid, FindsAStepThatNanosecondsRound) {
  estimation::AngleSeries series;
  for (int i = 0; i < 24000; ++i) {
    if (i % 7 == 3 || (i > 900 && i < 1400)) continue;  // without a return
    series.append(std::llround(1e9 * (i + 39) / 240000.0), 0.1, 1.5);
  }
  const ShotGrid grid = shot_grid(series, {0, series.size()});
  EXPECT_TRUE(grid.regular);
  EXPECT_NEAR(grid.step * 240000.0, 1.0, 1e-9);
  EXPECT_EQ(grid.slot.front(), 0);
  EXPECT_EQ(grid.slot.back(), 23998);
  EXPECT_NEAR(grid.time.back(), 23998 / 240000.0, 1e-9);
}

TEST(ShotGrid, RefusesTimesThatStandStill) {
  estimation::AngleSeries series;
  for (int i = 0; i < 100; ++i) series.append(0, 0.1, 1.5);
  EXPECT_THROW(shot_grid(series, {0, series.size()}), EstimationError);
  EXPECT_THROW(shot_grid(series, {0, 10}), EstimationError);
}

TEST(RotorCurves, WeightsSumToOneAndRatesAreTheirDerivatives) {
  for (const bool smooth : {true, false}) {
    for (int degree = 1; degree <= kMaxCurveDegree; ++degree) {
      RotorCurves curves(1, 0.3, 1.7, 5, degree, smooth);
      for (int m = 0; m < curves.coefficients(); ++m) curves.coefficient(0, m) = std::sin(3 * m);
      for (const double time : {0.31, 0.9, 1.0, 1.69}) {
        const CurveWeights weights = curve_weights(curves, curves.segment_of(time), time);
        double sum = 0;
        for (int m = 0; m <= degree; ++m) sum += weights.value[static_cast<std::size_t>(m)];
        if (smooth) {
          EXPECT_NEAR(sum, 1.0, 1e-14);
        }
        const double h = 1e-6;
        const double slope = (curves.angle(0, time + h) - curves.angle(0, time - h)) / (2 * h);
        EXPECT_NEAR(curves.angular_velocity(0, time), slope, 1e-6) << degree << smooth;
      }
      if (smooth && degree > 1) {  // no jump at a border of segments
        const double border = 0.3 + curves.segment_length();
        EXPECT_NEAR(curves.angle(0, border - 1e-12), curves.angle(0, border + 1e-12), 1e-9);
      }
    }
  }
}

TEST(RotorCurves, ResampledKeepsWhatTheNewShapeCanHold) {
  RotorCurves line(2, 0, 1, 1, 1, true);
  line.coefficient << 1, 5, -2, 30;
  for (const RotorCurves& shape :
       {RotorCurves(2, 0, 1, 6, 3, true), RotorCurves(2, 0.2, 0.8, 2, 2, false)}) {
    const RotorCurves other = resampled(line, shape);
    for (const double time : {0.25, 0.5, 0.79}) {
      EXPECT_NEAR(other.angle(0, time), 1 + 4 * time, 1e-8);
      EXPECT_NEAR(other.angular_velocity(1, time), 32, 1e-6);
    }
  }
}

TEST(LineSpectrum, TellsRotorsAndEmitters) {
  Scan scan;
  scan.emitter_elevation_deg = six_emitters_deg();
  scan.duration_s = 1;
  const estimation::AngleSeries series = scan.series();
  ShotGrid grid = shot_grid(series, {0, series.size()});
  LineSpectrum spectrum = line_spectrum(grid, {.fastest = kTwoPi * 400});
  EXPECT_EQ(emitter_period(grid, spectrum.lines), 6);
  grid.emitters = 6;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    grid.emitter[i] = static_cast<std::uint8_t>(grid.slot[i] % 6);
  }
  spectrum = line_spectrum(grid, {.fastest = kTwoPi * 400});
  ASSERT_GE(spectrum.lines.size(), 2U);
  std::vector<double> strongest{spectrum.lines[0].angular_velocity / kTwoPi,
                                spectrum.lines[1].angular_velocity / kTwoPi};
  std::sort(strongest.begin(), strongest.end());
  EXPECT_NEAR(strongest[0], scan.speed_hz[0], 0.01);
  EXPECT_NEAR(strongest[1], scan.speed_hz[1], 0.01);
  for (std::size_t j = 0; j < 6; ++j) {
    EXPECT_NEAR(spectrum.constant[j].imag(),
                std::sin(radians_from_degrees(scan.emitter_elevation_deg[j])), 1e-3);
  }
}

TEST(LineSpectrum, OneEmitterHasNoPattern) {
  const Scan scan;
  const estimation::AngleSeries series = scan.series();
  const ShotGrid grid = shot_grid(series, {0, series.size()});
  EXPECT_EQ(emitter_period(grid, line_spectrum(grid, {.fastest = kTwoPi * 400}).lines), 1);
}

TEST(TrainFit, PredictionsOfAModelAreFittedByIt) {
  Scan scan;
  scan.emitter_elevation_deg = six_emitters_deg();
  scan.duration_s = 0.3;
  const estimation::AngleSeries series = scan.series();
  ShotGrid grid = shot_grid(series, {0, series.size()});
  grid.emitters = 6;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    grid.emitter[i] = static_cast<std::uint8_t>(i % 6);
  }
  TrainModel truth;
  truth.train = scan.train();
  truth.lag = {0, 1e-6, 2e-6, 3e-6, 4e-6, 5e-6};
  truth.frame = {0.3, -0.1};
  truth.rotors = RotorCurves(2, 0, 0.3, 1, 1, true);
  truth.rotors.coefficient << 0.5, 0.5 - 200, 2, 2 + 150;
  const ShotGrid seen = predicted(grid, truth);
  TrainModel start = truth;
  start.frame = {0.31, -0.09};
  start.train.set("refractive_index_a", 1.53);
  start.train.set("wedge_angle_b_deg", radians_from_degrees(18.2));
  start.lag.assign(6, 0.0);
  TrainFreedom freedom;
  freedom.glass = freedom.emitters = freedom.lags = freedom.frame = true;
  const TrainFit fit = fit_train(seen, start, freedom, {.iterations = 40, .covariance = true});
  EXPECT_LT(fit.rms, 1e-11);
  EXPECT_NEAR(fit.model.frame.yaw, 0.3, 1e-8);
  EXPECT_NEAR(fit.model.train[place::refractive_index(0)], 1.5089, 1e-7);
  EXPECT_NEAR(fit.model.lag[5] - fit.model.lag[0], 5e-6, 1e-11);
  EXPECT_EQ(fit.names.size(), static_cast<std::size_t>(fit.covariance.rows()));
}

TEST(TrainFit, LeavesOutliersOut) {
  Scan scan;
  scan.duration_s = 0.3;
  scan.noise_deg = 0.01;
  estimation::AngleSeries series = scan.series();
  for (std::size_t i = 5; i < series.size(); i += 50) series.azimuth[i] += 0.1;
  const ShotGrid grid = shot_grid(series, {0, series.size()});
  TrainModel start;
  start.train = scan.train();
  start.lag = {0};
  start.rotors = RotorCurves(2, 0, 0.3, 1, 1, true);
  for (int k = 0; k < 2; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double angle = radians_from_degrees(scan.start_deg[at]);
    start.rotors.coefficient(k, 0) = angle;
    start.rotors.coefficient(k, 1) = angle + kTwoPi * scan.speed_hz[at] * 0.3;
  }
  const TrainFit fit = fit_train(grid, start, {}, {.iterations = 20, .without_outliers = true});
  EXPECT_EQ(fit.outliers, series.size() / 50);
  EXPECT_NEAR(degrees_from_radians(fit.rms), 0.01, 0.001);
}

TEST(TrainFit, RefusesWhatDoesNotBelongTogether) {
  const Scan scan;
  const estimation::AngleSeries series = scan.series();
  const ShotGrid grid = shot_grid(series, {0, series.size()});
  TrainModel model;
  model.train = scan.train();
  model.rotors = RotorCurves(2, 0, 4, 1, 1, true);
  EXPECT_NE(refusal([&] { fit_train(grid, model, {}); }).find("lag"), std::string::npos);
  EXPECT_NE(refusal([] { RotorCurves(1, 1, 1, 1, 1, true); }).find("end"), std::string::npos);
  EXPECT_NE(refusal([] { RotorCurves(1, 0, 1, 1, 9, true); }).find("degree"), std::string::npos);
}

}  // namespace risley::identification::parts_test
