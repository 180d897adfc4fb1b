// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "optics/batch_kernel.hpp"

#include <array>

#include "risley/core/simd.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_adjoint.hpp"

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
  EmitterLanes<Batch, N> emitters(a.parameters, a.emitters, a.beam);
  auto train = prepare<Batch, N>(inputs.parameters, face_orders<N>(a.face_order));
  std::array<Batch, 2 * N> face_position;
  for (std::size_t i = 0; i < 2 * N; ++i) {
    face_position[i] = Batch(a.face_position ? a.face_position[i] : 0.0);
  }
  std::size_t invalid = 0;
  for (std::size_t shot = 0; shot < a.shots; shot += kLanes) {
    emitters.select(shot, a.shots);
    emitters.apply(train);
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
void store_gradient(const BatchArguments& a, const EmitterLanes<Batch, N>& emitters,
                    const Gradient<Batch, N>& gradient, double* const* columns, std::size_t shot) {
  Batch storage[EmitterLanes<Batch, N>::kPlaces];
  const Batch* by_place = emitters.by_place(gradient, storage);
  const auto places = static_cast<std::size_t>(parameter_count(TrainShape{N, a.emitters}));
  for (std::size_t i = 0; i < places; ++i) store(by_place[i], columns[i], shot, a.shots);
  for (std::size_t i = 0; i < N; ++i) {
    store(gradient.rotation_angles[i], columns[places + i], shot, a.shots);
  }
}

template <int N>
std::size_t linearise_shots(const BatchArguments& a) {
  const Inputs<N> inputs(a);
  const auto order = face_orders<N>(a.face_order);
  EmitterLanes<Batch, N> emitters(a.parameters, a.emitters, a.beam);
  auto train = prepare<Batch, N>(inputs.parameters, order);
  auto derivatives = prepare_derivatives<Batch, N>(inputs.parameters, order);
  std::size_t invalid = 0;
  for (std::size_t shot = 0; shot < a.shots; shot += kLanes) {
    emitters.select(shot, a.shots);
    emitters.apply(train);
    emitters.apply(derivatives);
    const auto result = linearise_angles(train, derivatives, inputs.angles(shot));
    invalid += count_invalid(result.direction.x, shot, a.shots);
    store(result.angles.azimuth, a.azimuth, shot, a.shots);
    store(result.angles.zenith, a.zenith, shot, a.shots);
    store_gradient<N>(a, emitters, result.azimuth, a.d_azimuth, shot);
    store_gradient<N>(a, emitters, result.zenith, a.d_zenith, shot);
  }
  return invalid;
}

}  // namespace

std::size_t observe(const BatchArguments& a) {
  return with_prism_count(a.prisms, [&]<int N>() { return observe_shots<N>(a); });
}

std::size_t linearise(const BatchArguments& a) {
  return with_prism_count(a.prisms, [&]<int N>() { return linearise_shots<N>(a); });
}

}  // namespace risley::RISLEY_KERNEL_NAMESPACE
