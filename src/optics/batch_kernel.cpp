// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set with RISLEY_KERNEL = baseline, avx2, avx512. Every template
// instantiated here carries the batch type of that instruction set in its name, so the linker
// cannot take a wide copy for the rest of the program (tests/architecture checks it).
#include "optics/batch_kernel.hpp"

#include <array>

#include "risley/core/simd.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/observation_adjoint.hpp"

#define RISLEY_JOIN2(a, b) a##b
#define RISLEY_JOIN(a, b) RISLEY_JOIN2(a, b)
#define RISLEY_KERNEL_NAMESPACE RISLEY_JOIN(kernel_, RISLEY_KERNEL)

namespace risley::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;

/// Lanes [shot, shot + kLanes) of a column; beyond its end the last value is repeated.
Batch load(const double* column, std::size_t shot, std::size_t shots) {
  if (shot + kLanes <= shots) return Batch::load_unaligned(column + shot);
  alignas(64) double lanes[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) {
    lanes[i] = column[shot + i < shots ? shot + i : shots - 1];
  }
  return Batch::load_aligned(lanes);
}

void store(const Batch& value, double* column, std::size_t shot, std::size_t shots) {
  if (shot + kLanes <= shots) {
    value.store_unaligned(column + shot);
    return;
  }
  alignas(64) double lanes[kLanes];
  value.store_aligned(lanes);
  for (std::size_t i = 0; shot + i < shots; ++i) column[shot + i] = lanes[i];
}

/// How many of the lanes that stand for a shot are NaN.
std::size_t count_invalid(const Batch& value, std::size_t shot, std::size_t shots) {
  alignas(64) double lanes[kLanes];
  value.store_aligned(lanes);
  std::size_t count = 0;
  for (std::size_t i = 0; i < kLanes && shot + i < shots; ++i) count += lanes[i] != lanes[i];
  return count;
}

template <int N>
struct Inputs {
  std::array<Batch, parameter_count(N)> parameters;
  const BatchArguments& arguments;

  explicit Inputs(const BatchArguments& a) : arguments(a) {
    for (std::size_t i = 0; i < parameter_count(N); ++i) parameters[i] = Batch(a.parameters[i]);
  }
  std::array<Batch, N> angles(std::size_t shot) const {
    std::array<Batch, N> result;
    for (std::size_t i = 0; i < N; ++i) {
      result[i] = load(arguments.rotation_angles[i], shot, arguments.shots);
    }
    return result;
  }
};

/// Face orders as the templates want them, without a std::array function of FaceOrder.
template <int N>
std::array<FaceOrder, N> face_orders(const FaceOrder* order) {
  std::array<FaceOrder, N> result;
  __builtin_memcpy(&result, order, sizeof(result));
  return result;
}

template <int N>
std::size_t observe_shots(const BatchArguments& a) {
  const Inputs<N> inputs(a);
  const auto train = prepare<Batch, N>(inputs.parameters, face_orders<N>(a.face_order));
  std::array<Batch, 2 * N> face_position;
  for (std::size_t i = 0; i < 2 * N; ++i) {
    face_position[i] = Batch(a.face_position ? a.face_position[i] : 0.0);
  }
  std::size_t invalid = 0;
  for (std::size_t shot = 0; shot < a.shots; shot += kLanes) {
    Vector3<Batch> direction;
    if (a.face_position) {
      const auto forward = trace_forward(train, inputs.angles(shot));
      direction = forward.direction();
      const Vector3<Batch> origin = beam_origin(forward, face_position);
      store(origin.x, a.origin[0], shot, a.shots);
      store(origin.y, a.origin[1], shot, a.shots);
      store(origin.z, a.origin[2], shot, a.shots);
    } else {
      direction = trace(train, inputs.angles(shot)).direction;
    }
    invalid += count_invalid(direction.x, shot, a.shots);
    if (a.direction[0]) store(direction.x, a.direction[0], shot, a.shots);
    if (a.direction[1]) store(direction.y, a.direction[1], shot, a.shots);
    if (a.direction[2]) store(direction.z, a.direction[2], shot, a.shots);
    if (a.azimuth || a.zenith) {
      const auto angles = angles_from_direction(direction);
      if (a.azimuth) store(angles.azimuth, a.azimuth, shot, a.shots);
      if (a.zenith) store(angles.zenith, a.zenith, shot, a.shots);
    }
  }
  return invalid;
}

template <int N>
void store_gradient(const Gradient<Batch, N>& gradient, double* const* columns, std::size_t shot,
                    std::size_t shots) {
  for (std::size_t i = 0; i < parameter_count(N); ++i) {
    store(gradient.parameters[i], columns[i], shot, shots);
  }
  for (std::size_t i = 0; i < N; ++i) {
    store(gradient.rotation_angles[i], columns[parameter_count(N) + i], shot, shots);
  }
}

template <int N>
std::size_t linearise_shots(const BatchArguments& a) {
  const Inputs<N> inputs(a);
  const auto order = face_orders<N>(a.face_order);
  const auto train = prepare<Batch, N>(inputs.parameters, order);
  const auto derivatives = prepare_derivatives<Batch, N>(inputs.parameters, order);
  std::size_t invalid = 0;
  for (std::size_t shot = 0; shot < a.shots; shot += kLanes) {
    const auto result = linearise_angles(train, derivatives, inputs.angles(shot));
    invalid += count_invalid(result.direction.x, shot, a.shots);
    store(result.angles.azimuth, a.azimuth, shot, a.shots);
    store(result.angles.zenith, a.zenith, shot, a.shots);
    store_gradient<N>(result.azimuth, a.d_azimuth, shot, a.shots);
    store_gradient<N>(result.zenith, a.d_zenith, shot, a.shots);
  }
  return invalid;
}

}  // namespace

std::size_t observe(const BatchArguments& a) {
  switch (a.prisms) {
    case 1:
      return observe_shots<1>(a);
    case 2:
      return observe_shots<2>(a);
    case 3:
      return observe_shots<3>(a);
    default:
      return observe_shots<4>(a);
  }
}

std::size_t linearise(const BatchArguments& a) {
  switch (a.prisms) {
    case 1:
      return linearise_shots<1>(a);
    case 2:
      return linearise_shots<2>(a);
    case 3:
      return linearise_shots<3>(a);
    default:
      return linearise_shots<4>(a);
  }
}

}  // namespace risley::RISLEY_KERNEL_NAMESPACE
