// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "risley/cloud/swath_reach.hpp"
#include "risley/core/progress.hpp"

namespace risley::cloud {

/// The straight way of a sensor along one strip, on a map.
struct StripLine {
  std::string name;                              ///< may be empty
  std::array<double, 2> begin{0, 0}, end{0, 0};  ///< x, y, m
  double height = 0;                             ///< z of the sensor, in the middle, m
};

/// Settings of a distribution.
struct PointDistributionOptions {
  double empty_circle = 0.25;  ///< diameter of circles that should hold a point, m
  double density_cell = 0.5;   ///< edge of the squares in which points are counted, m
  /// Largest ground area searched for the empty circles of one strip, m^2: it costs 650 bytes a
  /// square metre with circles of 0.25 m, and scales with the square of their inverse.
  double most_ground = 3e5;
};

/// Density across a strip, in stripes along the middle of its swath.
struct SwathProfile {
  double stripe = 0;            ///< width of each, m
  std::vector<double> across;   ///< [stripes], from the middle of the swath to the left, m
  std::vector<double> density;  ///< [stripes], of the strip's whole length, 1/m^2
};

/// Shares of half the swath's width at which densities are given.
inline constexpr std::array<double, 6> kSwathPlaces{0.25, 0.5, 0.75, 0.9, 0.97, 0.99};

/// Distribution of one strip's points on the ground. The swath is the strip that the sensor of a
/// level platform covers; points beyond it, from a swaying platform, count where they are. Cells
/// and circles are evaluated on ground that the strip has covered in full: where the field of view
/// has come and gone. Numbers without such ground are NaN.
struct StripDistribution {
  std::uint16_t strip = 0;  ///< number, from 1
  std::string name;
  std::uint64_t points = 0;
  double length = 0;   ///< of the way that has points, m
  double height = 0;   ///< of the sensor above the points' mean, m
  double width = 0;    ///< of the swath, 2 R, m
  double density = 0;  ///< nominal: points within the swath per its area, 1/m^2
  double spacing = 0;  ///< nominal: 1 / sqrt(density), m
  SwathProfile profile;
  double middle_density = 0;  ///< of a stripe of 1 m in the middle (nadir), 1/m^2
  /// At kSwathPlaces of R, both sides together, in stripes of a fiftieth of R, 1/m^2. The last is
  /// the edge.
  std::array<double, kSwathPlaces.size()> place_density{};
  /// Width about the middle where the density is at least half that of the swath, m.
  double dense_width = 0;

  double whole_ground = 0;    ///< seen in full, within the swath, m^2
  double cell_variation = 0;  ///< of the cells' counts within 0.9 R: sigma / mean
  double cells_covered = 0;   ///< share of the cells within R with a point
  /// Share of squares of twice the nominal spacing, within 0.95 R, with a point: at least 90 % if
  /// points are spread evenly. [USGS Lidar Base Specification]
  double spacing_cells_covered = 0;
  /// Of the ground within 0.97 R: the share of places about which a circle of the stated diameter
  /// is empty. It is the risk of missing a target of that size.
  double empty_share = 0;
  /// Diameter of the largest circle without a point whose centre is within 0.3 R, 0.3 to 0.7 R, 0.7
  /// to 0.97 R of the middle, m; those beyond sixteen of the stated diameters count as that.
  std::array<double, 3> largest_empty{};
  double circles_ground = 0;  ///< on which the circles were looked for, m^2
};

/// A square of the map of densities.
struct DensitySquare {
  double x = 0, y = 0;       ///< centre, m
  double density = 0;        ///< 1/m^2
  std::uint16_t strips = 0;  ///< most strips with points in one of its cells
};

/// Distribution of points on the ground.
struct PointDistributionSummary {
  double empty_circle = 0, density_cell = 0;  ///< as asked, m
  std::vector<StripDistribution> strips;
  std::uint64_t points = 0;                    ///< of all strips
  std::uint64_t other_points = 0;              ///< of none
  double area = 0;                             ///< of all swaths together, m^2
  double density = 0;                          ///< aggregate nominal: points on that area, 1/m^2
  double spacing = 0;                          ///< aggregate nominal: 1 / sqrt(density), m
  double low_density = 0, median_density = 0;  ///< of its cells: 5 %, 50 % have less, 1/m^2
  double covered = 0;                          ///< share of cells that hold a point
  double overlap = 0;              ///< share of cells that hold points of several strips
  double square = 0;               ///< edge of the map's squares, m
  std::vector<DensitySquare> map;  ///< those that hold a point or belong to a swath
};

/// Counts points on the ground, piece by piece. Memory grows with the area, not with the number of
/// points. docs/theory/flight.md
class PointDistribution {
 public:
  /// @param lines  [strips], in the order of their numbers from 1
  /// @throws InvalidArgument for non-finite values, lines without length and options out of range
  PointDistribution(std::vector<StripLine> lines, const SwathReach& reach,
                    const PointDistributionOptions& options = {});
  ~PointDistribution();
  PointDistribution(PointDistribution&&) noexcept;
  PointDistribution& operator=(PointDistribution&&) noexcept;

  /// Adds points. Densities refer to the first return of every shot.
  /// @param strip  number of each point's strip from 1, 0: of none; strips do not return after
  /// points of a later one
  /// @throws InvalidArgument for columns of different lengths, coordinates that are not within 1000
  /// km of the first strip, strips that do not exist or return; Cancelled
  void add(std::span<const double> x, std::span<const double> y, std::span<const double> z,
           std::span<const std::uint16_t> strip, const Progress& progress = {});

  /// The result; ends the strip of the last points.
  /// @param most_squares  of the map
  PointDistributionSummary summary(std::size_t most_squares = 12'000);

 private:
  class Counts;
  std::unique_ptr<Counts> counts_;
};

}  // namespace risley::cloud
