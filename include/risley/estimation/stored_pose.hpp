// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/estimation/angle_series.hpp"

namespace risley::estimation {

/// Whether the points of a recording were moved by the pose stored in its header.
enum class StoredPoseUse {
  not_applied,  ///< shots lie in the sensor's field of view as recorded
  applied,      ///< shots lie in it only after turning back
  undecided,    ///< the shots cannot decide
};

/// Evidence of the shots on a stored pose.
struct StoredPoseVerdict {
  StoredPoseUse use = StoredPoseUse::undecided;
  /// Shares of the shots outside the sensor's field of view, [0, 1].
  double outside_as_recorded = 0, outside_turned_back = 0;
};

/// Decides by the field of view: a frame is the sensor's if shots lie in the cone about its X axis,
/// or up to 1.5 degrees beyond its edge, which allows for a unit's errors. The decision requires
/// that the shares outside differ by a hundredth and by ten shots, and that the smaller share is
/// below 15 %. Poses that hardly move the optical axis (rolls, turns of less than about two
/// degrees) keep all shots inside: undecided.
/// @param as_recorded    directions of about a second
/// @param turned_back  the same shots with the pose removed (recordings::ReadOptions::extrinsics)
/// @param field_of_view  full cone, rad; 0 when unknown, which leaves it undecided
StoredPoseVerdict judge_stored_pose(const AngleSeries& as_recorded, const AngleSeries& turned_back,
                                    double field_of_view);

}  // namespace risley::estimation
