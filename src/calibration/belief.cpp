// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/belief.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/parameter_agreement.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;

void check_same_sensor(const std::vector<RangedRecording>& recordings) {
  const RangedRecording& first = recordings.front();
  for (const RangedRecording& other : recordings) {
    if (!first.serial.empty() && !other.serial.empty() && first.serial != other.serial) {
      throw InvalidArgument(
          fmt::format("the recordings are of different sensors: {} of serial number {}, {} of {}",
                      first.name, first.serial, other.name, other.serial));
    }
    // The speed combination may differ: a sensor changes it at every power-up.
    if (first.believed.train.face_order() != other.believed.train.face_order()) {
      throw InvalidArgument(fmt::format(
          "the recordings are of different sensors: {} has the face order {}, {} has {}",
          first.name, to_string(first.believed.train.face_order()), other.name,
          to_string(other.believed.train.face_order())));
    }
  }
}

/// Row of a held parameter, added if it is new.
Index row_of(const estimation::FreeParameter& parameter,
             std::vector<estimation::FreeParameter>& held) {
  const auto at =
      std::ranges::find_if(held, [&](const auto& known) { return known.name == parameter.name; });
  const Index row = at - held.begin();
  if (at == held.end()) held.push_back(parameter);
  return row;
}

/// Errors of held parameters are the same in all recordings, because they are from one sensor.
void pool_held(const std::vector<RangedRecording>& recordings, Belief& belief) {
  const Index n = belief.free.size();
  std::vector<std::vector<Index>> rows;
  for (const RangedRecording& recording : recordings) {
    rows.emplace_back();
    for (const auto& parameter : recording.held_changes.held) {
      rows.back().push_back(row_of(parameter, belief.held));
    }
  }
  const Index count = belief.held.size();
  std::vector<Eigen::MatrixXd> own_changes;
  belief.held_changes = Eigen::MatrixXd::Zero(n, count);
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const estimation::HeldChanges& of = recordings[r].held_changes;
    Eigen::MatrixXd& values = own_changes.emplace_back(Eigen::MatrixXd::Zero(n, count));
    Eigen::MatrixXd& angles = belief.held_angle_changes.emplace_back(
        Eigen::MatrixXd::Zero(belief.sensor.prisms(), count));
    for (std::size_t h = 0; h < rows[r].size(); ++h) {
      values.col(rows[r][h]) = of.values.col(h).head(n);
      angles.col(rows[r][h]) = of.mean_angles.col(h);
    }
    if (count == 0 || n == 0) continue;
    // As the means of the values: each recording counts by its information.
    belief.held_changes +=
        recordings.size() == 1
            ? values
            : algebra::product(
                  belief.covariance,
                  algebra::SymmetricSolver(recordings[r].covariance).solve_columns(values));
  }
  for (std::size_t r = 0; r < recordings.size() && count > 0 && n > 0; ++r) {
    belief.held_angle_changes[r] += algebra::product(recordings[r].angle_sensitivity,
                                                     (belief.held_changes - own_changes[r]).eval());
  }
}

}  // namespace

Belief pooled_belief(const std::vector<RangedRecording>& recordings) {
  check_same_sensor(recordings);
  const RangedRecording& first = recordings.front();
  const Index n = first.free.size();
  Belief belief{first.believed, first.free, first.covariance, {}, {}, {}, {}};
  const auto values = [n](const RangedRecording& recording) {
    Eigen::VectorXd v(n);
    for (Index j = 0; j < n; ++j) {
      v[j] = recording.believed.train[recording.free[j].places.front()];
    }
    return v;
  };
  Eigen::VectorXd mean = values(first);
  if (recordings.size() > 1 && n > 0) {
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd weighted = Eigen::VectorXd::Zero(n);
    for (const RangedRecording& recording : recordings) {
      const Eigen::MatrixXd own = algebra::SymmetricSolver(recording.covariance).inverse();
      information += own;
      weighted += algebra::times(own, values(recording));
    }
    belief.covariance = algebra::SymmetricSolver(information).inverse();
    mean = algebra::times(belief.covariance, weighted);
    for (const RangedRecording& recording : recordings) {
      const Eigen::VectorXd off = values(recording) - mean;
      const estimation::Disagreement apart =
          estimation::disagreement(off, recording.covariance - belief.covariance);
      if (!apart.same_sensor()) {
        const ParameterInfo& info =
            find_parameter(belief.free[apart.worst].name, belief.sensor.shape());
        throw EstimationError(fmt::format(
            "the recordings are of different sensors, or of one whose stored calibration changed: "
            "{} differs from the others in its {} by {:.4g} {}",
            recording.name, info.name, off[apart.worst] / info.si_per_unit, info.unit));
      }
    }
  }
  for (Index j = 0; j < n; ++j) {
    for (const int place : belief.free[j].places) {
      belief.sensor.train.set_place(place, mean[j]);
    }
  }
  for (const RangedRecording& recording : recordings) {
    const Eigen::VectorXd shift =
        algebra::times(recording.angle_sensitivity, mean - values(recording));
    belief.angle_shift.emplace_back(shift.data(), shift.data() + shift.size());
  }
  pool_held(recordings, belief);
  return belief;
}

}  // namespace risley::calibration
