// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/core/instruction_set.hpp"

#include "estimation/kernel_arguments.hpp"

namespace risley::estimation {

/// Sums per pair of rotors over a knot's shots: weight x (d angles / d rotation angle) products
/// times the shot's time since the knot to the power 0 to 4.
inline constexpr int kTimePowers = 5;
/// Angle, speed and acceleration of a rotor at a knot.
inline constexpr int kRotorStates = 3;

/// Plain arguments of one call. Columns are those of the whole series; the call works on knots
/// [knot_begin, knot_end).
struct NormalEquationArguments : TrainArguments, ShotArguments {
  std::size_t knot_begin = 0, knot_end = 0;
  const std::size_t* first_shot = nullptr;  ///< [knots]
  const std::size_t* last_shot = nullptr;   ///< [knots], one behind the last
  const std::int64_t* knot_time_ns = nullptr;
  const double* state = nullptr;  ///< [knots][prisms][3]; angles of any number of turns
  /// Without rounding, rad^2.
  double azimuth_noise_variance = 0, zenith_noise_variance = 0;
  bool turned = false;   ///< some place is one of the frame's turn
  double softening = 0;  ///< shots weigh 1 / (1 + softening chi2)^2
  double cut = 0;        ///< shots with a larger chi2 have no weight

  double* curvature = nullptr;         ///< [knots][prisms (prisms+1)/2][kTimePowers]
  double* coupling = nullptr;          ///< [knots][prisms][3][free]
  double* gradient = nullptr;          ///< [knots][prisms][3]
  double* static_hessian = nullptr;    ///< [free (free+1)/2], upper triangle row by row
  double* static_gradient = nullptr;   ///< [free]
  double* azimuth_residual = nullptr;  ///< [shots], or nullptr
  double* zenith_residual = nullptr;
  unsigned char* outlier = nullptr;  ///< [shots], or nullptr
};

/// What else a call finds.
struct NormalEquationCounts {
  double cost = 0;           ///< sum of robust losses
  std::size_t outliers = 0;  ///< shots beyond the cut, or without a modelled direction
};

RISLEY_DECLARE_KERNEL(NormalEquationCounts accumulate(const NormalEquationArguments& arguments))

}  // namespace risley::estimation
