// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "risley/core/angle.hpp"
#include "risley/report/report_file.hpp"
#include "risley/sensors/preset.hpp"

#include "report/page_reading.hpp"

namespace risley::report::estimate_page_test {

using estimation::Estimate;
using estimation::Moments;
using jobs::EstimatedRecording;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kShots = 5000, kStates = 500, kOutliers = 3, kPieces = 19;
constexpr std::int64_t kStep_ns = 1'000'000;  // between shots
constexpr double kResidual = 0.006;           // deg

double deg(double degrees) { return radians_from_degrees(degrees); }

Moments moments(std::size_t count, double mean, double std) {
  return {count, mean, std, std::hypot(mean, std), 0.01, -0.02};
}

estimation::AngleSeries shots() {
  estimation::AngleSeries series;
  for (std::size_t i = 0; i < kShots; ++i) {
    const double turn = 0.0137 * static_cast<double>(i);
    series.append(static_cast<std::int64_t>(i) * kStep_ns, deg(19) * std::cos(turn),
                  deg(90) + deg(19) * std::sin(turn));
  }
  return series;
}

/// Rotors that swing about their mean speed.
estimation::RotorStates states() {
  estimation::RotorStates own;
  own.resize(2, kStates);
  for (std::size_t i = 0; i < kStates; ++i) {
    const auto number = static_cast<double>(i);
    own.time_ns[i] = static_cast<std::int64_t>(i * kShots / kStates) * kStep_ns;
    for (std::size_t k = 0; k < 2; ++k) {
      own.rotation_angle[k][i] = number * (k == 0 ? -0.3 : 0.5);
      own.angular_velocity[k][i] = deg(k == 0 ? -27984 : 43764) + deg(2) * std::sin(0.1 * number);
    }
    own.azimuth_residual[i] = own.zenith_residual[i] = deg(kResidual) * std::sin(number);
  }
  return own;
}

/// An estimate with distinct numbers.
Estimate estimate() {
  Estimate e;
  e.converged = true;
  e.verdict = {estimation::EstimateCode::consistent, "the directions are <consistent>",
               "calibrate the unit on walls"};
  e.sensor = sensors::load_sensor("mid-40");
  e.free = estimation::free_parameters(
      {"refractive_index", "incident_beam_vertical_deg", "prism_tilt_b_vertical_deg"}, {2});
  e.parameters = Eigen::Vector3d(1.5102, deg(-0.385), deg(0.12));
  const Eigen::Vector3d sigma(2e-5, deg(0.002), deg(0.004));
  e.covariance = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      e.covariance(i, j) = std::pow(-0.7, std::abs(i - j)) * sigma[i] * sigma[j];
    }
    e.values.push_back(
        {e.free[static_cast<std::size_t>(i)].name, e.parameters[i], 3 * sigma[i], sigma[i]});
  }
  e.values.push_back({"angular_velocity_a_deg_per_s", deg(-27990), deg(0.02), deg(0.02)});
  e.values.push_back({"angular_velocity_b_deg_per_s", deg(43770), deg(0.03), deg(0.03)});
  e.values.push_back({"rotation_angle_a_deg", deg(12.5), deg(0.4), deg(0.01)});
  e.values.push_back({"rotation_angle_b_deg", deg(-77.25), deg(0.5), deg(0.02)});
  e.rotor_process.resize(2);
  e.series = shots();
  e.trajectory.prisms = 2;
  e.trajectory.time_ns = {0};
  e.trajectory.first_shot = {0};
  e.trajectory.last_shot = {kShots};
  e.trajectory.stretch_begin = {0};
  e.trajectory.state.resize(static_cast<std::size_t>(e.trajectory.states()));
  e.states = states();
  e.outlier.resize(kShots);
  e.outliers = kOutliers;
  for (std::size_t i = 0; i < kOutliers; ++i) e.outlier[1000 * i] = 1;
  for (std::size_t i = 0; i < kShots; ++i) {
    e.azimuth_residual.push_back(deg(kResidual) * std::sin(static_cast<double>(i)));
    e.zenith_residual.push_back(deg(kResidual) * std::cos(static_cast<double>(i)));
  }
  e.azimuth_moments = moments(kShots - kOutliers, deg(0.0001), deg(0.0042));
  e.zenith_moments = moments(kShots - kOutliers, deg(-0.0002), deg(0.0045));
  for (const double chi2 : {1.02, 0.97}) {
    estimation::AngleProfile profile;
    profile.mean_azimuth = {deg(0.001), kNaN, deg(-0.001), 0};
    profile.mean_zenith = {0, kNaN, deg(0.001), deg(-0.001)};
    profile.chi2_per_bin = chi2;
    e.residuals_over_angle.push_back(profile);
  }
  e.noise = {{deg(0.0041), deg(0.0043)}, {deg(0.0001), deg(0.0001)}};
  e.expected_residual = deg(0.0043);
  e.usual_noise = deg(0.004);
  e.unit_variance = 1.01;
  e.variance_factor = 1.111;
  e.autocorrelation = {1.1, {0.05}};
  return e;
}

/// @param means  of two cells, deg
jobs::ResidualPlane plane(double cell, double means) {
  jobs::ResidualPlane own;
  own.map.cell = deg(cell);
  own.map.x = {deg(5), deg(15), deg(25)};
  own.map.y = {deg(85), deg(95), deg(95)};
  own.map.count = {2000, 2990, 7};
  own.map.mean_azimuth = {deg(means), deg(-means), deg(9)};
  own.map.mean_zenith = {deg(-means), deg(means), deg(9)};
  own.map.shots = kShots - kOutliers;
  own.fewest_shots = 200;
  own.azimuth_noise = deg(0.0001);
  own.zenith_noise = deg(0.00012);
  return own;
}

estimation::PiecewiseEstimate pieces() {
  estimation::PiecewiseEstimate own;
  own.duration = 0.25;
  own.chi2 = 1.04;
  own.degrees_of_freedom = 54;
  own.value.resize(3);
  own.sigma.resize(3);
  for (std::size_t i = 0; i < kPieces; ++i) {
    own.time.push_back(0.125 + 0.25 * static_cast<double>(i));
    for (std::size_t k = 0; k < 3; ++k) {
      own.value[k].push_back(estimate().parameters[static_cast<Eigen::Index>(k)]);
      own.sigma[k].push_back(deg(0.01));
    }
  }
  return own;
}

jobs::EstimateDetails details() {
  jobs::EstimateDetails d;
  d.advice = {"wedge_angle_deg cannot be separated from refractive_index: keep it fixed"};
  d.pieces = pieces();
  for (const double speed : {-27990.0, 43770.0}) {
    jobs::RotorSpeed own;
    own.mean = deg(speed);
    for (std::size_t i = 0; i < kStates; ++i) {
      own.change.push_back(deg(2) * std::sin(0.1 * static_cast<double>(i)));
    }
    own.moments = moments(kStates, 0, deg(1.4));
    d.speeds.push_back(own);
  }
  d.residuals_over_field = plane(1, 0.0003);
  d.residuals_over_angles = {{0, 1, plane(10, 0.0002)}};
  d.density = {0.5, deg(0.5), {deg(0.25), deg(0.75)}, {deg(90.25), deg(90.25)}, {200, 300},
               500, 250};
  return d;
}

EstimatedRecording example() {
  EstimatedRecording found;
  found.recording.path = "folder/unit <1>.lvx";
  found.recording.header.format = "lvx-1.1";
  found.recording.header.devices.emplace_back();
  found.recording.audit.observations = 5200;
  found.recording.audit.shots = 5100;
  found.recording.audit.no_return = 100;
  found.recording.audit.duration_s = 5;
  found.recording.audit.rate_hz = 1000;
  found.choice.sensor = found.nominal = sensors::load_sensor("mid-40");
  found.choice.words = "the file says so";
  found.estimate = estimate();
  found.head = shots();
  found.details = details();
  estimation::NoiseModel& noise = found.noise_model.emplace();
  noise.azimuth = deg(0.005);
  noise.zenith = deg(0.0052);
  noise.direction = deg(0.0051);
  noise.range_distance = 20;
  noise.range = 0.02;
  noise.range_source = "the manual";
  noise.shared_direction = deg(0.1);
  noise.shared_direction_source = "its tolerance";
  found.provenance = {{"command", "risley estimate \"unit <1>.lvx\""}, {"version", "0.1.0"}};
  return found;
}

estimation::Evaluation truth() {
  estimation::Evaluation own;
  own.parameters = {{"refractive_index", 1.51018, 2e-5, 0.33},
                    {"prism_tilt_b_vertical_deg", deg(0.06), deg(0.06), 5},
                    {"rotation_angle_a_deg", deg(12.45), deg(0.05), kNaN}};
  own.rotation_angle_error.assign(2, std::vector<double>(kStates, deg(0.02)));
  own.rotation_angle_rmse = {deg(0.021), deg(0.034)};
  own.angular_velocity_rmse = {deg(0.5), deg(0.6)};
  own.rotation_angle_rmse_over_sigma = own.angular_velocity_rmse_over_sigma = {1.1, 0.9};
  own.nees_parameters = 1.23;
  own.nees_rotation_angles = 0.98;
  return own;
}

void fail(EstimatedRecording& found, estimation::EstimateCode code) {
  Estimate& e = found.estimate;
  e.converged = false;
  e.reason = "the model does not describe <these> data";
  e.verdict = {code, e.reason, "check that the sensor stood still"};
  found.details->pieces.reset();
  found.details->advice.clear();
}

/// The page of report.json.
std::string page(const EstimatedRecording& found) {
  return report_page(parse_report(report_text(report_of(found)), "report.json"));
}

TEST(EstimatePage, MatchesItsGoldenText) {
  using estimation::EstimateCode;
  testing::GoldenPage golden("estimate", page(example()));
  const auto differs = [&](const std::string& when,
                           const std::function<void(EstimatedRecording&)>& change) {
    EstimatedRecording found = example();
    change(found);
    golden.differs(when, page(found));
  };
  differs("the truth is known", [](EstimatedRecording& found) {
    found.evaluation = truth();
    found.details->rotation_angle_errors.assign(2, moments(kStates, deg(0.02), deg(0.003)));
  });
  differs("unusual, with warnings", [](EstimatedRecording& found) {
    found.estimate.verdict = {EstimateCode::unusual, "the noise is large", "compare recordings"};
    found.estimate.warnings = {{kWarning.unusual_noise, "the directions are <noisy>"}};
    found.warnings = {{kWarning.shots_lost, "a gap of 2 s", {{}, 3}}};
  });
  differs("nothing held, noise given, one outlier", [](EstimatedRecording& found) {
    Estimate& e = found.estimate;
    for (estimation::EstimatedValue& value : e.values) value.sigma = value.sigma_given_held;
    e.noise_held = true;
    e.outliers = 1;
    e.outlier[1000] = e.outlier[2000] = 0;
  });
  differs("mirrored and turned, the other combination", [](EstimatedRecording& found) {
    Estimate& e = found.estimate;
    e.sensor.combination = 2;
    e.mirrored = true;
    e.frame_turn.emplace().turn = {deg(30), deg(-20)};
  });
  differs("no combination, one piece failed", [](EstimatedRecording& found) {
    found.estimate.sensor.combination.reset();
    found.details->pieces->failed = 1;
  });
  differs("a rotor that stood still",
          [](EstimatedRecording& found) { found.details->speeds[1].moments.std = 0; });
  differs("not converged", [](EstimatedRecording& found) {
    fail(found, EstimateCode::inconsistent);
    found.estimate.warnings = {{kWarning.mirrored, "the recording is a mirror image"}};
  });
  differs("not determined", [](EstimatedRecording& found) {
    fail(found, EstimateCode::undecided);
    found.estimate.unobservable = {
        {{{"refractive_index", 0.8}, {"prism_tilt_b_vertical_deg", -0.6}}, 1e-9, 40}};
  });
  differs("no residual", [](EstimatedRecording& found) {
    fail(found, EstimateCode::undecided);
    Estimate& e = found.estimate;
    e.azimuth_moments = e.zenith_moments = {0, kNaN, kNaN, kNaN, kNaN, kNaN};
    e.unit_variance = e.variance_factor = kNaN;
    e.residuals_over_angle[0].chi2_per_bin = kNaN;
    e.covariance.setConstant(kNaN);
    for (estimation::EstimatedValue& value : e.values) value.sigma = value.sigma_given_held = kNaN;
  });
}

}  // namespace risley::report::estimate_page_test
