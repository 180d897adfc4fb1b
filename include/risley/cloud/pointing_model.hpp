// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/cloud/rotor_tracking.hpp"
#include "risley/cloud/station.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/sensors/range_errors.hpp"
#include "risley/sensors/sensor.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::cloud {

/// Options for computing points from shots.
struct PointingOptions {
  /// Points in the reported directions; otherwise in the calibrated directions at the smoothed
  /// rotation angles.
  bool reported_directions = false;
  bool beam_origin = true;      ///< the beam starts at the last prism, not at the frame's origin
  bool beam_divergence = true;  ///< the footprint's size is part of the covariance
  bool covariance = true;
};

/// A quantity with an error that all points of a cloud share, times one standard deviation.
struct CommonFactor {
  std::string name;
  Eigen::VectorXd
      weights;  ///< [places + prisms + sizes]: flat vector, rotation angles, sizes of prisms
  double range_offset = 0;  ///< m
  sensors::RangeErrors range_errors = {};
  /// It comes from one recording and not from the calibration: other recordings of the same sensor
  /// have their own.
  bool of_recording = false;
  /// Of the mount, in the order of trajectories::mount_names() but all of it along the axes of the
  /// sensor, rad, m and s.
  std::array<double, trajectories::kMountQuantities> mount{};
};

/// The beam of a sensor and its uncertainty. Derivation: docs/theory/cloud.md
struct PointingModel {
  PrismTrain train;     ///< where it truly goes
  PrismTrain believed;  ///< with which the sensor computes directions
  /// Actual or assumed reference of the parameters: never none.
  sensors::CalibrationReference reference = sensors::CalibrationReference::directions;
  PrismGeometry geometry;  ///< all zero without a beam origin
  /// Sizes of the prisms that factors have a weight for.
  std::vector<PrismSize> sizes = shared_prism_sizes();
  double range_offset = 0;  ///< m
  /// Subtracted from ranges too; that of the incidence only if the surface is known.
  sensors::RangeErrors range_errors = {};
  double angle_noise = 0;  ///< of reported directions, rad
  sensors::Sensor sensor;  ///< range noise and rounding are taken from here
  PointingOptions options;
  std::vector<int> places;  ///< of the flat vector with a common factor
  std::vector<CommonFactor> factors;
  /// The sensor has a pose, on a mount or a tripod, and the errors of the pose are among the
  /// factors.
  bool has_pose = false;
  /// The mount was adjusted together with the parameters of another calibration than this one:
  /// their common errors are unknown.
  bool mount_of_another = false;
};

/// Standard deviation of a direction within a beam of a full divergence angle: a quarter of it.
/// [Lichti and Gordon 2004, error propagation in directly georeferenced terrestrial laser scanner
/// point clouds: the uncertainty of a uniformly lit beam]
inline constexpr double kDivergenceSigma = 0.25;

/// A model from a calibration and the beginning of a recording.
/// - Calibrated against directions: the reported directions are taken as true except for their
///   noise. Rotation angles were found with the same parameters, so an error of the parameters
///   moves them too and most of it cancels.
/// - Calibrated against planes: directions come from the calibration, rotation angles from what the
///   sensor believes; both have errors of their own.
/// - Not calibrated, as a type or a unit of the simulator: as directions where the recording agrees
///   with the parameters within their sigmas, otherwise as planes with these sigmas.
/// @param mount  of a moving sensor; what its errors have in common with those of the calibration
///               counts where one adjustment found both, see trajectories::found_together
/// @throws InvalidArgument for a calibration of another sensor (face order, emitters), names in its
///         covariance that mean nothing to a point, matrices that do not belong to the free
///         parameters, angle noise below 0, and as require_mount
PointingModel pointing_model(const sensors::Sensor& calibration, const SensorBelief& belief,
                             const PointingOptions& options,
                             const std::optional<trajectories::Mount>& mount = {});

/// Prefix of the names of factors that stations share through the same targets.
inline constexpr const char* kTargets = "targets";

/// Adds the pose errors of a stationary sensor: the effect of the points' common factors on the
/// pose (if the sensor's own points determined it), the errors of the survey, and six factors of
/// the pose alone, those of the recording last.
/// @return how many of the last factors belong to the recording or the pose
/// @throws InvalidArgument for a response of another number of factors
std::size_t stand(PointingModel& model, const StandingPose& pose);

/// Whether points depend on the rotation angles at all: they do not if they use the reported
/// directions, start at the frame's origin, and the sensor's own directions are taken as true.
bool needs_rotation_angles(const sensors::Sensor& calibration, const PointingOptions& options);

/// A model without rotation angles. The footprint is then assumed to keep its orientation before
/// the prisms.
/// @param angle_noise  rad; empty: the calibration's
/// @throws InvalidArgument where needs_rotation_angles(), for angle noise below 0
PointingModel reported_pointing_model(const sensors::Sensor& calibration,
                                      const PointingOptions& options,
                                      std::optional<double> angle_noise,
                                      const std::optional<trajectories::Mount>& mount = {});

}  // namespace risley::cloud
