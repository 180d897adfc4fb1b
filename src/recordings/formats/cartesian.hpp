// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::recordings {

/// Steps of the sensor's integers: 1 mm in distances and coordinates, 0.01 deg in angles.
inline constexpr double kMillimetre = 1e-3;
inline constexpr double kCentimetre = 1e-2;  ///< in short records of the second generation
inline constexpr double kCentidegree = 0.01 * kRadiansPerDegree;

/// Azimuth of a file, deg in [-180, 360], as an azimuth in (-pi, pi], rad. The two values on the
/// wrong side of the cut, -180 and 360, become the nearest number on the other side (4e-16 rad
/// away), so that a writer that rounds finds the same digits again.
inline double azimuth_from_degrees(double azimuth_deg) {
  if (azimuth_deg == 360.0) return -0x1p-60;
  if (azimuth_deg == -180.0) return std::nextafter(-kPi, 0.0);
  if (azimuth_deg > 180.0) return radians_from_degrees(azimuth_deg - 360.0);
  return std::min(radians_from_degrees(azimuth_deg), kPi);
}

/// The inverse for formats that count from 0 to 360 deg.
inline double degrees_0_to_360(double azimuth) {
  const double azimuth_deg = degrees_from_radians(azimuth);
  return azimuth_deg < 0.0 ? azimuth_deg + 360.0 : azimuth_deg;
}

/// Sets direction, range, resolutions and validity of a row from polar values: azimuth as returned
/// by azimuth_from_degrees(), rad, zenith, rad, range, m. Range 0 is a shot without return, whose
/// angles are kept but not trusted.
inline void set_spherical(Observations& rows, std::size_t row, double azimuth, double zenith,
                          double range) {
  rows.azimuth[row] = azimuth;
  rows.zenith[row] = zenith;
  rows.range[row] = range;
  rows.azimuth_resolution[row] = static_cast<float>(kCentidegree);
  rows.zenith_resolution[row] = static_cast<float>(kCentidegree);
  rows.range_resolution[row] = static_cast<float>(kMillimetre);
  rows.valid[row] = range > 0.0 ? 1 : 0;
}

/// Sets direction, range, resolutions and validity of a row from a point, m, whose coordinates
/// are rounded to `step`, m. The origin is a shot without return: range 0, angles NaN.
inline void set_cartesian(Observations& rows, std::size_t row, const Vector3<double>& point,
                          double step) {
  const double horizontal = std::sqrt(point.x * point.x + point.y * point.y);
  const double range = norm(point);
  rows.range[row] = range;
  rows.range_resolution[row] = static_cast<float>(step);
  if (range == 0.0) {
    rows.azimuth[row] = rows.zenith[row] = std::numeric_limits<double>::quiet_NaN();
    rows.azimuth_resolution[row] = rows.zenith_resolution[row] = 0.0F;
    rows.valid[row] = 0;
    return;
  }
  const auto angles = angles_from_direction(point);
  rows.azimuth[row] = angles.azimuth;
  rows.zenith[row] = angles.zenith;
  // Close to the Z axis a step can turn the azimuth by any angle.
  rows.azimuth_resolution[row] =
      static_cast<float>(horizontal > 0.0 ? std::min(step / horizontal, kTwoPi) : kTwoPi);
  rows.zenith_resolution[row] = static_cast<float>(std::min(step / range, kPi));
  rows.valid[row] = 1;
}

/// The same for many points, whose rows are consecutive from a given one on; angles may differ from
/// those by 4e-16 rad. @param x, y, z  [points], m
void set_cartesian(Observations& rows, std::size_t row, std::size_t points, const double* x,
                   const double* y, const double* z, double step);

/// The point of a row, m; the origin if the shot had no return.
inline Vector3<double> cartesian_point(const Observations& rows, std::size_t row) {
  if (!(rows.range[row] > 0.0)) return {};
  return rows.range[row] *
         direction_from_angles(SphericalAngles<double>{rows.azimuth[row], rows.zenith[row]});
}

/// Nearest whole number of steps.
inline std::int64_t whole_steps(double value, double step) { return std::llround(value / step); }

}  // namespace risley::recordings
