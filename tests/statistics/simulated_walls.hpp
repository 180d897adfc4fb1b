// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "risley/calibration/calibrate.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/random.hpp"

#include "seeds.hpp"
#include "statistics/simulated.hpp"

namespace risley::testing {

/// A recording of walls by a sensor that believes its optics perfect (section 3.3 of the paper),
/// with rotation angles estimated as the command does, and what truly happened.
struct WallRecording {
  calibration::RangedRecording recording;
  simulation::SimulationSettings settings;
  recordings::TruthColumns truth;
  std::vector<std::size_t> truth_row;  ///< [shots of the recording]

  std::size_t size() const { return truth_row.size(); }
  /// Where the beam of a shot truly went.
  Vector3<double> direction(std::size_t shot) const {
    const std::size_t row = truth_row[shot];
    return direction_from_angles<double>({truth.azimuth[row], truth.zenith[row]});
  }
  /// What it truly met, sensor and scene being one frame where there is no station.
  scenes::Hit hit(std::size_t shot) const {
    const scenes::Station station = settings.scene->station(settings.station);
    std::vector<double> angles;
    for (const auto& column : truth.rotation_angle) angles.push_back(column[truth_row[shot]]);
    const Ray ray = emergent_ray(settings.truth.train, settings.truth.geometry, angles);
    return scenes::nearest_hit(*settings.scene,
                               station.position + station.scene_from_sensor(ray.origin),
                               station.scene_from_sensor(ray.direction))
        .value();
  }
};

/// Section 3.3 before any scene: Table 3's unit that believes in no errors, 0.01 degree and 20 mm
/// noise before rounding.
inline simulation::SimulationSettings wall_settings(scenes::Scene scene, std::uint64_t seed,
                                                    double rate = 1000.0, double duration = 10.0) {
  simulation::SimulationSettings settings;
  settings.truth = sensors::load_sensor("mid-40-table3");
  settings.reported = settings.truth;
  settings.reported->train = settings.reported->train.without_errors();
  settings.duration = duration;
  settings.rate = rate;
  settings.angle_noise = radians_from_degrees(0.01);
  settings.range_noise = 0.02;
  settings.rotor = simulation::RotorKind::sinusoidal;
  settings.scene = std::move(scene);
  settings.seed = seed;
  return settings;
}

/// The row of the truth that belongs to each time.
inline std::vector<std::size_t> rows_at(const recordings::TruthColumns& truth,
                                        const std::vector<std::int64_t>& time_ns) {
  std::vector<std::size_t> rows;
  for (const std::int64_t time : time_ns) {
    const auto found = std::lower_bound(truth.time_ns.begin(), truth.time_ns.end(), time);
    rows.push_back(static_cast<std::size_t>(found - truth.time_ns.begin()));
  }
  return rows;
}

/// Lets a unit be off in some parameters by their prior sigma: materials alike in the prisms and in
/// what the sensor computes with, tilts in each by themselves.
inline void draw_unit(simulation::SimulationSettings& settings,
                      const std::vector<estimation::FreeParameter>& parameters,
                      const RandomStream& errors) {
  std::uint64_t number = 0;
  for (const auto& parameter : parameters) {
    const double common = parameter.prior_sigma * errors.normal(number++);
    const double own = parameter.prior_sigma * errors.normal(number++);
    for (const int at : parameter.places) {
      PrismTrain& truth = settings.truth.train;
      truth.set_place(at, truth[at] + common);
      if (!settings.reported) continue;
      PrismTrain& reported = settings.reported->train;
      reported.set_place(
          at, reported[at] + (calibration::is_material(at, truth.prisms()) ? common : own));
    }
  }
}

/// Simulates a recording and finds its rotation angles.
/// @param noise_told  else it is found, too
inline WallRecording record_walls(const simulation::SimulationSettings& settings,
                                  bool noise_told = true) {
  WallRecording result;
  result.settings = settings;
  simulation::Scanner scanner(settings);
  estimation::ShotSelector selector({{}, true});
  recordings::Chunk chunk;
  recordings::TruthColumns truth;
  while (scanner.read(chunk, truth)) {
    selector.add(chunk.observations);
    result.truth.append(truth);
  }
  estimation::EstimateOptions options;
  options.sensor = sensors::load_sensor("mid-40");
  if (noise_told) options.angle_noise = settings.angle_noise;
  const auto estimate = estimation::estimate(estimation::Method::map, selector.take_series(),
                                             selector.head(), options);
  result.recording = calibration::ranged_recording(estimate, fmt::format("seed {}", settings.seed),
                                                   scanner.header().devices.front().serial);
  result.truth_row = rows_at(result.truth, result.recording.time_ns);
  return result;
}

/// What the command takes when the noise is given.
inline calibration::CalibrationOptions wall_options(
    calibration::CalibrationMethod method = calibration::CalibrationMethod::adjustment) {
  calibration::CalibrationOptions options;
  options.method = method;
  options.sensor = sensors::load_sensor("mid-40");
  options.range_noise = 0.02;
  return options;
}

/// Errors of the directions of all recordings together, before and after, as the command's --truth
/// finds them.
struct WallErrors {
  calibration::DirectionErrors before, after;
};

/// @param shift  of the rotation angles [recordings][prisms], rad
inline WallErrors wall_errors(const std::vector<const WallRecording*>& recordings,
                              const PrismTrain& calibrated,
                              const std::vector<std::vector<double>>& shift) {
  constexpr std::size_t kMostBeams = 50000;
  std::vector<Vector3<double>> before, after, truth;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const WallRecording& walls = *recordings[r];
    for (const std::size_t shot :
         calibration::spread_rows(walls.size(), kMostBeams / recordings.size())) {
      std::vector<double> angles;
      for (const auto& column : walls.recording.shots.rotation_angle) {
        angles.push_back(column[shot]);
      }
      before.push_back(observe(walls.recording.believed.train, angles).direction);
      for (std::size_t k = 0; k < angles.size(); ++k) angles[k] += shift[r][k];
      after.push_back(observe(calibrated, angles).direction);
      truth.push_back(walls.direction(shot));
    }
  }
  return {calibration::direction_errors(before, truth),
          calibration::direction_errors(after, truth)};
}

/// A calibration and how far it is off.
struct JudgedCalibration {
  calibration::Calibration calibration;
  WallErrors errors;
};

/// Errors are judged where the calibration converged.
inline JudgedCalibration judge_walls(const std::vector<const WallRecording*>& walls,
                                     const calibration::CalibrationOptions& options) {
  std::vector<calibration::RangedRecording> recordings;
  for (const WallRecording* one : walls) recordings.push_back(one->recording);
  JudgedCalibration result{calibration::calibrate(recordings, options), {}};
  const calibration::Calibration& c = result.calibration;
  if (c.converged) result.errors = wall_errors(walls, c.sensor.train, c.angle_shift);
  return result;
}

/// Expects the calibration to converge.
inline JudgedCalibration calibrate_walls(const std::vector<const WallRecording*>& walls,
                                         const calibration::CalibrationOptions& options) {
  JudgedCalibration result = judge_walls(walls, options);
  const calibration::Calibration& c = result.calibration;
  EXPECT_TRUE(c.converged) << walls.front()->recording.name << ": " << c.reason;
  return result;
}

/// Errors of calibrations over seeds, and what the calibrations said of them. Angles in degrees.
class WallMonteCarlo {
 public:
  void add(const JudgedCalibration& judged, const sensors::Sensor& truth) {
    const calibration::Calibration& c = judged.calibration;
    const WallErrors& e = judged.errors;
    ++runs;
    azimuth_before += degrees_from_radians(e.before.azimuth_rmse);
    zenith_before += degrees_from_radians(e.before.zenith_rmse);
    const double total = degrees_from_radians(e.after.total);
    total_ += total;
    largest_total = std::max(largest_total, total);
    gauge_ += degrees_from_radians(e.after.gauge);
    shape_ += degrees_from_radians(e.after.shape);
    const double off =
        (c.pointing_error.errors.total - e.before.total) / c.pointing_error.total_sigma;
    reported_over_sigma2_ += off * off;
    total2_ += std::pow(e.after.total, 2);
    shape2_ += std::pow(e.after.shape, 2);
    // The units of these tests are in what is held exactly as held, but for one.
    const calibration::FormalDatum& datum = held_is_off ? c.datum : c.datum_given_held;
    formal_total2_ += std::pow(datum.total, 2);
    formal_shape2_ += std::pow(datum.shape, 2);
    steps += static_cast<int>(c.steps.size());
    iterations = std::max(iterations, c.iterations);
    if (const auto* offset = c.number("range_offset_m")) {
      offset2_ += std::pow(offset->value / offset->sigma, 2);
    }
    Eigen::VectorXd error = c.parameters;
    for (Eigen::Index j = 0; j < error.size(); ++j) {
      error[j] -= truth.train[c.free[static_cast<std::size_t>(j)].places.front()];
      covered_ += std::abs(error[j]) < 2.0 * std::sqrt(c.covariance(j, j));
    }
    parameters_ += static_cast<double>(error.size());
    // Scaled, since some combinations of parameters are known a thousand times better than others.
    const Eigen::VectorXd scale = c.covariance.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd correlation = scale.asDiagonal() * c.covariance * scale.asDiagonal();
    const Eigen::VectorXd over = scale.cwiseProduct(error);
    nees_ += over.dot(correlation.ldlt().solve(over));
  }

  double mean_total() const { return total_ / runs; }
  double mean_gauge() const { return gauge_ / runs; }
  double mean_shape() const { return shape_ / runs; }
  /// Root mean square errors over the formal ones: 1 when these are honest.
  double total_ratio() const { return std::sqrt(total2_ / formal_total2_); }
  /// What the calibrations say that reported directions are off by, against the truth, in sigmas.
  double reported_ratio() const { return std::sqrt(reported_over_sigma2_ / runs); }
  double shape_ratio() const { return std::sqrt(shape2_ / formal_shape2_); }
  double offset_ratio() const { return std::sqrt(offset2_ / runs); }
  /// Normalised estimation error squared of the parameters, per degree of freedom.
  double nees() const { return nees_ / parameters_; }
  /// Half the width of the band around 1 that holds it in 999 of 1000 cases.
  double nees_band() const { return 3.3 * std::sqrt(2.0 / parameters_); }
  double within_two_sigma() const { return covered_ / parameters_; }
  double mean_azimuth_before() const { return azimuth_before / runs; }
  double mean_zenith_before() const { return zenith_before / runs; }

  /// Shown by --gtest_output=json:FILE.
  void record(const std::string& prefix = {}) const {
    const auto one = [&](const char* name, double value) {
      ::testing::Test::RecordProperty(prefix + name, fmt::format("{:.5g}", value));
    };
    one("runs", runs);
    one("azimuth_before_deg", mean_azimuth_before());
    one("zenith_before_deg", mean_zenith_before());
    one("total_deg", mean_total());
    one("largest_total_deg", largest_total);
    one("gauge_deg", mean_gauge());
    one("shape_deg", mean_shape());
    one("formal_total_deg", degrees_from_radians(std::sqrt(formal_total2_ / runs)));
    one("formal_shape_deg", degrees_from_radians(std::sqrt(formal_shape2_ / runs)));
    one("total_over_formal", total_ratio());
    one("shape_over_formal", shape_ratio());
    one("reported_over_sigma", reported_ratio());
    one("range_offset_over_sigma", offset_ratio());
    one("nees", nees());
    one("nees_band", nees_band());
    one("within_two_sigma", within_two_sigma());
    one("steps", steps);
    one("iterations", iterations);
  }

  bool held_is_off = false;  ///< the units differ from what is held: its sigmas count
  int runs = 0, steps = 0, iterations = 0;
  double largest_total = 0;

 private:
  double azimuth_before = 0, zenith_before = 0;
  double total_ = 0, gauge_ = 0, shape_ = 0;
  double total2_ = 0, shape2_ = 0, formal_total2_ = 0, formal_shape2_ = 0, offset2_ = 0;
  double reported_over_sigma2_ = 0;
  double nees_ = 0, parameters_ = 0, covered_ = 0;
};

/// Simulates, estimates and calibrates one recording for every seed.
/// @param change  what happens to a recording before it is calibrated
inline WallMonteCarlo wall_monte_carlo(
    int seeds, const std::function<simulation::SimulationSettings(std::uint64_t)>& settings_of,
    const calibration::CalibrationOptions& options,
    const std::function<void(WallRecording&)>& change = {}) {
  WallMonteCarlo result;
  for (int seed = 0; seed < seeds; ++seed) {
    WallRecording walls = record_walls(settings_of(static_cast<std::uint64_t>(seed)));
    if (change) change(walls);
    result.add(calibrate_walls({&walls}, options), walls.settings.truth);
  }
  return result;
}

}  // namespace risley::testing
