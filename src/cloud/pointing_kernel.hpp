// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/core/instruction_set.hpp"
#include "risley/optics/prism.hpp"

namespace risley::cloud {

/// Most common factors that a call can take.
inline constexpr int kMostFactors = 96;
/// Most sizes of prisms that a call can take: the common ones, and the thickness of every prism and
/// the spacing after every one but the last.
inline constexpr int kMostSizes = 2 + 2 * kMaxPrisms - 1;

/// Quantities of a mount: trajectories::kMountQuantities, whose header must not be included in
/// kernels.
inline constexpr int kMountEffects = 7;

/// Errors of ranges that depend on the shot: near range, incidence, intensity, then the emitters'.
enum RangeShare { kNearShare, kIncidenceShare, kDecadeShare, kEmitterShares };
/// Cosine of the angle of incidence (80 degrees) from which on the depth of a footprint does not
/// grow further: the plane of a surface is not known well enough.
inline constexpr double kLeastCosine = 0.17364817766693033;

/// Plain arguments of one call, see optics/batch_kernel.hpp for why they are plain. Every column
/// has one entry per shot and room for whole groups: a multiple of kPointPadding.
inline constexpr std::size_t kPointPadding = 8;

struct PointArguments {
  TrainLayout prisms;
  int emitters = 1;
  const FaceOrder* face_order = nullptr;        ///< [prisms]
  const double* parameters = nullptr;           ///< whole flat vector: the true optics
  const double* believed_parameters = nullptr;  ///< the optics of the reported directions; may be
                                                ///< equal
  const double* face_position = nullptr;        ///< [2 prisms], m
  int sizes = 0;                                ///< of prisms that may have a factor
  const double* face_over_size = nullptr;       ///< d face position / d size [sizes][2 prisms]
  bool reported_directions = false;  ///< points use the reported directions, not the model's

  double angle_noise_variance = 0;  ///< of reported angles before rounding, rad^2
  double range_offset = 0;          ///< m
  /// Whether ranges have further errors than the offset or factors of such: see
  /// sensors::RangeErrors.
  bool range_errors = false;
  double range_near = 0, range_incidence = 0, range_per_decade = 0;
  const double* range_emitter = nullptr;                      ///< [emitters], m
  double divergence_horizontal = 0, divergence_vertical = 0;  ///< full angles, rad
  /// Parts of the range's variance, m^2, see sensors::Sensor::range_variance.
  double range_variance = 0, range_variance_per_range2 = 0, range_variance_incidence = 0,
         range_variance_weak_return = 0;
  /// Of the beam's direction before the prisms, rad^2.
  double divergence_variance_horizontal = 0, divergence_variance_vertical = 0;

  /// Common factors: the effect of one standard deviation of each on the flat vector's places, on
  /// the rotation angles and on the sizes, in rows of that order [place_count + prisms + sizes],
  /// and on the range offset. Entries [factor_begin[k], factor_begin[k + 1]) are factor k's.
  const int* places = nullptr;
  int place_count = 0;
  int factors = 0;
  const int* factor_begin = nullptr;  ///< [factors + 1]
  const int* factor_row = nullptr;
  const double* factor_weight = nullptr;
  const double* range_factor = nullptr;  ///< [factors], m
  /// The same for range_errors: rows are numbered as in RangeShare.
  const int* range_begin = nullptr;  ///< [factors + 1]
  const int* range_row = nullptr;
  const double* range_weight = nullptr;
  /// Of a moving sensor, or nullptr, the effect of one standard deviation on the mount, in the same
  /// way: rows are rotations about the sensor's axes, rad, shifts along them, m, and clock, s.
  const int* mount_begin = nullptr;
  const int* mount_row = nullptr;
  const double* mount_weight = nullptr;
  /// Then also velocity and rate of turning of the sensor, its axes, m/s and rad/s [3][shots].
  const double *velocity[3] = {}, *rate[3] = {};

  std::size_t shots = 0;
  /// [prisms][shots], rad, or nullptr: then directions are as reported and start at the origin.
  const double* const* rotation_angle = nullptr;
  const double* const* angle_covariance = nullptr;  ///< [prisms (prisms+1)/2][shots], rad^2
  const std::uint8_t* beam = nullptr;               ///< [shots], each below emitters
  const double* azimuth = nullptr;                  ///< [shots], as reported, rad
  const double* zenith = nullptr;
  const double* azimuth_variance = nullptr;  ///< [shots], of the rounding, rad^2
  const double* zenith_variance = nullptr;
  const double* range = nullptr;              ///< [shots], as reported, m
  const double* rounding_variance = nullptr;  ///< [shots], of the range, m^2
  const double* intensity = nullptr;          ///< [shots]; negative: not known
  /// Unit normal of the surface hit by a shot, NaN if it is not known [3][shots].
  const double* const* surface_normal = nullptr;

  double* point[3] = {};       ///< [shots], m; NaN if the beam does not get through
  double* covariance[6] = {};  ///< upper triangle [shots], m^2, or nullptr
  /// The same without the common factors; nullptr as a whole if not needed.
  double* own_covariance[6] = {};
  double* corrected_range = nullptr;
  double* incidence = nullptr;  ///< [shots], rad
  /// [shots], rad, or nullptr; those of outliers are only large.
  double* azimuth_residual = nullptr;
  double* zenith_residual = nullptr;
  double* const* loading = nullptr;  ///< [factors * 3][shots], m, or nullptr
};

RISLEY_DECLARE_KERNEL(void compute_points(const PointArguments& arguments))

}  // namespace risley::cloud
