// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

/// @file
/// Places on the WGS84 ellipsoid. GRS80, the ellipsoid of ITRF and ETRS89, differs from it by 0.1
/// mm in its polar radius and not at all at the equator.
namespace risley::trajectories {

inline constexpr double kSemiMajorAxis = 6378137.0;       ///< m
inline constexpr double kFlattening = 1 / 298.257223563;  ///< of the ellipsoid

/// Geodetic latitude in [-pi/2, pi/2] and longitude, rad, and height above the ellipsoid, m.
struct Geodetic {
  double latitude = 0, longitude = 0, height = 0;
};

/// Range of supported places, m above the ellipsoid.
inline constexpr double kLowestHeight = -1e5,  ///< the lowest
    kHighestHeight = 1e8;                      ///< the highest

/// Earth-centred, Earth-fixed coordinates [3], m: Z along the axis of rotation, X towards latitude
/// and longitude 0.
/// @throws InvalidArgument for a latitude beyond a pole, a longitude beyond 2 pi and a height
///         outside [kLowestHeight, kHighestHeight]
Eigen::Vector3d geocentric_from_geodetic(const Geodetic& place);

/// The inverse, with a longitude in [-pi, pi], exact to the rounding of its results everywhere, the
/// poles included: 0.8 nm, and 1.5 nm if the longitude is beyond 90 degrees. On the axis itself the
/// longitude is 0.
/// @param position  m  @throws InvalidArgument as geocentric_from_geodetic
Geodetic geodetic_from_geocentric(const Eigen::Vector3d& position);

/// Unit vectors to the north, to the east and down, the columns of a matrix [3, 3], geocentric. On
/// the axis of rotation north follows from the given longitude.
/// @throws InvalidArgument as geocentric_from_geodetic
Eigen::Matrix3d geocentric_from_ned(const Geodetic& place);

}  // namespace risley::trajectories
