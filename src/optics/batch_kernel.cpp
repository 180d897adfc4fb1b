// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "optics/batch_kernel.hpp"

#include <array>

#include "risley/core/simd.hpp"
#include "risley/optics/angle_linearisations.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;

/// Groups of shots that take each step of the model together: see AngleLinearisations. 16 and 32
/// are no faster. Functions of a block must be `flatten`: a call within a step costs more than the
/// step.
constexpr std::size_t kGroups = 8;
constexpr std::size_t kBlock = kGroups * kLanes;

/// The columns of one block of shots. The last one is padded with copies of its last shot.
class ShotBlock {
 public:
  ShotBlock(std::size_t begin, std::size_t shots)
      : begin_(begin), count_(shots - begin < kBlock ? shots - begin : kBlock) {}

  std::size_t begin() const { return begin_; }
  std::size_t groups() const { return (count_ + kLanes - 1) / kLanes; }
  std::size_t first_shot(std::size_t group) const { return begin_ + group * kLanes; }

  Batch load(const double* column, std::size_t group) const {
    const double* from = column + first_shot(group);
    if (full(group)) return Batch::load_unaligned(from);
    alignas(64) double lanes[kLanes];
    for (std::size_t i = 0; i < kLanes; ++i) lanes[i] = from[i < rest() ? i : rest() - 1];
    return Batch::load_aligned(lanes);
  }
  void store(const Batch& value, double* column, std::size_t group) const {
    double* to = column + first_shot(group);
    if (full(group)) {
      value.store_unaligned(to);
      return;
    }
    alignas(64) double lanes[kLanes];
    value.store_aligned(lanes);
    for (std::size_t i = 0; i < rest(); ++i) to[i] = lanes[i];
  }
  /// Number of NaN shots in a group.
  std::size_t count_invalid(const Batch& value, std::size_t group) const {
    if (xsimd::all(value == value)) return 0;  // xsimd's != is false for two NaN
    alignas(64) double lanes[kLanes];
    value.store_aligned(lanes);
    std::size_t count = 0;
    const std::size_t shots = full(group) ? kLanes : rest();
    for (std::size_t i = 0; i < shots; ++i) count += lanes[i] != lanes[i];
    return count;
  }

 private:
  bool full(std::size_t group) const { return (group + 1) * kLanes <= count_; }
  std::size_t rest() const { return count_ % kLanes; }

  std::size_t begin_, count_;
};

/// Blocks of shots passing through a train, step by step.
template <TrainLayout N>
class Directions {
 public:
  explicit Directions(const BatchArguments& a)
      : a_(a),
        emitters_(a.parameters, a.emitters, a.beam),
        train_(prepared_train<Batch, N>(a.parameters, a.face_order)) {
    for (std::size_t i = 0; i < 2 * N; ++i) {
      face_position_[i] = Batch(a.face_position ? a.face_position[i] : 0.0);
    }
  }

  /// @return shots that are not valid
  [[gnu::flatten]] std::size_t compute(const ShotBlock& block) {
    turn(block);
    if (a_.face_position) {
      trace_with_origins(block);
    } else {
#pragma GCC unroll 4
      for (std::size_t prism = 0; prism < kElements<N>; ++prism) {
        for (std::size_t g = 0; g < block.groups(); ++g) {
          Trace<Batch, N> trace;
          set_up(prism, g, trace);
          pass_prism(train_, prism, trace);
          beam_[g] = trace.beam[prism + 1];
        }
      }
    }
    std::size_t invalid = 0;
    for (std::size_t g = 0; g < block.groups(); ++g) {
      if constexpr (N.axis_up) beam_[g] = in_sensor_frame<N>(beam_[g]);
      invalid += block.count_invalid(beam_[g].x, g);
      if (a_.direction[0]) block.store(beam_[g].x, a_.direction[0], g);
      if (a_.direction[1]) block.store(beam_[g].y, a_.direction[1], g);
      if (a_.direction[2]) block.store(beam_[g].z, a_.direction[2], g);
    }
    if (a_.azimuth || a_.zenith) {
      for (std::size_t g = 0; g < block.groups(); ++g) {
        const auto angles = angles_from_unit_vector(beam_[g]);
        if (a_.azimuth) block.store(angles.azimuth, a_.azimuth, g);
        if (a_.zenith) block.store(angles.zenith, a_.zenith, g);
      }
    }
    return invalid;
  }

 private:
  void turn(const ShotBlock& block) {
    for (std::size_t prism = 0; prism < N; ++prism) {
      for (std::size_t g = 0; g < block.groups(); ++g) {
        const auto [sine, cosine] = sin_cos(block.load(a_.rotation_angles[prism], g));
        sine_[prism][g] = sine;
        cosine_[prism][g] = cosine;
      }
    }
    for (std::size_t g = 0; g < block.groups(); ++g) {
      emitters_.select(block.first_shot(g), a_.shots);
      emitters_.apply(train_);
      beam_[g] = train_.incident;
    }
  }
  void set_up(std::size_t prism, std::size_t g, Trace<Batch, N>& trace) const {
    trace.sine[prism] = sine_[prism][g];
    trace.cosine[prism] = cosine_[prism][g];
    trace.beam[prism] = beam_[g];
  }
  void trace_with_origins(const ShotBlock& block) {
    for (std::size_t g = 0; g < block.groups(); ++g) {
      Trace<Batch, N> trace;
#pragma GCC unroll 4
      for (std::size_t prism = 0; prism < kElements<N>; ++prism) {
        set_up(prism, g, trace);
        pass_prism(train_, prism, trace);
        set_inside(train_, prism, trace);
        beam_[g] = trace.beam[prism + 1];
      }
      const Vector3<Batch> origin = beam_origin(trace, face_position_);
      block.store(origin.x, a_.origin[0], g);
      block.store(origin.y, a_.origin[1], g);
      block.store(origin.z, a_.origin[2], g);
    }
  }

  const BatchArguments& a_;
  EmitterLanes<Batch, N> emitters_;
  PreparedTrain<Batch, N> train_;
  std::array<Batch, 2 * N> face_position_;
  Batch sine_[N][kGroups], cosine_[N][kGroups];
  Vector3<Batch> beam_[kGroups];
};

template <TrainLayout N>
std::size_t observe_shots(const BatchArguments& a) {
  Directions<N> directions(a);
  std::size_t invalid = 0;
  for (std::size_t shot = 0; shot < a.shots; shot += kBlock) {
    invalid += directions.compute(ShotBlock(shot, a.shots));
  }
  return invalid;
}

/// As Directions, and back again.
template <TrainLayout N>
class Linearisations {
 public:
  explicit Linearisations(const BatchArguments& a)
      : a_(a),
        emitters_(a.parameters, a.emitters, a.beam),
        train_(prepared_train<Batch, N>(a.parameters, a.face_order)),
        derivatives_(prepared_derivatives<Batch, N>(a.parameters, a.face_order, [&a](int place) {
          return a.d_azimuth[place] || a.d_zenith[place];
        })) {}

  /// @return shots that are not valid
  [[gnu::flatten]] std::size_t compute(const ShotBlock& block) {
    const std::size_t groups = block.groups();
    for (std::size_t g = 0; g < groups; ++g) {
      emitters_.select(block.first_shot(g), a_.shots);
      emitters_.apply(train_);
      shots_.start(g, train_.incident);
    }
    for (std::size_t prism = 0; prism < N; ++prism) {
      for (std::size_t g = 0; g < groups; ++g) {
        shots_.turn(g, prism, block.load(a_.rotation_angles[prism], g));
      }
    }
    shots_.trace(train_, groups);
    std::size_t invalid = 0;
    for (std::size_t g = 0; g < groups; ++g) {
      const Vector3<Batch>& direction = shots_.direction(g);
      invalid += block.count_invalid(direction.x, g);
      const auto angles = angles_from_unit_vector(direction);
      block.store(angles.azimuth, a_.azimuth, g);
      block.store(angles.zenith, a_.zenith, g);
      shots_.begin(g, angle_seeds(direction));
    }
    shots_.reverse(train_, derivatives_, groups);
    for (std::size_t g = 0; g < groups; ++g) {
      emitters_.select(block.first_shot(g), a_.shots);
      emitters_.apply(derivatives_);
      shots_.end(g, derivatives_);
      store_gradient(block, g, shots_.azimuth(g), a_.d_azimuth);
      store_gradient(block, g, shots_.zenith(g), a_.d_zenith);
    }
    return invalid;
  }

 private:
  void store_gradient(const ShotBlock& block, std::size_t g, const Gradient<Batch, N>& gradient,
                      double* const* columns) const {
    Batch storage[EmitterLanes<Batch, N>::kPlaces];
    const Batch* by_place = emitters_.by_place(gradient, storage);
    const auto places = static_cast<std::size_t>(parameter_count(TrainShape{N, a_.emitters}));
    for (std::size_t i = 0; i < places; ++i) {
      if (columns[i]) block.store(by_place[i], columns[i], g);
    }
    for (std::size_t i = 0; i < N; ++i) {
      if (columns[places + i]) block.store(gradient.rotation_angles[i], columns[places + i], g);
    }
  }

  const BatchArguments& a_;
  EmitterLanes<Batch, N> emitters_;
  PreparedTrain<Batch, N> train_;
  PreparedDerivatives<Batch, N> derivatives_;
  AngleLinearisations<Batch, N, kGroups> shots_;
};

template <TrainLayout N>
std::size_t linearise_shots(const BatchArguments& a) {
  Linearisations<N> linearisations(a);
  std::size_t invalid = 0;
  for (std::size_t shot = 0; shot < a.shots; shot += kBlock) {
    invalid += linearisations.compute(ShotBlock(shot, a.shots));
  }
  return invalid;
}

}  // namespace

std::size_t observe(const BatchArguments& a) {
  return with_layout(a.prisms, [&]<TrainLayout N>() { return observe_shots<N>(a); });
}

std::size_t linearise(const BatchArguments& a) {
  return with_layout(a.prisms, [&]<TrainLayout N>() { return linearise_shots<N>(a); });
}

}  // namespace risley::RISLEY_KERNEL_NAMESPACE
