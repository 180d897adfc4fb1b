// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "cloud/shot_surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "risley/core/square.hpp"
#include "risley/sensors/range_values.hpp"

#include "cloud/georeference_kernel.hpp"
#include "cloud/pose_columns.hpp"

namespace risley::cloud {
namespace {

using recordings::Observations;

/// Time for which surfaces are assumed to stand still: docs/theory/cloud.md
constexpr std::int64_t kSurfaceNs = 1'000'000'000;
/// The same for a moving sensor, whose shots are combined as if it stood still.
constexpr std::int64_t kMovingSurfaceNs = 200'000'000;
constexpr std::size_t kMovingSurfaceShots = 4000;
/// Number of shots that determine a surface: on the 1160 cells of a Mid-40's field of view, a
/// circle of 38.4 degrees, 14 each and 120 in a block of nine.
constexpr std::size_t kSurfaceShots = 16000;
/// Range step of these sensors, for distinguishing surfaces, m.
constexpr double kLeastRangeNoise = 1e-3;

/// Iterations that find a true range from a reported one: each leaves some hundredths of the error.
constexpr int kRangeSteps = 4;

}  // namespace

std::vector<std::int64_t> times_of(const Observations& piece,
                                   const std::vector<std::size_t>& rows) {
  std::vector<std::int64_t> times(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) times[i] = piece.time_ns[rows[i]];
  return times;
}

ShotSurfaces::ShotSurfaces(const sensors::Sensor& calibration, double angle_noise,
                           bool has_intensity, const Georeference* georeference)
    : calibration_(calibration),
      angle_noise_(angle_noise),
      has_intensity_(has_intensity),
      plain_ranges_(calibration.range_errors == sensors::RangeErrors{}),
      georeference_(georeference) {
  expect_distortion(0);
}

void ShotSurfaces::expect_distortion(double distortion) {
  const double range = std::sqrt(calibration_.range_variance(0, 0, 255) +
                                 square(calibration_.range_resolution) / 12.0);
  const double direction =
      square(angle_noise_) + square(distortion) + square(calibration_.angle_resolution) / 12.0;
  normals_ =
      std::make_unique<SurfaceNormals>(std::max(range, kLeastRangeNoise), std::sqrt(direction));
}

/// A range corrected for the range errors that need no known surface, but with the offset.
double ShotSurfaces::range_with_offset(const Observations& piece, std::size_t row) const {
  const double reported = piece.range[row];
  if (plain_ranges_) return reported;
  const double intensity =
      has_intensity_ ? static_cast<double>(piece.intensity[row]) : sensors::kWalkIntensity;
  double range = reported - calibration_.range_offset;
  for (int step = 0; step < kRangeSteps; ++step) {
    range = reported - sensors::range_error(calibration_, range, 0, intensity, piece.beam[row]);
  }
  return range + calibration_.range_offset;
}

std::size_t ShotSurfaces::find(const Observations& piece, std::size_t begin, std::size_t end) {
  const std::int64_t first = piece.time_ns[begin];
  const std::int64_t longest = georeference_ ? kMovingSurfaceNs : kSurfaceNs;
  for (std::size_t row = begin; row < end; ++row) {
    if (std::llabs(piece.time_ns[row] - first) >= longest) end = row;
  }
  normals_->clear();
  const std::size_t most = georeference_ ? kMovingSurfaceShots : kSurfaceShots;
  const std::size_t stride = std::max<std::size_t>(1, (end - begin) / most);
  std::vector<std::size_t> rows;
  for (std::size_t row = begin; row < end; row += stride) {
    if (has_return(piece, row)) rows.push_back(row);
  }
  if (georeference_) {
    add_moving(piece, piece.time_ns[begin] + (piece.time_ns[end - 1] - piece.time_ns[begin]) / 2,
               rows);
  } else {
    for (const std::size_t row : rows) {
      normals_->add(piece.azimuth[row], piece.zenith[row],
                    range_with_offset(piece, row) - calibration_.range_offset);
    }
  }
  normals_->fit();
  return end;
}

/// Adds rows to the surfaces as if the sensor stayed at its pose at a time, if it is known.
void ShotSurfaces::add_moving(const Observations& piece, std::int64_t middle_ns,
                              const std::vector<std::size_t>& rows) {
  std::vector<std::size_t> known;
  georeference_->find_poses({&middle_ns, 1}, surface_pose_, known);
  if (known.empty()) return;
  SensorPoses poses;
  georeference_->find_poses(times_of(piece, rows), poses, known);
  PolarShots shots, stood;
  for (const std::size_t i : known) {
    shots.azimuth.push_back(piece.azimuth[rows[i]]);
    shots.zenith.push_back(piece.zenith[rows[i]]);
    shots.range.push_back(range_with_offset(piece, rows[i]));
  }
  stand_still(poses, shots.azimuth, shots.zenith, shots.range, stood);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    normals_->add(stood.azimuth[i], stood.zenith[i], stood.range[i]);
  }
}

/// Transforms shots of a moving sensor to its pose in the middle of a surface's time. @param range
/// as returned by range_with_offset()
void ShotSurfaces::stand_still(const SensorPoses& poses, const std::vector<double>& azimuth,
                               const std::vector<double>& zenith, const std::vector<double>& range,
                               PolarShots& stood) const {
  const std::size_t n = poses.size();
  stood.resize(n);
  if (n == 0) return;
  StandArguments a;
  a.poses = pose_columns(poses);
  a.shots = n;
  a.azimuth = azimuth.data();
  a.zenith = zenith.data();
  a.range = range.data();
  a.range_offset = calibration_.range_offset;
  for (std::size_t k = 0; k < 9; ++k) a.turn[k] = surface_pose_.turn[k].front();
  for (std::size_t k = 0; k < 3; ++k) a.reference[k] = surface_pose_.reference[k].front();
  a.stood_azimuth = stood.azimuth.data();
  a.stood_zenith = stood.zenith.data();
  a.stood_range = stood.range.data();
  RISLEY_KERNEL_COPIES(stand_shots).at(best_instruction_set())(a);
}

void ShotSurfaces::find_normals(const Observations& piece, const std::vector<std::size_t>& rows,
                                const SensorPoses& poses, PointedShots& shots) const {
  const std::size_t n = shots.size();
  std::vector<double> range(n);
  for (std::size_t i = 0; i < n; ++i) range[i] = range_with_offset(piece, rows[i]);
  const auto set = [&shots](std::size_t i, const Vector3<double>& normal) {
    shots.surface_normal[0][i] = normal.x;
    shots.surface_normal[1][i] = normal.y;
    shots.surface_normal[2][i] = normal.z;
  };
  if (surface_pose_.size() == 0) {
    const double nowhere = std::nan("");
    for (std::size_t i = 0; i < n; ++i) {
      set(i, normals_->normal(georeference_ ? nowhere : shots.azimuth[i], shots.zenith[i],
                              range[i] - calibration_.range_offset));
    }
    return;
  }
  if (n == 0) return;
  PolarShots stood;
  stand_still(poses, shots.azimuth, shots.zenith, range, stood);
  for (std::size_t i = 0; i < n; ++i) {
    set(i, normals_->normal(stood.azimuth[i], stood.zenith[i], stood.range[i]));
  }
  TurnArguments a;
  a.poses = pose_columns(poses);
  a.shots = n;
  for (std::size_t k = 0; k < 9; ++k) a.turn[k] = surface_pose_.turn[k].front();
  for (std::size_t axis = 0; axis < 3; ++axis) a.vector[axis] = shots.surface_normal[axis].data();
  RISLEY_KERNEL_COPIES(turn_vectors).at(best_instruction_set())(a);
}

}  // namespace risley::cloud
