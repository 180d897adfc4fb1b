// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "estimation/normal_equations_kernel.hpp"

#include <array>

#include "risley/core/simd.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley::estimation::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;
constexpr double kTurn = 6.283185307179586;

/// The same angle within half a turn, as a difference or for an accurate sine.
Batch wrapped(const Batch& angle) { return angle - kTurn * xsimd::nearbyint(angle / kTurn); }

double wrapped(double angle) { return angle - kTurn * __builtin_nearbyint(angle / kTurn); }

/// One group of shots of a knot, a lane each. Lanes without a shot repeat the last one.
struct Group {
  Batch time, azimuth, zenith, azimuth_rounding, zenith_rounding;
  std::size_t count;

  Group(const NormalEquationArguments& a, std::size_t knot, std::size_t first) {
    alignas(64) double lanes[5][kLanes];
    const std::size_t last = a.last_shot[knot];
    const std::int64_t origin = a.knot_time_ns[knot];
    if (first + kLanes <= last) {  // the rule, in loops that the compiler can widen
      count = kLanes;
      for (std::size_t i = 0; i < kLanes; ++i) {
        lanes[0][i] = 1e-9 * static_cast<double>(a.time_ns[first + i] - origin);
      }
      for (std::size_t i = 0; i < kLanes; ++i) {
        lanes[3][i] = static_cast<double>(a.azimuth_rounding_variance[first + i]);
        lanes[4][i] = static_cast<double>(a.zenith_rounding_variance[first + i]);
      }
      azimuth = Batch::load_unaligned(a.azimuth + first);
      zenith = Batch::load_unaligned(a.zenith + first);
    } else {
      count = last - first;
      for (std::size_t i = 0; i < kLanes; ++i) {
        const std::size_t shot = i < count ? first + i : last - 1;
        lanes[0][i] = 1e-9 * static_cast<double>(a.time_ns[shot] - origin);
        lanes[1][i] = a.azimuth[shot];
        lanes[2][i] = a.zenith[shot];
        lanes[3][i] = static_cast<double>(a.azimuth_rounding_variance[shot]);
        lanes[4][i] = static_cast<double>(a.zenith_rounding_variance[shot]);
      }
      azimuth = Batch::load_aligned(lanes[1]);
      zenith = Batch::load_aligned(lanes[2]);
    }
    time = Batch::load_aligned(lanes[0]);
    azimuth_rounding = Batch::load_aligned(lanes[3]);
    zenith_rounding = Batch::load_aligned(lanes[4]);
  }
};

/// Weights of a group's angles. Rounding is mostly the same from shot to shot, and division and
/// root are slow, so they are only done anew when it changes.
class Weights {
 public:
  Weights(double azimuth_noise_variance, double zenith_noise_variance)
      : azimuth_root(0.0),
        zenith_root(0.0),
        azimuth_noise_(azimuth_noise_variance),
        zenith_noise_(zenith_noise_variance),
        azimuth_rounding_(-1.0),  // like no group's
        zenith_rounding_(-1.0) {}

  void set(const Group& group) {
    if (xsimd::all((group.azimuth_rounding == azimuth_rounding_) &
                   (group.zenith_rounding == zenith_rounding_))) {
      return;
    }
    azimuth_rounding_ = group.azimuth_rounding;
    zenith_rounding_ = group.zenith_rounding;
    azimuth_root = Batch(1.0) / xsimd::sqrt(azimuth_noise_ + azimuth_rounding_);
    zenith_root = Batch(1.0) / xsimd::sqrt(zenith_noise_ + zenith_rounding_);
  }

  Batch azimuth_root, zenith_root;  ///< one over sigma

 private:
  Batch azimuth_noise_, zenith_noise_, azimuth_rounding_, zenith_rounding_;
};

/// Most free parameters: one per place.
template <int N>
constexpr std::size_t kMostFree = EmitterLanes<Batch, N>::kPlaces;

/// One observed angle of a group: residual and derivatives, all divided by its sigma.
template <int N>
struct Row {
  Batch residual;
  std::array<Batch, N> angles;
  std::array<Batch, kMostFree<N>> free;
};

template <int N>
void fill_row(const NormalEquationArguments& a, const EmitterLanes<Batch, N>& emitters,
              const Gradient<Batch, N>& gradient, const Batch& residual, const Batch& scale,
              Row<N>& row) {
  Batch storage[EmitterLanes<Batch, N>::kPlaces];
  const Batch* by_place = emitters.by_place(gradient, storage);
  row.residual = scale * residual;
  for (std::size_t k = 0; k < N; ++k) row.angles[k] = scale * gradient.rotation_angles[k];
  for (int j = 0; j < a.free; ++j) {
    Batch sum(0.0);
    for (int p = a.place_begin[j]; p < a.place_begin[j + 1]; ++p) {
      sum = sum + by_place[a.places[p]];
    }
    row.free[static_cast<std::size_t>(j)] = scale * sum;
  }
}

/// Lanes that are not to count become zero in everything that is summed.
template <int N>
void clear_lanes(const NormalEquationArguments& a, const xsimd::batch_bool<double>& good,
                 Row<N>& row) {
  const Batch zero(0.0);
  row.residual = xsimd::select(good, row.residual, zero);
  for (std::size_t k = 0; k < N; ++k) row.angles[k] = xsimd::select(good, row.angles[k], zero);
  for (int j = 0; j < a.free; ++j) {
    const auto i = static_cast<std::size_t>(j);
    row.free[i] = xsimd::select(good, row.free[i], zero);
  }
}

/// Sums over the shots of one knot.
template <int N>
struct KnotSums {
  static constexpr std::size_t kPairs = N * (N + 1) / 2;
  Batch curvature[kPairs][kTimePowers];
  Batch gradient[N][kRotorStates];
  Batch coupling[N][kRotorStates][kMostFree<N>];

  void clear(int free) {
    const Batch zero(0.0);
    for (auto& pair : curvature) {
      for (Batch& sum : pair) sum = zero;
    }
    for (auto& rotor : gradient) {
      for (Batch& sum : rotor) sum = zero;
    }
    for (auto& rotor : coupling) {
      for (auto& state : rotor) {
        for (int j = 0; j < free; ++j) state[j] = zero;
      }
    }
  }

  /// States act on an angle as 1, t and t^2/2.
  void add(const Row<N>& first, const Row<N>& second, const Batch& time, int free) {
    const Batch half_square = 0.5 * time * time;
    std::size_t pair = 0;
    for (std::size_t k = 0; k < N; ++k) {
      for (std::size_t l = k; l < N; ++l, ++pair) {
        Batch term =
            xsimd::fma(first.angles[k], first.angles[l], second.angles[k] * second.angles[l]);
        for (int power = 0; power < kTimePowers; ++power) {
          curvature[pair][power] = curvature[pair][power] + term;
          term = term * time;
        }
      }
      const auto spread = [&](Batch* states, const Batch& term, std::size_t stride) {
        states[0] = states[0] + term;
        states[stride] = xsimd::fma(term, time, states[stride]);
        states[2 * stride] = xsimd::fma(term, half_square, states[2 * stride]);
      };
      spread(gradient[k],
             xsimd::fma(first.angles[k], first.residual, second.angles[k] * second.residual), 1);
      for (int j = 0; j < free; ++j) {
        const auto i = static_cast<std::size_t>(j);
        spread(&coupling[k][0][j],
               xsimd::fma(first.angles[k], first.free[i], second.angles[k] * second.free[i]),
               kMostFree<N>);
      }
    }
  }

  void store(const NormalEquationArguments& a, std::size_t knot) const {
    double* out = a.curvature + knot * kPairs * kTimePowers;
    for (const auto& pair : curvature) {
      for (const Batch& sum : pair) *out++ = sum_of_lanes(sum);
    }
    out = a.gradient + knot * N * kRotorStates;
    for (const auto& rotor : gradient) {
      for (const Batch& sum : rotor) *out++ = sum_of_lanes(sum);
    }
    out = a.coupling + knot * N * kRotorStates * static_cast<std::size_t>(a.free);
    for (const auto& rotor : coupling) {
      for (const auto& state : rotor) {
        for (int j = 0; j < a.free; ++j) *out++ = sum_of_lanes(state[j]);
      }
    }
  }
};

/// Sums over all shots.
template <int N>
struct StaticSums {
  Batch hessian[kMostFree<N> * (kMostFree<N> + 1) / 2];
  Batch gradient[kMostFree<N>];

  explicit StaticSums(int free) {
    for (int i = 0; i < free * (free + 1) / 2; ++i) hessian[i] = Batch(0.0);
    for (int i = 0; i < free; ++i) gradient[i] = Batch(0.0);
  }

  void add(const Row<N>& first, const Row<N>& second, int free) {
    Batch* entry = hessian;
    for (int i = 0; i < free; ++i) {
      const Batch& a = first.free[static_cast<std::size_t>(i)];
      const Batch& b = second.free[static_cast<std::size_t>(i)];
      gradient[i] = xsimd::fma(a, first.residual, xsimd::fma(b, second.residual, gradient[i]));
      for (int j = i; j < free; ++j, ++entry) {
        *entry = xsimd::fma(a, first.free[static_cast<std::size_t>(j)],
                            xsimd::fma(b, second.free[static_cast<std::size_t>(j)], *entry));
      }
    }
  }
};

template <int N>
NormalEquationCounts accumulate_knots(const NormalEquationArguments& a) {
  std::array<Batch, parameter_count(N)> parameters;
  for (std::size_t i = 0; i < parameter_count(N); ++i) parameters[i] = Batch(a.parameters[i]);
  std::array<FaceOrder, N> order;
  __builtin_memcpy(&order, a.face_order, sizeof(order));
  EmitterLanes<Batch, N> emitters(a.parameters, a.emitters, a.beam);
  auto train = prepare<Batch, N>(parameters, order);
  auto derivatives = prepare_derivatives<Batch, N>(parameters, order);

  NormalEquationCounts counts;
  Batch cost(0.0);
  StaticSums<N> statics(a.free);
  KnotSums<N> sums;
  Row<N> azimuth_row, zenith_row;
  const Batch one(1.0);
  Weights weights(a.azimuth_noise_variance, a.zenith_noise_variance);
  // A shot that is out costs as much as one can.
  const Batch lost(a.softening * a.cut > 1.0 ? 1.0 / a.softening : a.cut);
  for (std::size_t knot = a.knot_begin; knot < a.knot_end; ++knot) {
    sums.clear(a.free);
    std::array<Batch, N> angle, speed, half_acceleration;
    for (std::size_t k = 0; k < N; ++k) {
      const double* state = a.state + (knot * N + k) * kRotorStates;
      angle[k] = Batch(wrapped(state[0]));
      speed[k] = Batch(state[1]);
      half_acceleration[k] = Batch(0.5 * state[2]);
    }
    for (std::size_t shot = a.first_shot[knot]; shot < a.last_shot[knot]; shot += kLanes) {
      const Group group(a, knot, shot);
      std::array<Batch, N> angles;
      for (std::size_t k = 0; k < N; ++k) {
        angles[k] = xsimd::fma(group.time, xsimd::fma(group.time, half_acceleration[k], speed[k]),
                               angle[k]);
      }
      emitters.select(shot, a.last_shot[knot]);
      emitters.apply(train);
      emitters.apply(derivatives);
      auto shots = linearise_angles(train, derivatives, angles);
      if (a.turned) add_turn_derivatives(shots);
      const Batch azimuth_residual = wrapped(group.azimuth - shots.angles.azimuth);
      const Batch zenith_residual = group.zenith - shots.angles.zenith;
      weights.set(group);
      const Batch normalised_azimuth = weights.azimuth_root * azimuth_residual;
      const Batch normalised_zenith = weights.zenith_root * zenith_residual;
      const Batch chi2 =
          xsimd::fma(normalised_azimuth, normalised_azimuth, normalised_zenith * normalised_zenith);
      const Batch share = a.softening > 0 ? one / (one + a.softening * chi2) : one;
      fill_row(a, emitters, shots.azimuth, azimuth_residual, share * weights.azimuth_root,
               azimuth_row);
      fill_row(a, emitters, shots.zenith, zenith_residual, share * weights.zenith_root, zenith_row);
      // Comparison with NaN is false: a beam that does not get through counts as an outlier.
      auto good = chi2 <= Batch(a.cut);
      Batch loss = xsimd::select(good, chi2 * share, lost);
      if (group.count < kLanes || !xsimd::all(good)) {
        alignas(64) double number[kLanes];
        for (std::size_t i = 0; i < kLanes; ++i) number[i] = static_cast<double>(i);
        const auto present = Batch::load_aligned(number) < Batch(static_cast<double>(group.count));
        loss = xsimd::select(present, loss, Batch(0.0));
        good = good & present;
        clear_lanes(a, good, azimuth_row);
        clear_lanes(a, good, zenith_row);
        alignas(64) double counted[kLanes];
        xsimd::select(good, one, Batch(0.0)).store_aligned(counted);
        for (std::size_t i = 0; i < group.count; ++i) {
          const bool out = counted[i] == 0.0;
          counts.outliers += out;
          if (a.outlier) a.outlier[shot + i] = out;
        }
      } else if (a.outlier) {
        for (std::size_t i = 0; i < kLanes; ++i) a.outlier[shot + i] = 0;
      }
      cost = cost + loss;
      sums.add(azimuth_row, zenith_row, group.time, a.free);
      statics.add(azimuth_row, zenith_row, a.free);
      if (a.azimuth_residual && group.count == kLanes) {
        azimuth_residual.store_unaligned(a.azimuth_residual + shot);
        zenith_residual.store_unaligned(a.zenith_residual + shot);
      } else if (a.azimuth_residual) {
        alignas(64) double azimuths[kLanes], zeniths[kLanes];
        azimuth_residual.store_aligned(azimuths);
        zenith_residual.store_aligned(zeniths);
        for (std::size_t i = 0; i < group.count; ++i) {
          a.azimuth_residual[shot + i] = azimuths[i];
          a.zenith_residual[shot + i] = zeniths[i];
        }
      }
    }
    sums.store(a, knot);
  }
  for (int i = 0; i < a.free * (a.free + 1) / 2; ++i) {
    a.static_hessian[i] = sum_of_lanes(statics.hessian[i]);
  }
  for (int i = 0; i < a.free; ++i) a.static_gradient[i] = sum_of_lanes(statics.gradient[i]);
  counts.cost = sum_of_lanes(cost);
  return counts;
}

}  // namespace

NormalEquationCounts accumulate(const NormalEquationArguments& a) {
  return with_prism_count(a.prisms, [&]<int N>() { return accumulate_knots<N>(a); });
}

}  // namespace risley::estimation::RISLEY_KERNEL_NAMESPACE
