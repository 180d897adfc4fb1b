// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/calibration/calibration_verdict.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/calibration/planar_adjustment.hpp"
#include "risley/calibration/plane_points.hpp"
#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/scenes/scene.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::calibration {

/// How a calibration is made.
enum class CalibrationMethod {
  adjustment,  ///< Gauss-Helmert adjustment of all recordings together: adjust()
  paper,       ///< unweighted point-to-plane distances, SVD planes                [B21 Eq. (32)]
};

/// Formal sigma of the shared rotation above which a warning is given, rad (0.05 degree).
inline constexpr double kPoorDatum = 8.7266462599716477e-4;

/// A direction of the parameter space wider than this after the data makes a calibration fail, in
/// prior sigmas of the parameters (1 degree, 0.01 in an index).
inline constexpr double kWidestDirection = 0.5;

/// Whether recordings from unknown poses saw the same walls and so share their shape.
enum class SameWalls {
  if_found,  ///< if their planes fit in one way only
  yes,       ///< or there is no calibration
  no,
};

/// Method and assumptions of a calibration on planes.
struct CalibrationOptions {
  CalibrationMethod method = CalibrationMethod::adjustment;
  sensors::Sensor sensor;  ///< noise, geometry, name; its errors are not used
  /// Default free parameters to hold, at the believed value or a given one, SI units.
  std::vector<std::pair<std::string, std::optional<double>>> fixed;
  std::vector<std::string> additional;  ///< further parameters to free
  std::optional<double> range_noise;    ///< 1 sigma, m, default the sensor's
  std::optional<double> prior_sigma;    ///< of every free angle about the believed value, rad
  double range_offset_sigma = 0.05;     ///< prior of the range offset, m; 0 holds it at 0
  /// Root mean square error of directions up to which a unit counts as sound, rad; default the
  /// sensor's specification. 0: every significant error is too large.
  std::optional<double> tolerance;
  bool beam_origin = true;  ///< beams start at the exit point of the last prism
  /// Of the walls. Without parameters they are exact planes, and ranges have only a constant error,
  /// as the paper assumes.
  ShapePrior shape = building_walls();
  /// Largest offset of patches of another reflectivity from their wall, m: this much of the
  /// intensity-dependent error cannot be separated from it. 0 for painted patches and boards let
  /// into a wall.
  double patch_thickness = 0.01;
  std::optional<scenes::Scene> planes;  ///< known normals, as seen from the scene's origin
  /// The station of each recording [recordings]; empty: unknown poses, or the origin of the scene
  /// if planes are given.
  std::vector<scenes::Station> stations;
  SameWalls same_walls = SameWalls::if_found;  ///< without planes and stations
  std::uint64_t seed = 0;                      ///< of the search for planes
};

/// An adjusted size of the prisms or range error, by its name in presets.
struct CalibratedNumber {
  std::string name;
  double value = 0, prior = 0, prior_sigma = 0;  ///< SI
  double sigma = 0;                              ///< if all held quantities were exact, SI
  double total_sigma = 0;                        ///< what was held included, SI
};

/// One wall in one recording.
struct CalibratedPlane {
  std::string name;
  std::size_t recording = 0;
  Vector3<double> normal;  ///< sensor frame
  double distance = 0;     ///< from the sensor's origin, m
  Plane believed;          ///< fitted to the points of the believed parameters, sensor frame
  std::size_t points = 0;
  /// Shots near the plane (within ten sigmas) that were not used.
  std::size_t outliers = 0;
  double rms = 0;          ///< of point-to-plane distances after the calibration, m
  double rms_before = 0;   ///< the same with the believed parameters, of the believed plane, m
  double range_sigma = 0;  ///< of one range, found by variance components, m
  /// Root mean square deviation of the wall from its plane at the shots, m, and its correlation
  /// length; 0 if walls are taken as flat.
  double shape_sigma = 0, shape_length = 0;
};

/// A compact region that stands off its plane by a constant step.
struct SurfaceStep {
  std::size_t recording = 0, plane = 0;  ///< row of Calibration::planes
  double height = 0;                     ///< m, positive away from the sensor
  double azimuth = 0, zenith = 0;        ///< middle of the region, rad, sensor frame
  double size = 0;                       ///< square root of the solid angle it fills, rad
  std::size_t points = 0;
};

/// Mean distance from the plane over a variable, before and after.
struct ThicknessProfile {
  std::string variable;                         ///< "incidence", "rotation_angle_a", ...
  std::vector<double> from, to;                 ///< bin edges, rad
  std::vector<std::size_t> count;               ///< [bins]
  std::vector<double> rms_before, rms_after;    ///< [bins], m; NaN in an empty bin
  std::vector<double> mean_before, mean_after;  ///< [bins], m; NaN in an empty bin
};

/// Everything one calibration found.
struct Calibration {
  bool converged = false;
  std::string reason;  ///< why not; empty when converged
  CalibrationVerdict verdict;
  std::vector<Warning> warnings;
  CalibrationMethod method = CalibrationMethod::adjustment;
  sensors::Sensor sensor;  ///< calibrated, with covariance
  PrismTrain believed;     ///< with which the sensor computed directions
  std::vector<estimation::FreeParameter> free;
  Eigen::VectorXd parameters;  ///< [free], SI
  /// [free, free], common errors of the rotation angles and the shape of the walls included, if all
  /// held quantities were exact.
  Eigen::MatrixXd covariance;
  /// Sizes of the prisms and range errors: range_offset_m, range_near_m, ...
  std::vector<CalibratedNumber> numbers;
  /// Held parameters that may be wrong, and the effect of one sigma of each on parameters and
  /// numbers [free, held], [numbers, held]. An error in one compensates for the other in the beams'
  /// directions.
  std::vector<std::string> held;
  Eigen::MatrixXd held_changes, number_held_changes;

  /// Sigma of a free parameter, held quantities included.
  double total_sigma(std::size_t parameter) const;
  /// One of the numbers, or nullptr if it was not adjusted.
  const CalibratedNumber* number(std::string_view name) const;
  std::vector<CalibratedPlane> planes;
  std::vector<SurfaceStep> steps;
  /// Whether recordings from unknown poses saw the same walls.
  bool same_walls = false;
  DatumKind datum_kind = DatumKind::none;
  FormalDatum datum;                 ///< after, everything included
  FormalDatum datum_given_held;      ///< if all held quantities were exact
  FormalDatum datum_without_common;  ///< without the common errors of the rotation angles
  PointingError pointing_error;      ///< of the directions that the sensor reports
  double tolerance = 0;              ///< used for the verdict on pointing_error, rad; 0: none
  /// That calibrated directions are nearer to the truth than reported ones, root mean square over
  /// the beams, if held values are exact. docs/theory/calibration.md
  double better_probability = 1;
  std::vector<estimation::WeakDirection> unobservable;
  std::vector<PriorTest> prior_tests;
  bool unit_doubted = false;  ///< of the ranges, which no recording states
  double sigma0 = 0;          ///< standard deviation of unit weight against the stated range noise
  /// Deviation of the walls from planes, mean after the data; all 0 if they are taken as flat.
  ShapeParameters shape;
  int iterations = 0;  ///< of the longest adjustment, the one that starts from the believed values
  /// Shift of each recording's rotation angles due to the common estimate of the believed
  /// parameters [recordings][prisms], rad.
  std::vector<std::vector<double>> angle_shift;
  double rms_before = 0, rms_after = 0;  ///< over all planes, m
  std::size_t points = 0;                ///< used
  std::vector<ThicknessProfile> profiles;
  /// Row of planes for which each shot was used, -1: none [recordings][shots].
  std::vector<std::vector<int>> plane_of_shot;
};

/// Calibrates a sensor on the walls in its recordings.
/// @throws EstimationError when there is no basis for a calibration: no plane, points on one line,
/// recordings of different sensors, stations or planes that contradict the data
/// @throws InvalidArgument for unknown parameters, stations that do not match the recordings, noise
/// or sigmas out of range, columns or matrices that do not match a recording's prisms, shots and
/// free parameters
Calibration calibrate(const std::vector<RangedRecording>& recordings,
                      const CalibrationOptions& options, const Progress& progress = {});

}  // namespace risley::calibration
