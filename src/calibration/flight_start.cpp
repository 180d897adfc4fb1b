// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/flight_start.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include <Eigen/Geometry>

#include "risley/algebra/rotation_vector.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/calibration/calibration_plan.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/saturating.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The process of a trajectory's errors by the recording's clock.
trajectories::ErrorProcess process_of(const trajectories::ErrorModel& errors,
                                      trajectories::Trajectory local,
                                      const trajectories::Mount& mount) {
  trajectories::require_mount(mount);
  const std::int64_t clock_ns = std::llround(mount.clock_offset.value * 1e9);
  for (std::int64_t& time_ns : local.time_ns) {
    time_ns = saturating_difference(time_ns, clock_ns);
  }
  return {errors, local};
}

void require_flight_options(const FlightCalibrationOptions& options) {
  require_above("range noise", options.range_noise.value_or(options.sensor.range_noise), 0, "m");
  require_not_below("sigma of the range offset", options.range_offset_sigma, 0, "m");
  require_above("prior sigma of angles", options.angle_sigma, 0, "rad");
  require_not_below("noise of the rotation angles", options.rotation_angle_sigma, 0, "rad");
  require_above("spacing of the knots", options.knot_spacing, 0, "s");
  require_at_least("most knots", options.most_knots, 2);
  require_between("size of a cell", options.cell_size, 0.1, 100, "m");
  require_threshold("most roughness", options.most_roughness);
  require_at_least("coarse shots", options.coarse_shots, 1000);
  require_at_least("many shots", options.many_shots, 1000);
}

void set_model(const FlightCalibrationOptions& options, FlightStart& start) {
  const sensors::Sensor& sensor = options.sensor;
  start.model.train = sensor.train;
  start.model.geometry = sensor.geometry;
  start.model.nominal = options.mount.nominal;
  Eigen::Vector3d boresight;
  for (Index i = 0; i < 3; ++i) {
    boresight[i] = options.mount.boresight[i].value;
    start.model.lever_arm[i] = options.mount.lever_arm[i].value;
  }
  start.model.boresight = algebra::rotation_by(boresight);
  start.model.range_offset = sensor.range_offset;
  start.model.clock_offset = options.mount.clock_offset.value;
  AdjustedParameters adjusted =
      adjusted_parameters(sensor, options.fixed, options.additional, std::nullopt);
  start.model.free = std::move(adjusted.free);
  for (estimation::FreeParameter& parameter : start.model.free) {
    const sensors::Knowledge* known = sensor.find_knowledge(parameter.name);
    if (known != nullptr && known->sigma > 0) {
      parameter.prior_sigma = std::max(known->sigma, known->total_sigma);
    } else if (find_parameter(parameter.name, sensor.shape()).unit == "deg") {
      parameter.prior_sigma = options.angle_sigma;
    }
  }
  // Held quantities that may be off are included: indices above all. Air and wedges are held by
  // convention, and the index that a recording determines belongs to them; the beam depends on all
  // of them together.
  for (estimation::FreeParameter& held : estimation::uncertain_held(sensor, start.model.free)) {
    if (held.name.starts_with("wedge_angle") || held.name == "refractive_index_air") continue;
    start.model.free.push_back(std::move(held));
    ++start.considered;
  }
}

void set_priors(const FlightCalibrationOptions& options, FlightStart& start) {
  const Index globals = start.model.unknowns().size();
  start.priors.mean = unknown_values(start.model);
  start.prior_sigma = VectorXd::Zero(globals);
  for (Index i = 0; i < 3; ++i) {
    start.prior_sigma[i] = options.mount.boresight[i].sigma;
    start.prior_sigma[3 + i] = options.mount.lever_arm[i].sigma;
  }
  start.prior_sigma[FlightUnknowns::range_offset()] = options.range_offset_sigma;
  start.prior_sigma[FlightUnknowns::clock_offset()] = options.mount.clock_offset.sigma;
  for (std::size_t j = 0; j < start.model.free.size(); ++j) {
    start.prior_sigma[FlightUnknowns::parameter(static_cast<int>(j))] =
        start.model.free[j].prior_sigma;
  }
  // A calibration's covariance, and that of a mount from the same adjustment, replace the single
  // sigmas.
  MatrixXd covariance = start.prior_sigma.cwiseAbs2().asDiagonal();
  const sensors::Sensor& sensor = options.sensor;
  require_length("rows of the sensor's covariance", sensor.covariance.rows(),
                 sensor.covariance_names.size());
  require_length("columns of the sensor's covariance", sensor.covariance.cols(),
                 sensor.covariance_names.size());
  const algebra::NamedCovariance stated =
      trajectories::joint_covariance({sensor.covariance_names, sensor.covariance}, options.mount);
  const std::vector<std::string> names = unknown_names(start.model);
  std::vector<std::pair<Index, Index>> known;  // unknown, its row in the stated covariance
  const Index adjusted = globals - static_cast<Index>(start.considered);
  for (std::size_t i = 0; i < stated.names.size(); ++i) {
    const auto at = std::ranges::find(names, stated.names[i]) - names.begin();
    if (at >= adjusted) continue;
    if (at == FlightUnknowns::range_offset() && options.range_offset_sigma == 0) continue;
    known.emplace_back(at, static_cast<Index>(i));
  }
  for (const auto& [i, row] : known) {
    for (const auto& [j, column] : known) covariance(i, j) = stated.matrix(row, column);
    start.prior_sigma[i] = std::sqrt(covariance(i, i));
  }
  // Quantities with a sigma of 0 are held; any information keeps the matrix regular.
  for (Index i = 0; i < globals; ++i) {
    if (!(start.prior_sigma[i] > 0)) covariance(i, i) = 1;
  }
  const algebra::SymmetricSolver solver(covariance);
  if (!solver.positive()) {
    throw InvalidArgument("the covariance of the sensor's parameters is not positive definite");
  }
  start.priors.information = solver.inverse();
}

}  // namespace

FlightStart flight_start(const FlightCalibrationOptions& options,
                         const trajectories::Trajectory& local) {
  FlightStart start{.model = {},
                    .priors = {.process = process_of(options.errors, local, options.mount),
                               .mean = {},
                               .information = {}},
                    .prior_sigma = {}};
  require_flight_options(options);
  set_model(options, start);
  set_priors(options, start);
  return start;
}

std::vector<bool> held_globals(const FlightStart& start) {
  const auto globals = static_cast<std::size_t>(start.model.unknowns().size());
  std::vector<bool> held(globals);
  for (std::size_t i = 0; i < globals; ++i) {
    held[i] = !(start.prior_sigma[i] > 0) || i >= globals - start.considered;
  }
  return held;
}

double stated_range_variance(const FlightCalibrationOptions& options) {
  const double noise = options.range_noise.value_or(options.sensor.range_noise);
  const double rounding = options.sensor.range_resolution / std::sqrt(12.0);
  return noise * noise + rounding * rounding;
}

FlightWeights flight_weights(const FlightCalibrationOptions& options, const FlightPriors& priors,
                             double range_variance) {
  FlightWeights weights;
  weights.range_variance = range_variance;
  weights.rotation_angle_variance = options.rotation_angle_sigma * options.rotation_angle_sigma;
  if (priors.process.sample_interval() == 0) return weights;
  weights.sample_interval = priors.process.sample_interval();
  for (int c = 0; c < kCorrections; ++c) {
    weights.white[c] = priors.process.white()[static_cast<Index>(error_of(c))];
  }
  return weights;
}

double final_knot_spacing(const FlightCalibrationOptions& options, const TrajectoryKnots& knots,
                          std::size_t strips) {
  double flown = 0;
  for (const TrajectoryKnots::Interval& interval : knots.intervals) {
    flown += static_cast<double>(interval.end_ns - interval.begin_ns) * 1e-9;
  }
  const double room =
      std::max(1.0, static_cast<double>(options.most_knots) - static_cast<double>(strips));
  return std::max(options.knot_spacing, flown / room);
}

}  // namespace risley::calibration
