// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/held.hpp"

#include <utility>

namespace risley::calibration {
namespace {

using Eigen::Index;
using estimation::FreeParameter;

}  // namespace

Held held_of(const sensors::Sensor& sensor, const Belief& belief, const PlanarProblem& problem) {
  // Common to the sensor's computation and the true optics.
  const auto in_both = [&](int at) { return is_held_material(at, problem); };
  // Specific to the true prisms.
  std::vector<FreeParameter> own = estimation::uncertain_held(sensor, problem.free);
  std::erase_if(own, [&](const FreeParameter& parameter) {
    return is_material(parameter.places.front(), sensor.prisms());
  });
  const Index believed = belief.held.size();
  const Index count = believed + std::ssize(own);
  Held held;
  Eigen::MatrixXd& train = held.quantities.train;
  train = Eigen::MatrixXd::Zero(problem.train.parameters().size(), count);
  for (Index h = 0; h < believed; ++h) {
    const FreeParameter& parameter = belief.held[h];
    held.names.push_back(parameter.name);
    held.moves_optics.push_back(is_material(parameter.places.front(), sensor.prisms()));
    for (const int at : parameter.places) {
      if (in_both(at)) train(at, h) += parameter.prior_sigma;
    }
    for (std::size_t j = 0; j < belief.free.size(); ++j) {
      for (const int at : belief.free[j].places) {
        if (in_both(at)) train(at, h) += belief.held_changes(j, h);
      }
    }
  }
  for (Index h = believed; h < count; ++h) {
    const FreeParameter& parameter = own[h - believed];
    held.names.push_back(parameter.name);
    held.moves_optics.push_back(true);
    for (const int at : parameter.places) train(at, h) = parameter.prior_sigma;
  }
  for (const Eigen::MatrixXd& angles : belief.held_angle_changes) {
    Eigen::MatrixXd& all = held.quantities.rotation_angles.emplace_back(
        Eigen::MatrixXd::Zero(problem.train.prisms(), count));
    all.leftCols(believed) = angles;
  }
  for (const auto* list : {&belief.held, &belief.free, &std::as_const(own)}) {
    for (const FreeParameter& parameter : *list) {
      if (list != &own && !in_both(parameter.places.front())) continue;
      Eigen::RowVectorXd row = train.row(parameter.places.front());
      for (Index h = 0; h < count; ++h) {
        if (!held.moves_optics[h]) row[h] = 0;
      }
      if (!row.isZero(0.0)) held.moved.push_back({parameter.name, row});
    }
  }
  return held;
}

HeldMovement movement_of(const Held& held, const PlanarProblem& problem,
                         const Eigen::MatrixXd& changes) {
  HeldMovement movement{held.quantities.train,
                        Eigen::MatrixXd::Zero(problem.train.prisms(), held.quantities.count()),
                        {}};
  for (const Eigen::MatrixXd& angles : held.quantities.rotation_angles) {
    movement.rotation_angles += angles;
  }
  movement.rotation_angles /= static_cast<double>(held.quantities.rotation_angles.size());
  for (std::size_t j = 0; j < problem.free.size(); ++j) {
    for (const int at : problem.free[j].places) {
      movement.train.row(at) = changes.row(j);
    }
  }
  return movement;
}

}  // namespace risley::calibration
