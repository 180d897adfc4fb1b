// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/cloud/rotor_tracking.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/sensors/range_errors.hpp"
#include "risley/sensors/sensor.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::cloud {

/// How points are made from shots.
struct PointingOptions {
  /// Points go where the sensor says; otherwise where the calibration sends the beam at the
  /// smoothed rotation angles.
  bool reported_directions = false;
  bool beam_origin = true;      ///< the beam starts at the last prism, not at the frame's origin
  bool beam_divergence = true;  ///< the footprint's size is part of the covariance
  bool covariance = true;
};

/// One quantity that all points of a cloud share an error of, times one standard deviation.
struct CommonFactor {
  std::string name;
  Eigen::VectorXd
      weights;  ///< [places + prisms + sizes]: flat vector, rotation angles, sizes of prisms
  double range_offset = 0;  ///< m
  sensors::RangeErrors range_errors = {};
  /// Of the mount, in the order of trajectories::mount_names() but all of it along the axes of the
  /// sensor, rad, m and s.
  std::array<double, trajectories::kMountQuantities> mount{};
};

/// Where the beam of a sensor goes, and how wrong that may be. Derivation: docs/theory/cloud.md
struct PointingModel {
  PrismTrain train;     ///< where it truly goes
  PrismTrain believed;  ///< what the sensor computes directions with
  /// What the parameters were held against, or count as: never none.
  sensors::CalibrationReference reference = sensors::CalibrationReference::directions;
  PrismGeometry geometry;  ///< all zero without a beam origin
  /// Sizes of the prisms that factors have a weight for.
  std::vector<PrismSize> sizes = shared_prism_sizes();
  double range_offset = 0;  ///< m
  /// Taken off ranges too; that of the incidence only where the surface is known.
  sensors::RangeErrors range_errors = {};
  double angle_noise = 0;  ///< of reported directions, rad
  sensors::Sensor sensor;  ///< range noise and rounding are taken from here
  PointingOptions options;
  std::vector<int> places;  ///< of the flat vector that have a common factor
  std::vector<CommonFactor> factors;
  bool moves = false;  ///< the sensor, on a mount whose errors are among the factors
  /// The mount was found together with the parameters of another calibration than this one: what
  /// their errors have in common is not known.
  bool mount_of_another = false;
};

/// Standard deviation of a direction within a beam of a full divergence angle: a quarter of it.
/// [Lichti and Gordon 2004, error propagation in directly georeferenced terrestrial laser scanner
/// point clouds: the uncertainty of a uniformly lit beam]
inline constexpr double kDivergenceSigma = 0.25;

/// A model from a calibration and what the beginning of a recording says of the sensor.
/// - Calibrated against directions: the reported directions are taken as true but for their noise.
///   Rotation angles were found with the same parameters, so an error of the parameters moves them
///   too and most of it cancels.
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

/// Whether points depend on the rotation angles at all: not where they go where the sensor says,
/// start at the frame's origin, and the sensor's own directions are taken as true.
bool needs_rotation_angles(const sensors::Sensor& calibration, const PointingOptions& options);

/// A model without rotation angles. The footprint is then taken to keep the orientation that it has
/// before the prisms.
/// @param angle_noise  rad; empty: the calibration's
/// @throws InvalidArgument where needs_rotation_angles(), for angle noise below 0
PointingModel reported_pointing_model(const sensors::Sensor& calibration,
                                      const PointingOptions& options,
                                      std::optional<double> angle_noise,
                                      const std::optional<trajectories::Mount>& mount = {});

}  // namespace risley::cloud
