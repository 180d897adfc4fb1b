// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "risley/cloud/georeference.hpp"
#include "risley/cloud/pointing.hpp"
#include "risley/cloud/surface_normals.hpp"
#include "risley/recordings/observations.hpp"

namespace risley::cloud {

inline bool has_return(const recordings::Observations& piece, std::size_t row) {
  return piece.valid[row] != 0 && piece.range[row] > 0;
}

std::vector<std::int64_t> times_of(const recordings::Observations& piece,
                                   const std::vector<std::size_t>& rows);

/// Shots in polar coordinates, rad and m.
struct PolarShots {
  std::vector<double> azimuth, zenith, range;

  void resize(std::size_t shots) {
    for (auto* column : {&azimuth, &zenith, &range}) column->resize(shots);
  }
};

/// The surfaces in a recording, found from the shots that a sensor fires while surfaces stand
/// still, or nearly so.
class ShotSurfaces {
 public:
  /// @param angle_noise   of the sensor, rad
  /// @param georeference  of a moving sensor, or nullptr
  ShotSurfaces(const sensors::Sensor& calibration, double angle_noise, bool has_intensity,
               const Georeference* georeference);

  /// Surfaces are found from the reported directions.
  /// @param distortion  of these against each other, rms, rad
  void expect_distortion(double distortion);

  /// Finds the surfaces of the rows from `begin` on. @return start of the next ones
  std::size_t find(const recordings::Observations& piece, std::size_t begin, std::size_t end);

  /// The normals of the surfaces that some shots met, sensor frame.
  /// @param rows   of the shots in the piece
  /// @param poses  of a moving sensor at these rows
  void find_normals(const recordings::Observations& piece, const std::vector<std::size_t>& rows,
                    const SensorPoses& poses, PointedShots& shots) const;

 private:
  double range_with_offset(const recordings::Observations& piece, std::size_t row) const;
  void add_moving(const recordings::Observations& piece, std::int64_t middle_ns,
                  const std::vector<std::size_t>& rows);
  void stand_still(const SensorPoses& poses, const std::vector<double>& azimuth,
                   const std::vector<double>& zenith, const std::vector<double>& range,
                   PolarShots& stood) const;

  const sensors::Sensor& calibration_;
  double angle_noise_;
  bool has_intensity_;
  bool plain_ranges_;  ///< they have no errors except the offset
  const Georeference* georeference_;
  std::unique_ptr<SurfaceNormals> normals_;
  SensorPoses surface_pose_;  ///< in the middle of a surface's time, if it is known
};

}  // namespace risley::cloud
