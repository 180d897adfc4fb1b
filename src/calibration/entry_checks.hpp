// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/calibration/plane_points.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"

namespace risley::calibration {

/// Requires rotation angles of every prism of a train and, if any, the emitter, for every range.
inline void require_angle_columns(const RangedShots& shots, const PrismTrain& train) {
  check_shape(train.shape());
  require_length("rotation_angle", shots.rotation_angle.size(), train.prisms());
  for (const auto& column : shots.rotation_angle) {
    require_length("rotation_angle of a prism", column.size(), shots.size());
  }
  require_length_or_none("beam", shots.beam.size(), shots.size());
}

/// The same with emitters that the train has and the covariance of the rotation angles.
inline void require_shots(const RangedShots& shots, const PrismTrain& train) {
  require_angle_columns(shots, train);
  check_beams(train, shots.beam, shots.size());
  const auto prisms = static_cast<std::size_t>(train.prisms());
  require_length("angle_covariance", shots.angle_covariance.size(), prisms * (prisms + 1) / 2);
  for (const auto& column : shots.angle_covariance) {
    require_length("angle_covariance of two prisms", column.size(), shots.size());
  }
}

}  // namespace risley::calibration
