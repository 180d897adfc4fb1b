// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/core/instruction_set.hpp"

namespace risley::cloud {

/// A sensor's path: for each time a reference point and a rotation.
inline constexpr std::size_t kPathNumbers = 12;
/// Of time, from 0 on, in the polynomials of a stretch of the path.
inline constexpr std::size_t kPathPowers = 6;

/// Poses of shots on one stretch of a sensor's path. Columns have one entry per shot.
struct PathArguments {
  std::size_t shots = 0;
  const double* part = nullptr;  ///< elapsed part of the stretch
  /// Of each power of the part: reference point from the origin, m, and rotation, column by column
  /// [kPathPowers][kPathNumbers].
  const double* coefficients = nullptr;
  double origin[3] = {};                     ///< frame, m
  double *reference[3] = {}, *turn[9] = {};  ///< as SensorPoses
};

/// Columns of SensorPoses.
struct PoseColumns {
  const double *turn[9] = {}, *reference[3] = {};
  double lever_arm[3] = {};
};

/// Transforms points of the sensor's frame to the trajectory's. Columns have one entry per shot.
struct PlaceArguments {
  PoseColumns poses;
  std::size_t shots = 0;
  const double* point[3] = {};  ///< sensor frame, m
  double local[3] = {};         ///< a place near all, frame, m
  double* arm[3] = {};          ///< from the trajectory's reference point, axes of the frame, m
  double* place[3] = {};        ///< from the local place, axes of the frame, m
};

/// Transforms places of the frame to a map, with their covariances and loadings.
struct MapArguments {
  PoseColumns poses;
  std::size_t shots = 0;
  const double *arm[3] = {}, *place[3] = {};  ///< as PlaceArguments
  double* point[3] = {};                      ///< in: sensor frame, m; out: of the map, m
  double center[3] = {};           ///< centre of the map's expansion, from the local place, m
  double value[3] = {};            ///< of the map there, m
  double jacobian[9] = {};         ///< row by row
  double half_hessian[3][9] = {};  ///< 1/m
  double* covariance[6] = {};      ///< in: sensor frame; out: map, m^2; or nullptr
  double* own_covariance[6] = {};  ///< the same
  std::size_t loadings = 0;
  double* const* loading = nullptr;  ///< [loadings * 3] in: axes of the sensor; out: map, m
  double shifted[6] = {};            ///< covariance added to every point, upper triangle, m^2
  double turned_by[6] = {};          ///< covariance of rotations of the body, map axes, rad^2
};

/// Transforms shots as if fired from one place.
struct StandArguments {
  PoseColumns poses;
  std::size_t shots = 0;
  const double *azimuth = nullptr, *zenith = nullptr, *range = nullptr;  ///< rad, m
  double range_offset = 0;                                               ///< taken off, m
  double turn[9] = {}, reference[3] = {};  ///< of the place, as in SensorPoses
  double *stood_azimuth = nullptr, *stood_zenith = nullptr, *stood_range = nullptr;
};

/// Vectors of the sensor's frame at that place turned to its frame at the shots, in place.
struct TurnArguments {
  PoseColumns poses;
  std::size_t shots = 0;
  double turn[9] = {};
  double* vector[3] = {};
};

RISLEY_DECLARE_KERNEL(void follow_path(const PathArguments& arguments))
RISLEY_DECLARE_KERNEL(void place_points(const PlaceArguments& arguments))
RISLEY_DECLARE_KERNEL(void map_points(const MapArguments& arguments))
RISLEY_DECLARE_KERNEL(void stand_shots(const StandArguments& arguments))
RISLEY_DECLARE_KERNEL(void turn_vectors(const TurnArguments& arguments))

}  // namespace risley::cloud
