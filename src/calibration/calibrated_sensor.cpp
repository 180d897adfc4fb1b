// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/calibrated_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "risley/algebra/products.hpp"

namespace risley::calibration {

using Eigen::Index;

namespace {

/// Its row behind those of the parameters.
void add_range_offset(const PlanarSolution& solution, const Calibration& result,
                      sensors::Sensor& sensor) {
  const Index n = result.covariance.rows();
  sensor.set_knowledge({"range_offset_m", result.range_offset_sigma,
                        "calibrated on plane walls by risley calibrate",
                        result.range_offset_total_sigma()});
  sensor.covariance.col(n).head(n) = solution.range_offset_covariance * result.variance_factor;
  sensor.covariance.row(n).head(n) = sensor.covariance.col(n).head(n).transpose();
  sensor.covariance(n, n) = result.range_offset_sigma * result.range_offset_sigma;
}

/// Places in belief.free of the materials that the recordings determined and the solution
/// considers.
std::vector<Index> considered_materials(const Belief& belief, const PlanarSolution& solution) {
  std::vector<Index> materials;
  for (Index j = 0; j < solution.considered.parameters.cols(); ++j) {
    const int place = belief.free[static_cast<std::size_t>(j)].places.front();
    if (is_held_material(place, solution.problem)) materials.push_back(j);
  }
  return materials;
}

/// The row of a name behind those of parameters and range offset, entered where it is new.
Index row_of(const std::string& name, Index first, std::vector<std::string>& names) {
  auto at = std::find(names.begin() + first, names.end(), name);
  if (at == names.end()) at = names.insert(at, name);
  return at - names.begin();
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
  const Index n = result.covariance.rows(), first = n + (offset ? 1 : 0);
  if (offset) sensor.covariance_names.emplace_back("range_offset_m");
  // With what was not adjusted as quantities of their own, beams are as sure as they are: an error
  // of one and what it does to the others cancel in them.
  std::vector<Index> moved_rows, material_rows;
  for (const auto& moved : held.moved) {
    moved_rows.push_back(row_of(moved.name, first, sensor.covariance_names));
  }
  const std::vector<Index> materials = considered_materials(belief, solution);
  for (const Index j : materials) {
    material_rows.push_back(
        row_of(belief.free[static_cast<std::size_t>(j)].name, first, sensor.covariance_names));
  }
  const auto all = static_cast<Index>(sensor.covariance_names.size());
  sensor.covariance = Eigen::MatrixXd::Zero(all, all);
  sensor.covariance.topLeftCorner(n, n) = result.covariance;
  if (offset) add_range_offset(solution, result, sensor);
  if (!materials.empty()) {
    const Eigen::MatrixXd of_materials = belief.covariance(Eigen::all, materials);
    Eigen::MatrixXd with_others(first, of_materials.cols());
    with_others.topRows(n) = algebra::product(solution.considered.parameters, of_materials);
    if (offset) {
      with_others.row(n) =
          algebra::transposed_times(of_materials, solution.considered.range_offset).transpose();
    }
    std::vector<Index> others(static_cast<std::size_t>(first));
    std::iota(others.begin(), others.end(), Index{0});
    sensor.covariance(others, material_rows) = with_others;
    sensor.covariance(material_rows, others) = with_others.transpose();
    sensor.covariance(material_rows, material_rows) = belief.covariance(materials, materials);
  }
  Eigen::MatrixXd movement = Eigen::MatrixXd::Zero(all, result.held_changes.cols());
  if (movement.cols() == 0) return sensor;
  movement.topRows(n) = result.held_changes;
  if (offset) movement.row(n) = result.range_offset_held_changes.transpose();
  for (std::size_t i = 0; i < held.moved.size(); ++i) {
    movement.row(moved_rows[i]) = held.moved[i].by_held;
  }
  for (std::size_t h = 0; h < held.moves_optics.size(); ++h) {
    if (!held.moves_optics[h]) movement.col(static_cast<Index>(h)).setZero();
  }
  sensor.covariance +=
      algebra::propagated(movement, Eigen::MatrixXd::Identity(movement.cols(), movement.cols()));
  return sensor;
}

}  // namespace risley::calibration
