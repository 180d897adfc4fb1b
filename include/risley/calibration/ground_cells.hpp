// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/flight_equations.hpp"

namespace risley::calibration {

/// Points of shots, local frame, m; NaN if a beam does not get through the prisms or a point is
/// beyond 1000 km.
using ShotPoints = std::vector<std::array<float, 3>>;

/// Points from the measured ranges.
/// @throws InvalidArgument as flight_equations
ShotPoints georeferenced(const FlightShots& shots, const ShotPoses& poses,
                         const FlightModel& model);

/// How ground is divided into cells, and which of them count as planes.
struct GroundCellOptions {
  double size = 2;                         ///< of a cell, m
  double shift_east = 0, shift_north = 0;  ///< of the grid, in cells
  std::size_t least_shots = 8, least_strips = 2;
  double steepest = 1.0471975511965976;  ///< angle of a normal from the vertical, rad (60 degrees)
  /// Scatter of the points about their plane above which a cell is rejected, 1 sigma, m.
  double most_roughness = std::numeric_limits<double>::infinity();
  /// Scatter of one plane, 1 sigma, m: cells with significantly more, such as those crossed by an
  /// edge, are rejected, too. 0: not known.
  double noise = 0;
};

/// Squares of a map's grid covered by several strips, each with its own plane.
struct GroundCells {
  std::vector<GroundPlane> planes;
  PlaneOfShot plane;      ///< of every shot
  double scatter = 0;     ///< of the points about the planes, robust 1 sigma, m
  std::size_t rough = 0;  ///< rejected cells that are too rough
};

/// Sorts points into cells and fits to each a plane that is robust against outliers: weights fall
/// with the distance as Cauchy's, at 1.5 median absolute distances.
/// @param strip  of every point
/// @throws InvalidArgument for columns of different lengths and options out of range
GroundCells ground_cells(const ShotPoints& points, const std::vector<std::uint16_t>& strip,
                         const GroundCellOptions& options);

/// A level circle of ground.
struct GroundCircle {
  Eigen::Vector3d centre{0, 0, 0};  ///< whose height is ignored
  double radius = 1;                ///< m

  /// Whether a point (east, north, up), m, lies inside or on the rim; its height is ignored.
  bool holds(const std::array<float, 3>& point) const {
    const double east = point[0] - centre.x(), north = point[1] - centre.y();
    return east * east + north * north <= radius * radius;
  }
};

/// Removes the points of circles from their cells and gives each circle a plane after those of the
/// cells, under the same conditions except for the number of strips: one is enough. Of circles that
/// overlap the first has the points.
/// @param cells  of these points; changed
/// @return the plane of every circle, kNoPlane if there are too few points or they do not form a
/// plane
/// @throws InvalidArgument as ground_cells, for radii not above 0
std::vector<std::int32_t> add_circles(const ShotPoints& points,
                                      const std::vector<GroundCircle>& circles,
                                      const GroundCellOptions& options, GroundCells& cells);

/// Where one strip saw a cell.
struct StripInCell {
  std::size_t plane = 0;  ///< of the cell
  std::uint16_t strip = 0;
  std::size_t shots = 0;  ///< that count
  double mean = 0;        ///< distance from the plane, along its normal, m
};

/// Mean distances from the planes, strip by strip; ordered by plane, then strip.
/// @param gate  distance beyond which a point is ignored, m
/// @param least_shots  a strip with fewer is skipped
/// @throws InvalidArgument as ground_cells
std::vector<StripInCell> strips_in_cells(const ShotPoints& points,
                                         const std::vector<std::uint16_t>& strip,
                                         const PlaneOfShot& plane,
                                         const std::vector<GroundPlane>& planes, double gate,
                                         std::size_t least_shots = 8);

/// Offset between two strips.
struct StripPair {
  std::uint16_t first = 0, second = 0;
  std::size_t cells = 0;     ///< that both have seen
  double mean = 0, rms = 0;  ///< of the second less the first, along the cells' normals, m
  /// The shift east, north, up that explains most of it, and its sigma, m; if the ground does not
  /// determine it, sigma is 1.
  Eigen::Vector3d shift{0, 0, 0}, sigma{1, 1, 1};
};

/// The pair of the same two strips; null without one.
const StripPair* find_pair(const std::vector<StripPair>& pairs, const StripPair& like);

/// strips_in_cells(), compared. @throws InvalidArgument as ground_cells
std::vector<StripPair> strip_pairs(const ShotPoints& points,
                                   const std::vector<std::uint16_t>& strip,
                                   const PlaneOfShot& plane, const std::vector<GroundPlane>& planes,
                                   double gate, std::size_t least_shots = 8);

}  // namespace risley::calibration
