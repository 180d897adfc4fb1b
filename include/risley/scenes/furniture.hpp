// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <string>

#include "risley/core/vector3.hpp"

namespace risley::scenes {

/// Reflectivity of a surface that states none: a bright target in the sense of data sheets.
inline constexpr double kMattReflectivity = 0.8;

/// A piece of furniture or a pillar: an upright box.
struct SceneBox {
  std::string name;
  Vector3<double> center;                     ///< m
  std::array<double, 3> size{0.0, 0.0, 0.0};  ///< along its own X, Y and Z, m
  Vector3<double> forward{1.0, 0.0, 0.0};     ///< its own X axis, level unit vector
  double reflectivity = kMattReflectivity;    ///< (0, 1]
};

/// A person walking to and fro: an upright ellipsoid.
struct Person {
  std::string name;
  Vector3<double> from, to;                 ///< of the feet, m; at `from` at time 0
  double speed = 0;                         ///< m/s
  std::array<double, 2> size{0.5, 1.75};    ///< width and height, m
  double reflectivity = kMattReflectivity;  ///< (0, 1]

  /// Where the feet are. @param time  s
  Vector3<double> feet_at(double time) const;
};

}  // namespace risley::scenes
