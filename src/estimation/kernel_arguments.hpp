// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "risley/optics/prism.hpp"

namespace risley::estimation {

// Arguments common to the kernels over the shots of a series. Plain, see optics/batch_kernel.hpp
// for why; kernel_call.hpp fills it in.

/// A train and its free parameters.
struct TrainArguments {
  const double* parameters = nullptr;     ///< whole flat vector
  const FaceOrder* face_order = nullptr;  ///< [prisms]
  TrainLayout prisms;
  int emitters = 1;
  int free = 0;                      ///< number of free parameters, at most one per place
  const int* place_begin = nullptr;  ///< [free + 1], into places
  const int* places = nullptr;       ///< of the flat vector
};

/// Columns of a series.
struct ShotArguments {
  const std::int64_t* time_ns = nullptr;
  const std::uint8_t* beam = nullptr;  ///< each below emitters, or nullptr: all the first
  const double* azimuth = nullptr;
  const double* zenith = nullptr;
  const float* azimuth_rounding_variance = nullptr;
  const float* zenith_rounding_variance = nullptr;
};

}  // namespace risley::estimation
