// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/rotor_tracking.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <span>
#include <utility>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/estimation/parameter_agreement.hpp"
#include "risley/sensors/prism_sizes.hpp"

namespace risley::cloud {
namespace {

using Eigen::Index;
using estimation::kStatesPerRotor;
using sensors::CalibrationReference;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
/// Largest departure of a rotor from the parabola of a knot until the next, 1 sigma, rad: a
/// hundredth of the angles' uncertainty, see kTrackingRate.
constexpr double kParabola = radians_from_degrees(2e-5);

/// Fewer knots are faster: the longest interval over which these rotors move along parabolas.
double knot_interval(const std::vector<estimation::RotorProcess>& process) {
  double longest = estimation::kKnotInterval;
  for (const double times : {2.0, 3.0, 5.0}) {
    const double interval = times * estimation::kKnotInterval;
    const bool smooth = std::ranges::all_of(process, [interval](const auto& rotor) {
      return step_covariance(rotor, interval / 2).angle_angle < kParabola * kParabola;
    });
    if (smooth) longest = interval;
  }
  return longest;
}

/// Free parameters of the belief: those with a covariance in the calibration, if it is one against
/// directions, otherwise the default ones.
void choose_parameters(const sensors::Sensor& calibration, estimation::EstimateOptions& options) {
  if (calibration.reference != CalibrationReference::directions) return;
  const auto defaults =
      estimation::default_free_names(calibration.shape(), estimation::one_glass(calibration.train));
  const auto& names = calibration.covariance_names;
  for (const std::string& name : defaults) {
    if (std::ranges::find(names, name) == names.end()) options.fixed.push_back(name);
  }
  for (const std::string& name : names) {
    if (name == "range_offset_m" || sensors::find_prism_size(name, calibration.prisms())) continue;
    if (find_parameter(name, calibration.shape()).kind != ParameterKind::train) continue;
    if (std::ranges::find(defaults, name) == defaults.end()) {
      options.additional.push_back(name);
    }
  }
}

/// A calibration against directions must describe those of the recording.
void check_same_sensor(const estimation::Estimate& estimate, const sensors::Sensor& calibration) {
  const Index n = estimate.free.size();
  if (n == 0) return;
  Eigen::VectorXd off(n);
  Eigen::MatrixXd covariance = estimate.covariance;
  std::vector<Index> rows;
  for (Index j = 0; j < n; ++j) {
    const auto& free = estimate.free[j];
    const auto& names = calibration.covariance_names;
    const auto at = std::ranges::find(names, free.name);
    if (at == names.end()) return;
    rows.push_back(at - names.begin());
    off[j] = estimate.parameters[j] - calibration.train[free.places.front()];
  }
  covariance += Eigen::MatrixXd(calibration.covariance(rows, rows));
  const estimation::Disagreement apart = estimation::disagreement(off, covariance);
  if (apart.same_sensor()) return;
  const ParameterInfo& info = find_parameter(estimate.free[apart.worst].name, calibration.shape());
  throw EstimationError(fmt::format(
      "the calibration is of another sensor: according to the recording's directions, {} is {:.4g} "
      "{} away from the calibration's, {:.3g} sigma",
      info.name, off[apart.worst] / info.si_per_unit, info.unit, apart.worst_over_sigma));
}

/// Ranges and the beam's origin need the sensor's frame, and a roll cannot be found.
[[noreturn]] void refuse_frame(const estimation::Estimate& estimate) {
  const estimation::FrameTurn& turn = estimate.frame_turn->turn;
  throw EstimationError(fmt::format(
      "the recording's frame is not the sensor's: shots lie outside the field of view, and its "
      "axis is turned by {:.3f} deg in {} and {:.3f} deg in {} (a turn about it cannot be "
      "found){}; points need the complete rotation: state it with {} YAW,PITCH,ROLL",
      degrees_from_radians(turn.yaw), turn.axis_up ? "pitch" : "yaw",
      degrees_from_radians(turn.pitch), turn.axis_up ? "roll" : "pitch",
      estimate.converged ? "" : ", though the estimate failed: " + estimate.reason,
      name_of(kSetting.extrinsics)));
}

}  // namespace

SensorBelief sensor_belief(const estimation::AngleSeries& beginning,
                           const estimation::AngleSeries& head, const sensors::Sensor& calibration,
                           std::optional<double> angle_noise, const Progress& progress) {
  if (angle_noise) require_above("angle noise", *angle_noise, 0, "rad");
  estimation::EstimateOptions options;
  options.sensor = calibration;
  options.angle_noise = angle_noise;
  choose_parameters(calibration, options);
  const estimation::Estimate estimate = [&] {
    try {
      return estimation::estimate(estimation::Method::map, beginning, head, options, progress);
    } catch (const EstimationError& error) {
      throw EstimationError(fmt::format("the rotation angles were not found: {}", error.what()));
    }
  }();
  if (estimate.frame_turn) refuse_frame(estimate);
  if (!estimate.converged) {
    throw EstimationError(fmt::format(
        "the rotation angles were not found, or the calibration is of another sensor: {}",
        estimate.reason));
  }
  SensorBelief belief;
  belief.sensor = estimate.sensor;
  belief.free = estimate.free;
  belief.covariance = estimate.covariance;
  belief.angle_sensitivity = estimate.common_angles->sensitivity;
  belief.rotor_process = estimate.rotor_process;
  belief.start = estimate.start;
  belief.angle_noise = usable_noise(estimate.noise.value).rms();
  belief.residual_variance_factor = std::max(1.0, estimate.unit_variance);
  belief.mirrored = estimate.mirrored;
  belief.warnings = estimate.warnings;
  if (calibration.reference == CalibrationReference::directions) {
    check_same_sensor(estimate, calibration);
    belief.sensor.train = calibration.train;
  }
  belief.start.train = belief.sensor.train;
  return belief;
}

RotorTracker::RotorTracker(const SensorBelief& belief, std::optional<double> rate)
    : belief_(belief), rate_(rate), knot_interval_(knot_interval(belief.rotor_process)) {
  if (rate) require_above("rate", *rate, 0, "Hz");
  require_length("rotor_process", belief.rotor_process.size(), belief.sensor.prisms());
  require_above("angle noise", belief.angle_noise, 0, "rad");
}

estimation::Start RotorTracker::start_of(const estimation::AngleSeries& series,
                                         const estimation::AngleSeries& head) const {
  const std::int64_t time = series.time_ns.front();
  const auto& knots = solution_.trajectory;
  if (knots.size() == 0 && belief_.start.time_ns >= time &&
      belief_.start.time_ns <= series.time_ns.back()) {
    return belief_.start;
  }
  // The previous piece ends where this one begins: continue from there.
  for (std::size_t knot = knots.size(); knot-- > 0;) {
    const double seconds = 1e-9 * static_cast<double>(time - knots.time_ns[knot]);
    if (std::abs(seconds) > reach()) continue;
    estimation::Start start = belief_.start;
    start.time_ns = time;
    for (std::size_t k = 0; k < start.rotation_angle.size(); ++k) {
      start.rotation_angle[k] = knots.angle(knot, k, seconds);
      start.angular_velocity[k] = knots.speed(knot, k, seconds);
    }
    return start;
  }
  return estimation::find_start(head, belief_.sensor, {{}, belief_.angle_noise, false, false});
}

double RotorTracker::reach() const { return 2.0 * knot_interval_ + (rate_ ? 1.0 / *rate_ : 0.0); }

void RotorTracker::track(const recordings::Observations& rows) {
  estimation::ShotSelector selector({rate_, false, true});
  selector.add(rows);
  const estimation::AngleSeries& series = selector.series();
  if (series.size() == 0) throw EstimationError("no valid shot");
  estimation::BatchMapOptions options;
  options.angle_noise = estimation::equal_noise(belief_.angle_noise);
  options.rotor_process = belief_.rotor_process;
  options.knot_interval = knot_interval_;
  const estimation::Start start = start_of(series, selector.head());
  solution_ = {};
  solution_ = run_batch_map(series, start, belief_.sensor, options);
  first_row_.clear();
  for (const std::size_t shot : solution_.trajectory.first_shot) {
    first_row_.push_back(selector.rows()[shot]);
  }
}

void RotorTracker::angles(const recordings::Observations& piece, std::span<const std::size_t> rows,
                          std::vector<std::vector<double>>& angle,
                          std::vector<std::vector<double>>& covariance) const {
  const auto prisms = static_cast<std::size_t>(belief_.sensor.prisms());
  if (!rows.empty()) require_place("row", rows.back(), piece.size());
  require_length("angle", angle.size(), prisms);
  require_length("covariance", covariance.size(), prisms * (prisms + 1) / 2);
  for (const auto& column : angle) require_length("angle of a prism", column.size(), rows.size());
  for (const auto& column : covariance) {
    require_length("covariance of two prisms", column.size(), rows.size());
  }
  const estimation::RotorTrajectory& knots = solution_.trajectory;
  const double farthest = reach();
  constexpr std::size_t kTerms = 5;  // a covariance of angles is a polynomial of 4th degree in time
  std::vector<std::array<double, kTerms>> terms(covariance.size());
  std::size_t knot = 0;
  if (!rows.empty() && knots.size() > 0) {
    const auto after = std::ranges::upper_bound(first_row_, rows.front());
    knot = static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - first_row_.begin() - 1, 0));
  }
  std::size_t prepared = static_cast<std::size_t>(-1);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    while (knot + 1 < knots.size() && first_row_[knot + 1] <= rows[i]) ++knot;
    const std::int64_t time = piece.time_ns[rows[i]];
    std::size_t near = knot;
    // The border between two knots lies between the chosen shots, not at the first of them.
    if (knot + 1 < knots.size() &&
        std::llabs(knots.time_ns[knot + 1] - time) < std::llabs(knots.time_ns[knot] - time)) {
      ++near;
    }
    const double t = knots.size() > 0 ? 1e-9 * static_cast<double>(time - knots.time_ns[near])
                                      : std::numeric_limits<double>::infinity();
    if (std::abs(t) > farthest) {
      for (auto& column : angle) column[i] = kNaN;
      for (auto& column : covariance) column[i] = kNaN;
      continue;
    }
    if (near != prepared) {
      prepared = near;
      std::size_t pair = 0;
      for (std::size_t k = 0; k < prisms; ++k) {
        for (std::size_t l = k; l < prisms; ++l) {
          terms[pair++] = knots.angle_covariance_terms(near, k, l);
        }
      }
    }
    for (std::size_t k = 0; k < prisms; ++k) angle[k][i] = knots.angle(near, k, t);
    for (std::size_t pair = 0; pair < terms.size(); ++pair) {
      const auto& c = terms[pair];
      covariance[pair][i] = c[0] + t * (c[1] + t * (c[2] + t * (c[3] + t * c[4])));
    }
  }
}

}  // namespace risley::cloud
