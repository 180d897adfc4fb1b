// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/cloud/points.hpp"

namespace risley::cloud {

/// Calls visit(column, name, there) for the columns that compute_points() fills.
/// @param there  whether the header announces the column
template <class AnyPoints, class Visit>
void visit_computed_columns(AnyPoints& p, const CloudHeader& header, const Visit& visit) {
  visit(p.x, "x", true);
  visit(p.y, "y", true);
  visit(p.z, "z", true);
  visit(p.range, "range", true);
  visit(p.incidence, "incidence", true);
  for (auto& column : p.covariance) visit(column, "covariance", header.has_covariance);
  for (auto& column : p.own_covariance) visit(column, "own_covariance", header.has_own_covariance);
  for (auto& column : p.rotation_angle) {
    visit(column, "rotation_angle of a prism", header.has_rotation_angles);
  }
  visit(p.azimuth_residual, "azimuth_residual", header.has_rotation_angles);
  visit(p.zenith_residual, "zenith_residual", header.has_rotation_angles);
  for (auto& factor : p.loading) {
    for (auto& column : factor) visit(column, "loading of a factor", true);
  }
}

/// The same for all columns of points.
template <class AnyPoints, class Visit>
void visit_columns(AnyPoints& p, const CloudHeader& header, const Visit& visit) {
  visit_computed_columns(p, header, visit);
  visit(p.time_ns, "time_ns", true);
  visit(p.intensity, "intensity", true);
  visit(p.return_number, "return_number", true);
  visit(p.number_of_returns, "number_of_returns", true);
  visit(p.tag, "tag", true);
  visit(p.beam, "beam", true);
  visit(p.point_source, "point_source", header.has_point_source);
}

}  // namespace risley::cloud
