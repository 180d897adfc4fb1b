// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "risley/calibration/plane_points.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley::calibration {

/// Lines of sight of shots. Blocked beams are NaN.
class Rays {
 public:
  /// @throws InvalidArgument for shots of another number of prisms, columns of different lengths,
  ///         or emitters that the train does not have
  Rays(const PrismTrain& train, const PrismGeometry& geometry, const RangedShots& shots)
      : Rays(train, geometry, shots, {0, shots.size()}) {}
  /// The same for some rows, which count from 0 here: a block of them stays in the processor's
  /// cache.
  Rays(const PrismTrain& train, const PrismGeometry& geometry, const RangedShots& shots,
       estimation::ShotRange rows)
      : Rays(train, geometry, shots.rotation_angle, shots.beam, rows) {}
  /// @param rotation_angle  [prisms][shots], rad  @param emitter  [shots] or empty
  Rays(const PrismTrain& train, const PrismGeometry& geometry,
       std::span<const std::vector<double>> rotation_angle, std::span<const std::uint8_t> emitter,
       estimation::ShotRange rows);

  std::size_t size() const { return x_.size(); }
  /// Unit vector, sensor frame.
  Vector3<double> direction(std::size_t i) const { return {x_[i], y_[i], z_[i]}; }
  /// Origin of a shot's beam, m, sensor frame.
  Vector3<double> origin(std::size_t i) const { return {origin_x_[i], origin_y_[i], origin_z_[i]}; }
  /// The point at a range from the origin, m, sensor frame.
  Vector3<double> point(std::size_t i, double range) const {
    return origin(i) + range * direction(i);
  }

 private:
  std::vector<double> x_, y_, z_, origin_x_, origin_y_, origin_z_;
};

}  // namespace risley::calibration
