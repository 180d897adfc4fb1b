// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "risley/cloud/cloud_file.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"

namespace risley::cloud {

/// How two clouds are compared.
struct ChangeOptions {
  double cell = 0.5;          ///< edge of the cells, each with one distance, m
  double reach = 0.5;         ///< largest expected movement of a surface, m
  double false_alarm = 0.01;  ///< share of unchanged cells that are called changed
};

/// One piece of surface in both clouds.
struct SurfaceCell {
  Eigen::Vector3d place{0, 0, 0};   ///< middle of the first cloud's points
  Eigen::Vector3d normal{0, 0, 1};  ///< unit vector; upwards, of an upright wall to its first axis
  double distance = 0;              ///< from the first surface to the second along it, m
  double sigma = 0;                 ///< of the distance without change, m
  bool significant = false;         ///< the distance is beyond the level of detection
  std::size_t points_a = 0, points_b = 0;
};

/// Changes between two clouds.
struct SurfaceChange {
  std::vector<SurfaceCell> cells;
  std::size_t uneven = 0;  ///< cells whose points do not form a surface
  std::size_t unseen = 0;  ///< cells with too few points in one of the clouds
  double critical = 0;     ///< the level of detection, in sigmas
  double significant = 0;  ///< share of the cells
  std::size_t shared = 0;  ///< common factors of both clouds, which mostly cancel
  std::vector<Warning> warnings;
};

/// Distances along normals, as M3C2 measures them [Lague, Brodu, Leroux 2013], whose sigmas follow
/// from the covariances of these points: each point's own errors, those common to a cloud or a
/// station, those common to neighbouring times of a flight, and those common to both clouds because
/// one calibration made them. docs/theory/change.md
/// @throws InvalidArgument for clouds on different maps and options out of range; FileError,
///         Cancelled
SurfaceChange surface_change(const CloudFile& a, const CloudFile& b, const ChangeOptions& options,
                             const Progress& progress = {});

}  // namespace risley::cloud
