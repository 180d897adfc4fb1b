// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/rotor_states.hpp"
#include "risley/io/output_file.hpp"

namespace risley::jobs {

/// Contents of a file of rotor states.
struct StatesContent {
  std::size_t rows = 0;
  int prisms = 0;
  /// The states of rows [begin, end); requested in order, so that not all need exist at once.
  std::function<estimation::RotorStates(estimation::ShotRange)> block;
  /// Mean residuals over the rotation angle of every prism [prisms].
  std::vector<estimation::AngleProfile> residuals_over_angle;
};

/// Writes rotor states as NetCDF-4 with CF attributes, one entry of dimension "time" per shot:
/// time (s), time_ns, rotation_angle_a_deg, rotation_angle_sigma_a_deg,
/// angular_velocity_a_deg_per_s, angular_velocity_sigma_a_deg_per_s for every prism,
/// rotation_angle_covariance_ab_deg2 for every pair, azimuth_residual_deg, zenith_residual_deg and
/// outlier; and along the dimension "prism_angle", the middle of each bin: for every prism
/// residual_shots_by_angle_a, azimuth_residual_by_angle_a_deg and zenith_residual_by_angle_a_deg.
/// @param attributes  global ones, e.g. {"command", ...}
/// @throws FileError
void write_states(const std::string& path, const StatesContent& content,
                  const std::vector<std::pair<std::string, std::string>>& attributes);
/// The same, without commit.
void write_states(const io::OutputFile& output, const StatesContent& content,
                  const std::vector<std::pair<std::string, std::string>>& attributes);

}  // namespace risley::jobs
