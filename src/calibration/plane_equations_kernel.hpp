// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/core/instruction_set.hpp"
#include "risley/optics/parameters.hpp"
#include "risley/optics/prism.hpp"

namespace risley::calibration {

/// A beam that meets the plane at a flatter angle, as the cosine of the angle of incidence, counts
/// as parallel to it.
inline constexpr double kLeastApproach = 1e-3;

/// Most terms of the range errors: near, incidence, intensity and one per emitter.
inline constexpr int kMostRangeTerms = 3 + kMaxEmitters;
/// Most sizes of prisms by which one call differentiates: every thickness and spacing.
inline constexpr int kMostSizes = 2 * kMaxPrisms;

/// Plain arguments of one call, see optics/batch_kernel.hpp for why they are plain. Columns are
/// those of all shots; the call processes shots [begin, end).
struct PlaneArguments {
  const double* parameters = nullptr;     ///< whole flat vector
  const FaceOrder* face_order = nullptr;  ///< [prisms]
  TrainLayout prisms;
  int emitters = 1;
  const double* face_position = nullptr;  ///< [2 prisms]
  const int* places = nullptr;            ///< of the flat vector, at most all of them
  int place_count = 0;
  const double* size_rates = nullptr;  ///< d face position / d size [size_count][2 prisms]
  int size_count = 0;
  const double* term_values = nullptr;  ///< [term_count], factors of the terms' columns
  int term_count = 0;
  double range_offset = 0;
  double range_variance = 0;
  double normal[3] = {0, 0, 0};
  double distance = 0;
  double tangent[2][3] = {{0, 0, 0}, {0, 0, 0}};

  const double* const* rotation_angle = nullptr;   ///< [prisms][shots]
  const float* const* angle_covariance = nullptr;  ///< [prisms (prisms+1)/2][shots]
  const double* range = nullptr;                   ///< [shots]
  const float* const* range_terms = nullptr;       ///< [term_count][shots]
  const std::uint8_t* beam = nullptr;  ///< [shots], each below emitters, or nullptr: all the first
  std::size_t begin = 0, end = 0;

  /// Weighted products of the columns of PlaneColumns and, behind them, the residual: upper
  /// triangle row by row [(columns + 1) (columns + 2) / 2].
  double* products = nullptr;
  /// First shot of every cell, and behind the last one its end [cells + 1], or nullptr; shots that
  /// belong together follow each other. The call begins and ends with a cell.
  const std::uint32_t* cell_begin = nullptr;
  std::size_t first_cell = 0;  ///< that holds shot `begin`
  /// Weighted products of distance, normal 1 and normal 2 with all columns and the residual
  /// [cells][3][columns + 1], of all cells.
  double* cell_products = nullptr;
  double* residual = nullptr;  ///< [shots], or nullptr
  double* variance = nullptr;  ///< [shots], or nullptr
};

/// @return number of lost shots
RISLEY_DECLARE_KERNEL(std::size_t accumulate_plane(const PlaneArguments& arguments))

}  // namespace risley::calibration
