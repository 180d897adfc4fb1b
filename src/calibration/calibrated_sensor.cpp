// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/calibrated_sensor.hpp"

#include <cmath>

#include "risley/algebra/products.hpp"

namespace risley::calibration {

using Eigen::Index;

namespace {

/// Its row behind those of the parameters.
void add_range_offset(const PlanarSolution& solution, const Calibration& result,
                      sensors::Sensor& sensor) {
  const Index n = result.covariance.rows();
  sensor.covariance_names.emplace_back("range_offset_m");
  sensor.set_knowledge({"range_offset_m", result.range_offset_sigma,
                        "calibrated on plane walls by risley calibrate",
                        result.range_offset_total_sigma()});
  sensor.covariance.col(n).head(n) = solution.range_offset_covariance * result.variance_factor;
  sensor.covariance.row(n).head(n) = sensor.covariance.col(n).head(n).transpose();
  sensor.covariance(n, n) = result.range_offset_sigma * result.range_offset_sigma;
}

}  // namespace

sensors::Sensor calibrated_sensor(const CalibrationOptions& options, const Belief& belief,
                                  const PlanarSolution& solution, const Calibration& result,
                                  const Held& held) {
  sensors::Sensor sensor = options.sensor;
  sensor.train = solution.problem.train;
  sensor.angular_velocity = belief.sensor.angular_velocity;
  sensor.combination = belief.sensor.combination;
  sensor.provenance.clear();
  sensor.covariance_names.clear();
  if (!options.beam_origin) sensor.set_prism_geometry({});
  for (const sensors::Knowledge& known : belief.sensor.knowledge) {
    const bool speed = known.name.starts_with("angular_velocity");
    const bool material = known.name.starts_with("refractive_index");
    if (speed || material) sensor.set_knowledge(known);
  }
  for (std::size_t j = 0; j < result.free.size(); ++j) {
    const auto at = static_cast<Index>(j);
    sensor.covariance_names.push_back(result.free[j].name);
    sensor.set_knowledge({result.free[j].name, std::sqrt(result.covariance(at, at)),
                          "calibrated on plane walls by risley calibrate", result.total_sigma(j)});
  }
  sensor.reference = sensors::CalibrationReference::planes;
  sensor.range_offset = solution.problem.range_offset;
  std::erase_if(sensor.knowledge,
                [](const sensors::Knowledge& entry) { return entry.name == "range_offset_m"; });
  const bool offset = result.range_offset_sigma > 0;
  const Index n = result.covariance.rows(), first = n + (offset ? 1 : 0),
              all = first + static_cast<Index>(held.moved.size());
  sensor.covariance = Eigen::MatrixXd::Zero(all, all);
  sensor.covariance.topLeftCorner(n, n) = result.covariance;
  if (offset) add_range_offset(solution, result, sensor);
  // With what was held as quantities of their own, beams are as sure as they are: an error of one
  // and what it does to the others cancel in them.
  Eigen::MatrixXd movement = Eigen::MatrixXd::Zero(all, result.held_changes.cols());
  if (movement.cols() == 0) return sensor;
  movement.topRows(n) = result.held_changes;
  if (offset) movement.row(n) = result.range_offset_held_changes.transpose();
  for (std::size_t i = 0; i < held.moved.size(); ++i) {
    sensor.covariance_names.push_back(held.moved[i].name);
    movement.row(first + static_cast<Index>(i)) = held.moved[i].by_held;
  }
  for (std::size_t h = 0; h < held.moves_optics.size(); ++h) {
    if (!held.moves_optics[h]) movement.col(static_cast<Index>(h)).setZero();
  }
  sensor.covariance +=
      algebra::propagated(movement, Eigen::MatrixXd::Identity(movement.cols(), movement.cols()));
  return sensor;
}

}  // namespace risley::calibration
