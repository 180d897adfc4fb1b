// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <vector>

#include "risley/core/vector3.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley {

/// One pair of rotation angles for the requested direction, rad, both in [0, 2 pi).
struct RotationPair {
  double first = 0;   ///< of the last prism but one
  double second = 0;  ///< of the last prism
};

/// Largest number of pairs for one direction: docs/theory/inverse.md
inline constexpr int kMostRotationPairs = 4;

/// Every answer of the inverse.
struct InverseSolution {
  /// All isolated pairs, by the second angle. Two in general; where they merge at the edge of the
  /// field of view, one; none outside. An imperfect sensor can have up to four near the centre.
  std::vector<RotationPair> pairs;
  /// True where a continuum of pairs reaches the direction (the centre of an ideal sensor with
  /// equal prisms); pairs then holds one example.
  bool continuum = false;
};

/// The rotation angles of the last two prisms for a given beam direction, by the practical model.
/// The forward model is followed backwards through the last prism, which leaves one unknown angle;
/// docs/theory/inverse.md derives the method.
/// @param direction      unit vector, sensor frame
/// @param fixed_angles   rotation angles, rad, of all prisms before the last two: more than two
///                       prisms reach a direction in infinitely many ways, and the caller chooses
/// @param beam           number of the emitter, counted from 0
/// @throws InvalidArgument for fewer than two prisms, a wrong number of fixed angles or one that is
///         not finite, or a direction that is not a unit vector, and as check_beam()
InverseSolution rotation_angles_for(const PrismTrain& train, const Vector3<double>& direction,
                                    std::span<const double> fixed_angles = {}, int beam = 0);

}  // namespace risley
