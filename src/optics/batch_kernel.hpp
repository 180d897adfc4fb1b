// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/optics/prism.hpp"

namespace risley {

/// Plain arguments of one kernel call: the kernels are compiled for other instruction sets than
/// the rest, so nothing with inline functions of its own may cross this border.
struct BatchArguments {
  const double* parameters = nullptr;     ///< flat vector
  const FaceOrder* face_order = nullptr;  ///< [prisms]
  int prisms = 0;
  std::size_t shots = 0;
  const double* const* rotation_angles = nullptr;  ///< [prisms][shots]
  double* direction[3] = {nullptr, nullptr, nullptr};
  double* azimuth = nullptr;
  double* zenith = nullptr;
  const double* face_position = nullptr;  ///< [2 prisms], for the origin
  double* origin[3] = {nullptr, nullptr, nullptr};
  double* const* d_azimuth = nullptr;  ///< [parameter_count + prisms][shots]
  double* const* d_zenith = nullptr;
};

namespace kernel_baseline {
std::size_t observe(const BatchArguments& arguments);
std::size_t linearise(const BatchArguments& arguments);
}  // namespace kernel_baseline
namespace kernel_avx2 {
std::size_t observe(const BatchArguments& arguments);
std::size_t linearise(const BatchArguments& arguments);
}  // namespace kernel_avx2
namespace kernel_avx512 {
std::size_t observe(const BatchArguments& arguments);
std::size_t linearise(const BatchArguments& arguments);
}  // namespace kernel_avx512

}  // namespace risley
