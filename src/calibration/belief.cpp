// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/belief.hpp"

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

}  // namespace

Belief pooled_belief(const std::vector<RangedRecording>& recordings) {
  check_same_sensor(recordings);
  const RangedRecording& first = recordings.front();
  const auto n = static_cast<Index>(first.free.size());
  Belief belief{first.believed, first.free, first.covariance, {}};
  const auto values = [n](const RangedRecording& recording) {
    Eigen::VectorXd v(n);
    for (Index j = 0; j < n; ++j) {
      v[j] = recording.believed.train[recording.free[static_cast<std::size_t>(j)].places.front()];
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
        const ParameterInfo& info = find_parameter(
            belief.free[static_cast<std::size_t>(apart.worst)].name, belief.sensor.shape());
        throw EstimationError(fmt::format(
            "the recordings are of different sensors, or of one whose stored calibration changed: "
            "{} differs from the others' {} by {:.4g} {}",
            recording.name, info.name, off[apart.worst] / info.si_per_unit, info.unit));
      }
    }
  }
  for (Index j = 0; j < n; ++j) {
    for (const int place : belief.free[static_cast<std::size_t>(j)].places) {
      belief.sensor.train.set_place(place, mean[j]);
    }
  }
  for (const RangedRecording& recording : recordings) {
    const Eigen::VectorXd shift =
        algebra::times(recording.angle_sensitivity, mean - values(recording));
    belief.angle_shift.emplace_back(shift.data(), shift.data() + shift.size());
  }
  return belief;
}

}  // namespace risley::calibration
