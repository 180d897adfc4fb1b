// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT

#include "calibration/flight_findings.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/core/setting.hpp"

#include "calibration/flight_words.hpp"
#include "calibration/verdict.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

/// Attitudes count as late beyond this many sigmas, since few flights determine a delay well.
constexpr double kDelaySigmas = 3;
/// The clock offset contradicts its statement beyond this many sigmas.
constexpr double kClockSigmas = 4;

/// Names of the corrections in the words of a trajectory.
trajectories::PoseAccuracy accuracy_of(const Eigen::Matrix<double, kCorrections, 1>& sigma,
                                       double heading) {
  const auto of = [&](trajectories::PoseError error) {
    int c = 0;
    while (error_of(c) != error) ++c;
    return sigma[c];
  };
  using trajectories::PoseError;
  const double along = std::cos(heading), across = std::sin(heading);
  const double north = of(PoseError::tilt_north), east = of(PoseError::tilt_east);
  return {{of(PoseError::north), of(PoseError::east), of(PoseError::up)},
          std::hypot(along * north, across * east),
          std::hypot(across * north, along * east),
          of(PoseError::heading)};
}

}  // namespace

void fill_mount_and_sensor(const FlightCalibrationOptions& options, const FlightModel& model,
                           const std::vector<bool>& held, std::size_t considered,
                           FlightCalibration& c) {
  const Index globals = model.unknowns().size();
  const std::vector<std::string> names = unknown_names(model);
  const Eigen::VectorXd values = unknown_values(model);
  c.mount = options.mount;
  const auto found = [&](trajectories::StatedValue& stated, Index i) {
    if (held[i]) return;
    stated = {values[i], std::sqrt(c.covariance(i, i)), "calibrated in flight by risley"};
  };
  for (Index i = 0; i < 3; ++i) {
    found(c.mount.boresight[i], i);
    found(c.mount.lever_arm[i], 3 + i);
  }
  found(c.mount.clock_offset, FlightUnknowns::clock_offset());
  sensors::Sensor& sensor = c.sensor;
  sensor = options.sensor;
  sensor.train = model.train;
  sensor.range_offset = model.range_offset;
  sensor.reference = sensors::CalibrationReference::planes;
  sensor.provenance.clear();
  std::vector<Index> of_mount_rows, of_sensor_rows;
  for (Index i = 0; i < globals; ++i) {
    const bool adjusted = !held[i];
    const std::string& name = names[i];
    if (i < FlightUnknowns::range_offset() || i == FlightUnknowns::clock_offset()) {
      if (adjusted) of_mount_rows.push_back(i);
      continue;
    }
    if (!adjusted && i < globals - static_cast<Index>(considered)) continue;
    of_sensor_rows.push_back(i);
    if (adjusted) {
      sensor.set_knowledge(
          {name, std::sqrt(c.covariance(i, i)), "calibrated in flight by risley calibrate", 0});
    }
  }
  const auto named = [&](const std::vector<Index>& rows) {
    algebra::NamedCovariance some;
    for (const Index i : rows) some.names.push_back(names[i]);
    some.matrix = c.covariance(rows, rows);
    return some;
  };
  algebra::NamedCovariance own = named(of_sensor_rows);
  sensor.covariance_names = std::move(own.names);
  sensor.covariance = std::move(own.matrix);
  std::vector<Index> all_rows = of_mount_rows;
  all_rows.insert(all_rows.end(), of_sensor_rows.begin(), of_sensor_rows.end());
  c.mount.covariance = named(all_rows);
}

void judge_clock_drift(double value, double sigma, double seconds, FlightCalibration& c) {
  ClockDrift& found = c.clock_drift;
  found.value = value;
  found.sigma = sigma;
  found.seconds = seconds;
  found.significant = std::abs(found.value) > kTestedSigmas * found.sigma;
  if (!found.significant) return;
  warn(c.warnings, kWarning.clocks_disagree,
       "the clocks of sensor and trajectory drift apart: the trajectory's gains {:.2g} +- {:.1g} "
       "ppm on the recording's, {:.2g} ms over the {:.0f} s between the first shot and the last. A "
       "constant clock offset cannot describe that, and the results are off by more than their "
       "sigmas. Synchronise the sensor's clock by PPS or PTP, or calibrate shorter parts of the "
       "flight",
       1e6 * found.value, 1e6 * found.sigma, 1e3 * found.value * found.seconds, found.seconds);
}

void judge_attitude_delay(double value, double sigma, FlightCalibration& c) {
  AttitudeDelay& found = c.attitude_delay;
  found.value = value;
  found.sigma = sigma;
  found.significant = std::abs(found.value) > kDelaySigmas * found.sigma;
  if (!found.significant) return;
  warn(c.warnings, kWarning.clocks_disagree,
       "{}; a clock offset moves positions and attitudes together and cannot describe that, so "
       "clock offset and lever arm are off by more than their sigmas. Correct the time stamps of "
       "the attitudes, and calibrate again",
       in_words(found));
}

void judge_clock_offset(FlightCalibration& c) {
  const FlightUnknown& clock = c.unknowns[FlightUnknowns::clock_offset()];
  if (clock.held) return;
  c.clock_contradicts = std::abs(clock.value - clock.start) >
                        kClockSigmas * std::hypot(clock.prior_sigma, clock.sigma);
  if (c.clock_contradicts) {
    warn(c.warnings, kWarning.clocks_disagree,
         "{}; correct the times or the mount's values for them", clock_in_words(c));
  }
}

void judge_held(HeldParameter held, const sensors::Sensor& sensor, FlightCalibration& c) {
  held.significant = std::abs(held.from_flight - held.held) >
                     kTestedSigmas * std::hypot(held.sigma, held.stated_sigma);
  if (held.significant) {
    warn(c.warnings, kWarning.held_contradicted,
         "the strips contradict held values: {}; the results are off by more than their sigmas. "
         "Estimate it as well ({})",
         in_words(held, sensor), name_of(kSetting.free));
  }
  c.held.push_back(std::move(held));
}

void judge_control(const scenes::KnownGround& ground, SeenControl seen, FlightCalibration& c) {
  seen.significant = seen.used && std::abs(seen.off) > kTestedSigmas * seen.sigma;
  if (!seen.used) {
    warn(c.warnings, kWarning.control_doubtful,
         "known ground \"{}\" is left out: {} shots within {:g} m of it{}", ground.name, seen.shots,
         ground.radius,
         seen.shots < GroundCellOptions{}.least_shots
             ? fmt::format(", at least {} are needed; is it on the stated map?",
                           GroundCellOptions{}.least_shots)
             : " are not on a plane");
  } else if (seen.significant) {
    warn(c.warnings, kWarning.control_doubtful,
         "known ground \"{}\" contradicts the flight: the strips place it {:.3f} m {} the stated "
         "value, {:.0f} of its sigmas. Is the place right, and is the ground flat within {:g} m of "
         "it?",
         ground.name, std::abs(seen.off), seen.off > 0 ? "above" : "below",
         std::abs(seen.off) / seen.sigma, ground.radius);
  }
  c.control.push_back(std::move(seen));
}

void warn_of_trajectory(std::int64_t begin_ns, FlightCalibration& c) {
  const TrajectoryFit& fit = c.trajectory_fit;
  for (const TrajectoryJump& jump : fit.jumps) {
    warn(c.warnings, kWarning.trajectory_jumps,
         "{}; it has a step of its own in the adjustment. Is there a loss of the GNSS fix, or an "
         "alignment, in the trajectory's log?",
         in_words(jump, begin_ns));
  }
  for (int i = 0; i < kCorrections; ++i) {
    if (fit.factor[i] == 1) continue;
    warn(c.warnings, kWarning.trajectory_errors,
         "the trajectory's error {} is {:.2g} times as large as stated (chi2 of its corrections "
         "{:.3g}, {:.3g} expected); the adjustment assumes the larger value, and so do the sigmas",
         correction_name(i), fit.factor[i], fit.chi2[i], fit.expected[i]);
  }
  if (!fit.fits) c.warnings.push_back({kWarning.model_incomplete, misfit_in_words(c)});
}

trajectories::Trajectory corrected(const trajectories::Trajectory& trajectory,
                                   const FlightModel& model,
                                   const trajectories::ErrorProcess& process,
                                   const Eigen::MatrixXd& sigma) {
  trajectories::Trajectory corrected = trajectory;
  corrected.accuracy.resize(corrected.size());
  const auto clock_ns = static_cast<std::int64_t>(std::llround(model.clock_offset * 1e9));
  for (std::size_t i = 0; i < corrected.size(); ++i) {
    const Eigen::Matrix<double, kCorrections, 1> error =
        correction_at(model.knots, model.corrections, process, corrected.time_ns[i] - clock_ns);
    corrected.position[i] += error.head<3>();
    corrected.attitude[i] =
        (Eigen::Quaterniond(algebra::rotation_by(error.tail<3>())) * corrected.attitude[i])
            .normalized();
    corrected.accuracy[i] = accuracy_of(
        correction_sigma_at(model.knots, sigma, process, corrected.time_ns[i] - clock_ns),
        trajectories::roll_pitch_heading(corrected.frame, corrected.position[i],
                                         corrected.attitude[i])
            .heading);
  }
  return corrected;
}

}  // namespace risley::calibration
