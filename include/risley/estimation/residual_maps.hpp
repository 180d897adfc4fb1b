// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "risley/estimation/estimate.hpp"

namespace risley::estimation {

/// Mean residuals over the cells of a plane of two angles, without empty cells. If the model
/// describes the sensor, noise alone explains the means; a bent sensor gives patches.
struct ResidualMap {
  double cell = 0;                                ///< side of a cell, rad
  std::vector<double> x, y;                       ///< middle of the cells, rad
  std::vector<std::uint64_t> count;               ///< [cells], shots
  std::vector<double> mean_azimuth, mean_zenith;  ///< [cells], rad
  double sigma_azimuth = 0, sigma_zenith = 0;     ///< of one shot, rad
  std::uint64_t shots = 0;                        ///< of all cells

  std::size_t size() const { return x.size(); }
};

/// Over azimuth and zenith as estimated: with the observed ones noise would sort the shots, and
/// cells at the rim would hold those that it moved outwards. All used shots count.
/// @throws InvalidArgument for a cell not above 0
ResidualMap residuals_over_field(const Estimate& estimate, double cell);

/// Over the rotation angles of two prisms, both in [0, 2 pi), at all used shots.
/// @throws InvalidArgument for prisms that the sensor does not have, or a cell not above 0
ResidualMap residuals_over_angles(const Estimate& estimate, int prism_x, int prism_y, double cell);

}  // namespace risley::estimation
