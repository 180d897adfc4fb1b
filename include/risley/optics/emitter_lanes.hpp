// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "risley/core/simd.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley {

/// The flat vector of a kernel's plain arguments, every value in all lanes.
template <class Batch, TrainLayout N>
std::array<Batch, parameter_count(N)> parameter_batches(const double* parameters) {
  std::array<Batch, parameter_count(N)> result;
  for (std::size_t i = 0; i < parameter_count(N); ++i) result[i] = Batch(parameters[i]);
  return result;
}

/// Face orders of plain arguments, without a std::array function of FaceOrder: its name would not
/// contain the instruction set.
template <class Batch, TrainLayout N>
std::array<FaceOrder, N> face_orders(const FaceOrder* order) {
  std::array<FaceOrder, N> result;
  __builtin_memcpy(&result, order, sizeof(result));
  return result;
}

/// prepare() from a kernel's plain arguments.
template <class Batch, TrainLayout N>
PreparedTrain<Batch, N> prepared_train(const double* parameters, const FaceOrder* order) {
  return prepare<Batch, N>(parameter_batches<Batch, N>(parameters), face_orders<Batch, N>(order));
}

/// prepare_derivatives() from a kernel's plain arguments.
template <class Batch, TrainLayout N, class Wanted>
PreparedDerivatives<Batch, N> prepared_derivatives(const double* parameters, const FaceOrder* order,
                                                   const Wanted& wanted) {
  return prepare_derivatives<Batch, N>(parameter_batches<Batch, N>(parameters),
                                       face_orders<Batch, N>(order), wanted);
}

/// The emitters of a kernel's shots. With several, every lane has its own emitter: incident beam
/// and its derivatives are taken from a small table, lane by lane. For a single one nothing is
/// done, and everything remains as prepare() made it.
template <class Batch, TrainLayout N>
class EmitterLanes {
 public:
  /// Number of shots computed at once.
  static constexpr std::size_t kLanes = Batch::size;
  /// Places of the flat vector, with those of all emitters.
  static constexpr std::size_t kPlaces =
      static_cast<std::size_t>(parameter_count(TrainShape{N, kMaxEmitters}));

  /// @param parameters  whole flat vector
  /// @param beam        emitter of every shot, each below emitters, or nullptr: all the first
  EmitterLanes(const double* parameters, int emitters, const std::uint8_t* beam)
      : emitters_(emitters), beam_(beam), number_(0.0) {
    for (int j = 0; several() && j < emitters_; ++j) {
      const Batch h(parameters[place::incident_beam_horizontal(j, N)]);
      const Batch v(parameters[place::incident_beam_vertical(j, N)]);
      set_row(j, 0, leaning_direction(h, v));
      set_row(j, 3, leaning_horizontal_rate(h, v));
      set_row(j, 6, leaning_vertical_rate(h, v));
    }
  }

  bool several() const { return emitters_ > 1; }  ///< whether lanes can differ at all

  /// Selects shots [shot, shot + kLanes); beyond `end` the last one is repeated.
  void select(std::size_t shot, std::size_t end) {
    if (!several()) return;
    alignas(64) double lanes[kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) {
      index_[i] = beam_ == nullptr ? 0 : beam_[shot + i < end ? shot + i : end - 1];
      lanes[i] = static_cast<double>(index_[i]);
    }
    number_ = Batch::load_aligned(lanes);
  }

  /// Selects shots of one emitter.
  void select(std::size_t emitter) {
    for (std::size_t& index : index_) index = emitter;
    number_ = Batch(static_cast<double>(emitter));
  }

  /// Puts the selected shots' beams into a train.
  void apply(PreparedTrain<Batch, N>& train) const {
    if (several()) train.incident = vector(0);
  }
  /// Puts the derivatives of the selected shots' beams into those of a train.
  void apply(PreparedDerivatives<Batch, N>& derivatives) const {
    if (!several()) return;
    derivatives.incident_horizontal = vector(3);
    derivatives.incident_vertical = vector(6);
  }

  /// The derivatives of the selected shots by the places of the whole flat vector: those of an
  /// emitter are zero in the lanes of the others.
  /// @param storage  [kPlaces], used with several emitters
  const Batch* by_place(const Gradient<Batch, N>& gradient, Batch* storage) const {
    if (!several()) return gradient.parameters.data();
    for (std::size_t i = 0; i < parameter_count(N); ++i) storage[i] = gradient.parameters[i];
    const Batch zero(0.0);
    for (int j = emitters_ - 1; j >= 0; --j) {
      const auto mine = number_ == Batch(static_cast<double>(j));
      storage[place::incident_beam_horizontal(j, N)] =
          xsimd::select(mine, gradient.parameters[place::incident_beam_horizontal()], zero);
      storage[place::incident_beam_vertical(j, N)] =
          xsimd::select(mine, gradient.parameters[place::incident_beam_vertical()], zero);
    }
    return storage;
  }

 private:
  void set_row(int emitter, std::size_t first, const Vector3<Batch>& value) {
    const Batch* const components[3] = {&value.x, &value.y, &value.z};
    for (std::size_t i = 0; i < 3; ++i) {
      alignas(64) double lanes[kLanes];
      components[i]->store_aligned(lanes);
      table_[first + i][emitter] = lanes[0];
    }
  }

  Vector3<Batch> vector(std::size_t first) const {
    return {component(first), component(first + 1), component(first + 2)};
  }
  Batch component(std::size_t row) const {
    alignas(64) double lanes[kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) lanes[i] = table_[row][index_[i]];
    return Batch::load_aligned(lanes);
  }

  int emitters_;
  const std::uint8_t* beam_;
  Batch number_;
  std::size_t index_[kLanes] = {};
  double table_[9][kMaxEmitters] = {};
};

}  // namespace risley
