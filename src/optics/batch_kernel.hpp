// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

#include "risley/core/instruction_set.hpp"
#include "risley/optics/prism.hpp"

namespace risley {

/// Plain arguments of one kernel call: the kernels are compiled for other instruction sets than the
/// rest, so no type with inline functions may cross this border.
struct BatchArguments {
  const double* parameters = nullptr;     ///< whole flat vector
  const FaceOrder* face_order = nullptr;  ///< [prisms]
  TrainLayout prisms;
  int emitters = 1;
  std::size_t shots = 0;
  const double* const* rotation_angles = nullptr;  ///< [prisms][shots]
  const std::uint8_t* beam = nullptr;  ///< [shots], each below emitters, or nullptr: all the first
  double* direction[3] = {nullptr, nullptr, nullptr};
  double* azimuth = nullptr;
  double* zenith = nullptr;
  const double* face_position = nullptr;  ///< [2 prisms], for the origin
  double* origin[3] = {nullptr, nullptr, nullptr};
  double* const* d_azimuth =
      nullptr;  ///< [parameter_count(shape) + prisms][shots], some may be nullptr
  double* const* d_zenith = nullptr;
};

RISLEY_DECLARE_KERNEL(std::size_t observe(const BatchArguments& arguments))
RISLEY_DECLARE_KERNEL(std::size_t linearise(const BatchArguments& arguments))

}  // namespace risley
