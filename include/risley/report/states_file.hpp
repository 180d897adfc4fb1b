// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "risley/estimation/ekf.hpp"

namespace risley::report {

/// Writes rotor states as NetCDF-4 with CF attributes, one entry of dimension "time" per used shot:
/// time (s), time_ns, rotation_angle_a_deg, rotation_angle_sigma_a_deg,
/// angular_velocity_a_deg_per_s, angular_velocity_sigma_a_deg_per_s for every prism,
/// rotation_angle_covariance_ab_deg2 for every pair, azimuth_residual_deg, zenith_residual_deg and
/// outlier. The NetCDF library is not thread-safe: one NetCDF file of a process at a time.
/// @param attributes  global ones, e.g. {"command", ...}
/// @throws FileError
void write_states(const std::string& path, const estimation::RotorStates& states,
                  const std::vector<std::pair<std::string, std::string>>& attributes);

}  // namespace risley::report
