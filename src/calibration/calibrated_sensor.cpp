// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/calibrated_sensor.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "risley/algebra/products.hpp"
#include "risley/sensors/range_values.hpp"

namespace risley::calibration {

using Eigen::Index;

namespace {

constexpr const char* kSource = "calibrated on plane walls by risley calibrate";

/// Sizes of the prisms and range errors as adjusted, and their uncertainty.
void set_numbers(const PlanarProblem& problem, const Calibration& result, sensors::Sensor& sensor) {
  const bool sizes =
      std::ranges::any_of(problem.sizes, [](const SizePrior& size) { return size.sigma > 0; });
  if (sizes) {
    sensor.set_prism_geometry(problem.geometry);
    for (const SizePrior& size : problem.sizes) {
      if (size.sigma == 0) sensor.set_knowledge({size.size.name, 0, "held by risley calibrate"});
    }
  }
  std::erase_if(sensor.knowledge,
                [](const sensors::Knowledge& entry) { return entry.name == "range_offset_m"; });
  sensor.range_offset = problem.range_offset;
  sensor.range_errors = {};
  for (const RangeTerm& term : problem.range_terms) {
    sensors::set_range_value(sensor, term.name, term.value);
  }
  for (const CalibratedNumber& number : result.numbers) {
    sensor.set_knowledge({number.name, number.sigma, kSource, number.total_sigma});
    sensor.covariance_names.push_back(number.name);
  }
}

/// Places in belief.free of the materials that the recordings determined and the solution
/// considers.
std::vector<Index> considered_materials(const Belief& belief, const PlanarSolution& solution) {
  std::vector<Index> materials;
  for (Index j = 0; j < solution.considered.parameters.cols(); ++j) {
    const int place = belief.free[j].places.front();
    if (is_held_material(place, solution.problem)) materials.push_back(j);
  }
  return materials;
}

/// The row of a name after those of parameters and range offset, added if it is new.
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
    sensor.covariance_names.push_back(result.free[j].name);
    sensor.set_knowledge(
        {result.free[j].name, std::sqrt(result.covariance(j, j)), kSource, result.total_sigma(j)});
  }
  sensor.reference = sensors::CalibrationReference::planes;
  set_numbers(solution.problem, result, sensor);
  const Index n = result.covariance.rows(), numbers = solution.number_covariance.rows();
  const Index first = n + numbers;
  // With held quantities included in the covariance, the beams' uncertainty is correct: an error of
  // one and its effect on the others cancel in them.
  std::vector<Index> moved_rows, material_rows;
  for (const auto& moved : held.moved) {
    moved_rows.push_back(row_of(moved.name, first, sensor.covariance_names));
  }
  const std::vector<Index> materials = considered_materials(belief, solution);
  for (const Index j : materials) {
    material_rows.push_back(row_of(belief.free[j].name, first, sensor.covariance_names));
  }
  const Index all = sensor.covariance_names.size();
  sensor.covariance = Eigen::MatrixXd::Zero(all, all);
  sensor.covariance.topLeftCorner(n, n) = result.covariance;
  sensor.covariance.block(n, n, numbers, numbers) = solution.number_covariance;
  sensor.covariance.block(n, 0, numbers, n) = solution.number_cross_covariance;
  sensor.covariance.block(0, n, n, numbers) = solution.number_cross_covariance.transpose();
  if (!materials.empty()) {
    const Eigen::MatrixXd of_materials = belief.covariance(Eigen::all, materials);
    Eigen::MatrixXd with_others(first, of_materials.cols());
    with_others.topRows(n) = algebra::product(solution.considered.parameters, of_materials);
    with_others.bottomRows(numbers) = algebra::product(solution.considered.numbers, of_materials);
    std::vector<Index> others(first);
    std::iota(others.begin(), others.end(), Index{0});
    sensor.covariance(others, material_rows) = with_others;
    sensor.covariance(material_rows, others) = with_others.transpose();
    sensor.covariance(material_rows, material_rows) = belief.covariance(materials, materials);
  }
  Eigen::MatrixXd movement = Eigen::MatrixXd::Zero(all, result.held_changes.cols());
  if (movement.cols() == 0) return sensor;
  movement.topRows(n) = result.held_changes;
  movement.middleRows(n, numbers) = result.number_held_changes;
  for (std::size_t i = 0; i < held.moved.size(); ++i) {
    movement.row(moved_rows[i]) = held.moved[i].by_held;
  }
  for (std::size_t h = 0; h < held.moves_optics.size(); ++h) {
    if (!held.moves_optics[h]) movement.col(h).setZero();
  }
  sensor.covariance +=
      algebra::propagated(movement, Eigen::MatrixXd::Identity(movement.cols(), movement.cols()));
  return sensor;
}

}  // namespace risley::calibration
