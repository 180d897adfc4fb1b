// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "risley/core/angle.hpp"
#include "risley/core/progress.hpp"
#include "risley/sensors/scan_pattern.hpp"

namespace risley::sensors {

/// What of a pattern is counted.
struct CoverageOptions {
  std::vector<double> after = {0.1, 0.2, 0.5, 1.0};  ///< integration times, s, rising
  double cell = radians_from_degrees(0.5);           ///< edge of a cell, rad
  double ring = radians_from_degrees(1.0);           ///< width of a ring about the axis, rad
  /// The field of view covered by a scan of this many seconds, if not more than ten million shots,
  /// and not less than the last of `after`.
  double field_after = 30.0;
};

/// Coverage of a scan after a time.
struct CoverageAfter {
  double time = 0;           ///< s
  std::uint64_t shots = 0;   ///< that got through the prisms
  double covered = 0;        ///< share of the field of view's cells with a shot, [0, 1]
  double mean_density = 0;   ///< shots per steradian of the field of view
  double least_density = 0;  ///< of the cell with the fewest, shots per steradian
  double greatest_density = 0;
  /// Diameter of the largest circle with no shot in it whose centre is a direction that the scan
  /// reaches in the end, rad; of these one is tried in every quarter of a cell (0.1 degree at
  /// least). NaN without shots.
  double gap = 0;
  double gap_azimuth = 0, gap_zenith = 0;  ///< of its centre, rad
  std::vector<std::uint32_t> cell_shots;   ///< [cells]
  std::vector<double> ring_density;        ///< [rings], shots per steradian of field of view; NaN
                                           ///< if a ring has none
};

/// Shares of the field of view for which time_to_cover() is given, percent.
inline constexpr int kToldShares[] = {50, 90, 99};

/// Coverage of the field of view by a scan. Cells are squares of an equal-area map of Lambert and
/// have the same solid angle: of the azimuthal map about X, which near it is in radians from it,
/// or, of a sensor that scans all around its Z, of the cylindrical map about Z, true to scale at an
/// elevation of about 30 degrees. The axis is X or Z accordingly.
struct PatternCoverage {
  bool all_around = false;    ///< about Z
  double cell = 0, ring = 0;  ///< rad
  /// The field of view is every cell covered by a scan of this many seconds.
  double field_after = 0;
  double field_solid_angle = 0;         ///< sr
  double field_half_angle = 0;          ///< of the cone about the axis that holds every shot, rad
  double field_inner_angle = 0;         ///< of the cone about the axis that holds none, rad
  std::vector<double> left, up;         ///< [cells], centres in the map, rad
  std::vector<double> azimuth, zenith;  ///< [cells], the same as directions, rad
  std::vector<CoverageAfter> after;     ///< [options.after]

  /// [cells], time of the first shot, s; infinite if none came within the last of `after`
  std::vector<double> first_shot;

  std::size_t cells() const { return left.size(); }  ///< cells of the map
  /// Time after which that share of the field of view has a shot, s; infinite if the last of
  /// `after` is too short. @throws InvalidArgument for a share outside of 0 to 1
  double time_to_cover(double share) const;
};

/// @param sensor   with a sequence, or rotation angles in the options of the scan
/// @throws InvalidArgument as scan_pattern(), for times that do not rise from above 0 or lie beyond
///         ten million shots, for cells and rings outside of 0.1 to 30 degree and a field_after
///         that is not above 0; EstimationError when no beam gets through; Cancelled
PatternCoverage pattern_coverage(const Sensor& sensor, const ScanPatternOptions& scan = {},
                                 const CoverageOptions& options = {},
                                 const Progress& progress = {});

}  // namespace risley::sensors
