// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/rotor_states.hpp"

#include "risley/core/require.hpp"

namespace risley::estimation {

RotorStates rows_of(const RotorStates& all, ShotRange shots) {
  require_rows("shots", shots.begin, shots.end, all.size());
  RotorStates rows;
  const auto cut = [&](const auto& from, auto& to) {
    to.assign(from.begin() + static_cast<std::ptrdiff_t>(shots.begin),
              from.begin() + static_cast<std::ptrdiff_t>(shots.end));
  };
  const auto cut_all = [&](const auto& from, auto& to) {
    to.resize(from.size());
    for (std::size_t i = 0; i < from.size(); ++i) cut(from[i], to[i]);
  };
  cut(all.time_ns, rows.time_ns);
  cut_all(all.rotation_angle, rows.rotation_angle);
  cut_all(all.angular_velocity, rows.angular_velocity);
  cut_all(all.rotation_angle_covariance, rows.rotation_angle_covariance);
  cut_all(all.angular_velocity_sigma, rows.angular_velocity_sigma);
  cut(all.azimuth_residual, rows.azimuth_residual);
  cut(all.zenith_residual, rows.zenith_residual);
  cut(all.outlier, rows.outlier);
  return rows;
}

}  // namespace risley::estimation
