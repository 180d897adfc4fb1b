// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "sensors/scan_kernel.hpp"

#include "risley/core/simd.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_model.hpp"

namespace risley::sensors::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<float>;
using Doubles = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;
/// Rows between angles computed in double precision. Sines of the angles between them follow from
/// those of the angle and of a table by the addition theorem: errors do not grow from row to row.
constexpr std::size_t kBlock = 512;
/// Groups of rows that take each step of the model together.
constexpr std::size_t kGroups = 4;

float first_lane(const Doubles& value) {
  alignas(64) double lanes[Doubles::size];
  value.store_aligned(lanes);
  return static_cast<float>(lanes[0]);
}

Vector3<Batch> single(const Vector3<Doubles>& v) {
  return {Batch(first_lane(v.x)), Batch(first_lane(v.y)), Batch(first_lane(v.z))};
}

template <TrainLayout N>
class Scan {
 public:
  explicit Scan(const ScanArguments& a) : a_(a) {
    const auto train = prepared_train<Doubles, N>(a.parameters, a.face_order);
    for (std::size_t i = 0; i < N.surfaces(); ++i) {
      const auto& face = train.faces[i];
      train_.faces[i] = {
          {single(face.normal.along), single(face.normal.cosine), single(face.normal.sine)},
          Batch(first_lane(face.index_ratio))};
    }
    for (std::size_t i = 0; i < sizeof(train_.cosine_between) / sizeof(Batch); ++i) {
      train_.cosine_between[i] = Batch(first_lane(train.cosine_between[i]));
    }
    for (std::size_t prism = 0; prism < N; ++prism) {
      for (std::size_t row = 0; row < kBlock; ++row) {
        const auto [sine, cosine] = sin_cos(Doubles(a.step[prism] * static_cast<double>(row)));
        sine_[prism][row] = first_lane(sine);
        cosine_[prism][row] = first_lane(cosine);
      }
    }
    for (std::size_t first = 0; first < a.emitters; ++first) set_incident(first);
  }

  void run() {
    std::size_t emitter = a_.first_emitter;
    for (std::size_t begin = 0; begin < a_.rows; begin += kBlock) {
      for (std::size_t prism = 0; prism < N; ++prism) {
        const auto [sine, cosine] =
            sin_cos(Doubles(a_.angle[prism] + a_.step[prism] * static_cast<double>(begin)));
        block_sine_[prism] = Batch(first_lane(sine));
        block_cosine_[prism] = Batch(first_lane(cosine));
      }
      const std::size_t end = a_.rows - begin < kBlock ? a_.rows - begin : kBlock;
      for (std::size_t row = 0; row < end; row += kGroups * kLanes) {
        trace(begin, row, emitter);
      }
    }
  }

 private:
  /// The beams of the emitters, beginning with a given one.
  void set_incident(std::size_t first) {
    alignas(64) float x[kLanes], y[kLanes], z[kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const int emitter = static_cast<int>((first + lane * a_.emitter_step) % a_.emitters);
      const Doubles h(a_.parameters[place::incident_beam_horizontal(emitter, N)]);
      const Doubles v(a_.parameters[place::incident_beam_vertical(emitter, N)]);
      const Vector3<Doubles> beam = leaning_direction(h, v);
      x[lane] = first_lane(beam.x);
      y[lane] = first_lane(beam.y);
      z[lane] = first_lane(beam.z);
    }
    incident_[first] = {Batch::load_aligned(x), Batch::load_aligned(y), Batch::load_aligned(z)};
  }

  /// Some groups of rows from one row of a block on. @param[in,out] emitter  of the first row
  [[gnu::flatten]] void trace(std::size_t begin, std::size_t row, std::size_t& emitter) {
    Vector3<Batch> beam[kGroups];
    for (std::size_t g = 0; g < kGroups; ++g) {
      beam[g] = incident_[emitter];
      if (a_.emitters > 1) emitter = (emitter + kLanes * a_.emitter_step) % a_.emitters;
    }
#pragma GCC unroll 4
    for (std::size_t prism = 0; prism < kElements<N>; ++prism) {
      for (std::size_t g = 0; g < kGroups; ++g) {
        const Batch s = Batch::load_unaligned(sine_[prism] + row + g * kLanes);
        const Batch c = Batch::load_unaligned(cosine_[prism] + row + g * kLanes);
        Trace<Batch, N> way;
        way.sine[prism] = block_sine_[prism] * c + block_cosine_[prism] * s;
        way.cosine[prism] = block_cosine_[prism] * c - block_sine_[prism] * s;
        way.beam[prism] = beam[g];
        pass_prism(train_, prism, way);
        beam[g] = way.beam[prism + 1];
      }
    }
    for (std::size_t g = 0; g < kGroups; ++g) {
      if constexpr (N.axis_up) beam[g] = in_sensor_frame<N>(beam[g]);
      store(beam[g], begin + row + g * kLanes);
    }
  }

  void store(const Vector3<Batch>& beam, std::size_t row) const {
    alignas(64) float x[kLanes], y[kLanes], z[kLanes];
    beam.x.store_aligned(x);
    beam.y.store_aligned(y);
    beam.z.store_aligned(z);
    float* to = a_.direction + 3 * row;
    const auto put = [&](std::size_t lane) {
      to[3 * lane] = x[lane];
      to[3 * lane + 1] = y[lane];
      to[3 * lane + 2] = z[lane];
    };
    if (row + kLanes <= a_.rows) {
#pragma GCC unroll 16
      for (std::size_t lane = 0; lane < kLanes; ++lane) put(lane);
    } else {
      for (std::size_t lane = 0; row + lane < a_.rows; ++lane) put(lane);
    }
  }

  const ScanArguments& a_;
  PreparedTrain<Batch, N> train_;
  alignas(64) float sine_[N][kBlock];
  alignas(64) float cosine_[N][kBlock];
  Batch block_sine_[N], block_cosine_[N];
  Vector3<Batch> incident_[kMaxEmitters];
};

}  // namespace

void scan(const ScanArguments& a) {
  with_layout(a.prisms, [&]<TrainLayout N>() { Scan<N>(a).run(); });
}

}  // namespace risley::sensors::RISLEY_KERNEL_NAMESPACE
