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

/// Up to kLanes shots of one emitter.
struct Shots {
  std::size_t first, count;
  const std::uint32_t* places;  ///< behind first, or nullptr: neighbours

  std::size_t operator[](std::size_t lane) const {
    return first + (places == nullptr ? lane : places[lane]);
  }
};

/// One group of shots of a knot, a lane each. Lanes without a shot repeat the last one.
struct Group {
  Batch time, azimuth, zenith, azimuth_rounding, zenith_rounding;

  Group(const NormalEquationArguments& a, std::size_t knot, const Shots& shots) {
    alignas(64) double lanes[5][kLanes];
    const std::int64_t origin = a.knot_time_ns[knot];
    const std::size_t first = shots.first;
    if (shots.places == nullptr && shots.count == kLanes) {  // loops that the compiler can widen
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
      for (std::size_t i = 0; i < kLanes; ++i) {
        const std::size_t shot = shots[i < shots.count ? i : shots.count - 1];
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

/// The shots of a knot, emitter by emitter: what one emitter's shots do not depend on need not be
/// summed for them.
class ShotOrder {
 public:
  static constexpr std::size_t kMost = 1024;  ///< shots that are put in order together

  ShotOrder(const std::uint8_t* beam, int emitters) : beam_(beam), emitters_(emitters) {}

  /// @param end  at most kMost behind begin
  void take(std::size_t begin, std::size_t end) {
    first_ = begin;
    if (beam_ == nullptr || emitters_ == 1) {
      ends_[0] = end - begin;
      return;
    }
    std::size_t next[kMaxEmitters] = {};
    for (std::size_t shot = begin; shot < end; ++shot) ++next[beam_[shot]];
    for (std::size_t e = 0, sum = 0; e < static_cast<std::size_t>(emitters_); ++e) {
      sum += next[e];
      ends_[e] = sum;
      next[e] = sum - next[e];
    }
    for (std::size_t shot = begin; shot < end; ++shot) {
      places_[next[beam_[shot]]++] = static_cast<std::uint32_t>(shot - begin);
    }
  }

  /// One behind the last place of an emitter; its first is behind those of the one before.
  std::size_t end(std::size_t emitter) const { return ends_[emitter]; }
  Shots group(std::size_t place, std::size_t end) const {
    const std::size_t count = end - place < kLanes ? end - place : kLanes;
    if (beam_ == nullptr || emitters_ == 1) return {first_ + place, count, nullptr};
    return {first_, count, places_ + place};
  }

 private:
  const std::uint8_t* beam_;
  int emitters_;
  std::size_t first_ = 0, ends_[kMaxEmitters] = {};
  std::uint32_t places_[kMost] = {};
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

/// The free parameters that the shots of one emitter depend on.
template <int N>
struct OwnParameters {
  int emitter = 0;
  std::size_t count = 0;
  std::size_t number[kMostFree<N>];  ///< among all free ones, ascending

  OwnParameters() = default;
  OwnParameters(const NormalEquationArguments& a, int its_emitter) : emitter(its_emitter) {
    for (int j = 0; j < a.free; ++j) {
      for (int p = a.place_begin[j]; p < a.place_begin[j + 1]; ++p) {
        const int of = place::emitter(a.places[p], N);
        if (of >= 0 && of != emitter) continue;
        number[count++] = static_cast<std::size_t>(j);
        break;
      }
    }
  }
};

/// One observed angle of a group: residual and derivatives, all divided by its sigma.
template <int N>
struct Row {
  Batch residual;
  std::array<Batch, N> angles;
  std::array<Batch, kMostFree<N>> free;  ///< by the emitter's own parameters
};

template <int N>
void fill_row(const NormalEquationArguments& a, const OwnParameters<N>& own,
              const Gradient<Batch, N>& gradient, const Batch& residual, const Batch& scale,
              Row<N>& row) {
  row.residual = scale * residual;
  for (std::size_t k = 0; k < N; ++k) row.angles[k] = scale * gradient.rotation_angles[k];
  for (std::size_t i = 0; i < own.count; ++i) {
    const std::size_t j = own.number[i];
    Batch sum(0.0);
    for (int p = a.place_begin[j]; p < a.place_begin[j + 1]; ++p) {
      sum = sum + derivative_by(gradient, a.places[p], own.emitter);
    }
    row.free[i] = scale * sum;
  }
}

/// Lanes that are not to count become zero in everything that is summed.
template <int N>
void clear_lanes(std::size_t own, const xsimd::batch_bool<double>& good, Row<N>& row) {
  const Batch zero(0.0);
  row.residual = xsimd::select(good, row.residual, zero);
  for (std::size_t k = 0; k < N; ++k) row.angles[k] = xsimd::select(good, row.angles[k], zero);
  for (std::size_t i = 0; i < own; ++i) row.free[i] = xsimd::select(good, row.free[i], zero);
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
  void add(const Row<N>& first, const Row<N>& second, const Batch& time,
           const OwnParameters<N>& own) {
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
      for (std::size_t i = 0; i < own.count; ++i) {
        spread(&coupling[k][0][own.number[i]],
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
  std::size_t row[kMostFree<N>];  ///< where one of the upper triangle begins, less its number

  explicit StaticSums(int free) {
    for (int i = 0; i < free * (free + 1) / 2; ++i) hessian[i] = Batch(0.0);
    for (int i = 0; i < free; ++i) {
      gradient[i] = Batch(0.0);
      row[i] = static_cast<std::size_t>(i * free - i * (i + 1) / 2);
    }
  }

  void add(const Row<N>& first, const Row<N>& second, const OwnParameters<N>& own) {
    for (std::size_t i = 0; i < own.count; ++i) {
      const Batch& a = first.free[i];
      const Batch& b = second.free[i];
      Batch& slope = gradient[own.number[i]];
      slope = xsimd::fma(a, first.residual, xsimd::fma(b, second.residual, slope));
      Batch* const entries = hessian + row[own.number[i]];
      for (std::size_t j = i; j < own.count; ++j) {
        Batch& entry = entries[own.number[j]];
        entry = xsimd::fma(a, first.free[j], xsimd::fma(b, second.free[j], entry));
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
  ShotOrder shots_by_emitter(a.beam, a.emitters);
  const auto firing = static_cast<std::size_t>(a.beam == nullptr ? 1 : a.emitters);
  OwnParameters<N> owns[kMaxEmitters];
  for (std::size_t e = 0; e < firing; ++e) owns[e] = OwnParameters<N>(a, static_cast<int>(e));
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
  std::size_t knot = 0;
  std::array<Batch, N> angle, speed, half_acceleration;
  const auto add_group = [&](const Shots& shots, const OwnParameters<N>& own) {
    const Group group(a, knot, shots);
    std::array<Batch, N> angles;
    for (std::size_t k = 0; k < N; ++k) {
      angles[k] =
          xsimd::fma(group.time, xsimd::fma(group.time, half_acceleration[k], speed[k]), angle[k]);
    }
    auto modelled = linearise_angles(train, derivatives, angles);
    if (a.turned) add_turn_derivatives(modelled);
    const Batch azimuth_residual = wrapped(group.azimuth - modelled.angles.azimuth);
    const Batch zenith_residual = group.zenith - modelled.angles.zenith;
    weights.set(group);
    const Batch normalised_azimuth = weights.azimuth_root * azimuth_residual;
    const Batch normalised_zenith = weights.zenith_root * zenith_residual;
    const Batch chi2 =
        xsimd::fma(normalised_azimuth, normalised_azimuth, normalised_zenith * normalised_zenith);
    const Batch share = a.softening > 0 ? one / (one + a.softening * chi2) : one;
    fill_row(a, own, modelled.azimuth, azimuth_residual, share * weights.azimuth_root, azimuth_row);
    fill_row(a, own, modelled.zenith, zenith_residual, share * weights.zenith_root, zenith_row);
    // Comparison with NaN is false: a beam that does not get through counts as an outlier.
    auto good = chi2 <= Batch(a.cut);
    Batch loss = xsimd::select(good, chi2 * share, lost);
    if (shots.count < kLanes || !xsimd::all(good)) {
      alignas(64) double number[kLanes];
      for (std::size_t i = 0; i < kLanes; ++i) number[i] = static_cast<double>(i);
      const auto present = Batch::load_aligned(number) < Batch(static_cast<double>(shots.count));
      loss = xsimd::select(present, loss, Batch(0.0));
      good = good & present;
      clear_lanes(own.count, good, azimuth_row);
      clear_lanes(own.count, good, zenith_row);
      alignas(64) double counted[kLanes];
      xsimd::select(good, one, Batch(0.0)).store_aligned(counted);
      for (std::size_t i = 0; i < shots.count; ++i) {
        const bool out = counted[i] == 0.0;
        counts.outliers += out;
        if (a.outlier) a.outlier[shots[i]] = out;
      }
    } else if (a.outlier) {
      for (std::size_t i = 0; i < kLanes; ++i) a.outlier[shots[i]] = 0;
    }
    cost = cost + loss;
    sums.add(azimuth_row, zenith_row, group.time, own);
    statics.add(azimuth_row, zenith_row, own);
    if (a.azimuth_residual && shots.places == nullptr && shots.count == kLanes) {
      azimuth_residual.store_unaligned(a.azimuth_residual + shots.first);
      zenith_residual.store_unaligned(a.zenith_residual + shots.first);
    } else if (a.azimuth_residual) {
      alignas(64) double azimuths[kLanes], zeniths[kLanes];
      azimuth_residual.store_aligned(azimuths);
      zenith_residual.store_aligned(zeniths);
      for (std::size_t i = 0; i < shots.count; ++i) {
        a.azimuth_residual[shots[i]] = azimuths[i];
        a.zenith_residual[shots[i]] = zeniths[i];
      }
    }
  };
  for (knot = a.knot_begin; knot < a.knot_end; ++knot) {
    sums.clear(a.free);
    for (std::size_t k = 0; k < N; ++k) {
      const double* state = a.state + (knot * N + k) * kRotorStates;
      angle[k] = Batch(wrapped(state[0]));
      speed[k] = Batch(state[1]);
      half_acceleration[k] = Batch(0.5 * state[2]);
    }
    for (std::size_t begin = a.first_shot[knot], end = begin; begin < a.last_shot[knot];
         begin = end) {
      end = begin + ShotOrder::kMost < a.last_shot[knot] ? begin + ShotOrder::kMost
                                                         : a.last_shot[knot];
      shots_by_emitter.take(begin, end);
      for (std::size_t e = 0, place = 0; e < firing; ++e) {
        if (place == shots_by_emitter.end(e)) continue;
        emitters.select(e);
        emitters.apply(train);
        emitters.apply(derivatives);
        for (; place < shots_by_emitter.end(e); place += kLanes) {
          add_group(shots_by_emitter.group(place, shots_by_emitter.end(e)), owns[e]);
        }
        place = shots_by_emitter.end(e);
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
