// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/calibration/plane_points.hpp"

namespace risley::calibration {

/// Calls function(column, ...) for every column of RangedShots: that of the first shots, then the
/// same one of the others, which have as many prisms.
template <class Function, class... Others>
void for_each_column(const Function& function, const RangedShots& first, Others&... others) {
  for (std::size_t k = 0; k < first.rotation_angle.size(); ++k) {
    function(first.rotation_angle[k], others.rotation_angle[k]...);
  }
  for (std::size_t k = 0; k < first.angle_covariance.size(); ++k) {
    function(first.angle_covariance[k], others.angle_covariance[k]...);
  }
  for (std::size_t k = 0; k < first.range_terms.size(); ++k) {
    function(first.range_terms[k], others.range_terms[k]...);
  }
  function(first.range, others.range...);
  function(first.beam, others.beam...);
  function(first.intensity, others.intensity...);
}

}  // namespace risley::calibration
