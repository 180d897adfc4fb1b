// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/stored_pose.hpp"

#include <algorithm>
#include <cmath>

#include "risley/core/require.hpp"

#include "estimation/field_of_view.hpp"

namespace risley::estimation {

StoredPoseVerdict judge_stored_pose(const AngleSeries& as_recorded, const AngleSeries& turned_back,
                                    double field_of_view) {
  require_not_below("field of view", field_of_view, 0, "rad");
  constexpr double kClearShare = 0.01, kClearShots = 10.0;
  constexpr double kMostOutside = 0.15;  // gross errors lie anywhere
  StoredPoseVerdict verdict;
  verdict.outside_as_recorded = share_outside(as_recorded, field_of_view);
  verdict.outside_turned_back = share_outside(turned_back, field_of_view);
  const double difference = verdict.outside_as_recorded - verdict.outside_turned_back;
  const auto shots = static_cast<double>(std::min(as_recorded.size(), turned_back.size()));
  if (std::min(verdict.outside_as_recorded, verdict.outside_turned_back) > kMostOutside ||
      std::abs(difference) < kClearShare || std::abs(difference) * shots < kClearShots) {
    return verdict;
  }
  verdict.use = difference > 0 ? StoredPoseUse::applied : StoredPoseUse::not_applied;
  return verdict;
}

}  // namespace risley::estimation
