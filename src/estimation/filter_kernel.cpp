// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
//
// A step of the filter depends on the previous one, so its shots cannot share a batch. The lanes of
// a batch are rows of the covariance, angles whose sine is needed, or azimuth and zenith of the
// single shot on the way back through the prisms. Percentages are those of the whole step with the
// usual twelve states and AVX2 (Zen 4).
#include "estimation/filter_kernel.hpp"

#include <array>
#include <utility>

#include "risley/core/simd.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley::estimation::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
constexpr std::size_t kLanes = Batch::size;

/// Rows of the covariance whose sums stay in registers: the usual states, which are whole batches
/// of two and of four.
constexpr std::size_t kRows = 12;
constexpr std::size_t kRowBatches = kRows / kLanes;
static_assert(kRows % kLanes == 0, "AVX-512 uses the AVX2 version: RISLEY_NARROW_KERNEL_COPIES");

constexpr std::size_t whole_rows(std::size_t states) {
  return (states + kRows - 1) / kRows * kRows;
}

/// Most free parameters: one per place.
template <TrainLayout N>
constexpr auto kMostFree = static_cast<std::size_t>(parameter_count(TrainShape{N, kMaxEmitters}));

/// The paper's choice of free parameters for one emitter and one glass, default_free_names(). A
/// number of states known to the compiler, and derivatives known to be unneeded, reduce a step by
/// 12 %, the latter by 7 %.
template <TrainLayout N>
struct UsualParameters {
  static constexpr int kCount = 3 * N + 2;
  /// As prepare_derivatives() asks.
  static constexpr bool wanted(int place) { return place == place::prism_tilt_horizontal(N - 1); }
};

/// Mean and covariance. Angle and speed of each rotor come first, so that they are neighbours in a
/// batch, then the free parameters, then zeros up to whole rows.
/// @tparam Free  number of free parameters, or -1: known at run time
template <TrainLayout N, int Free>
class FilterStates {
 public:
  static constexpr std::size_t kRotors = 2 * N;  ///< states of the rotors
  static constexpr std::size_t kMost =
      whole_rows(kRotors + (Free < 0 ? kMostFree<N> : static_cast<std::size_t>(Free)));

  explicit FilterStates(const FilterArguments& a) : free_(static_cast<std::size_t>(a.free)) {
    for (std::size_t i = 0; i < rows(); ++i) mean[i] = 0;
    for (std::size_t i = 0; i < rows() * size(); ++i) covariance_[i] = 0;
    for (std::size_t j = 0; j < size(); ++j) {
      mean[place(j)] = a.mean[j];
      for (std::size_t i = 0; i < size(); ++i) {
        column(place(j))[place(i)] = a.covariance[j * size() + i];
      }
    }
  }
  /// In the order of the arguments.
  void store(double* to_mean, double* to_covariance) const {
    for (std::size_t j = 0; j < size(); ++j) {
      to_mean[j] = mean[place(j)];
      for (std::size_t i = 0; i < size(); ++i) {
        to_covariance[j * size() + i] = covariance_[place(j) * rows() + place(i)];
      }
    }
  }

  std::size_t free() const { return Free < 0 ? free_ : static_cast<std::size_t>(Free); }
  std::size_t size() const { return kRotors + free(); }
  std::size_t rows() const { return whole_rows(size()); }
  /// Of the covariance [rows].
  double* column(std::size_t state) { return covariance_ + state * rows(); }

  alignas(64) double mean[kMost];

 private:
  std::size_t place(std::size_t state) const {
    return state < free() ? kRotors + state : state - free();
  }

  alignas(64) double covariance_[kMost * kMost];
  std::size_t free_;
};

/// Lanes 0 and 1, 2 and 3 exchanged.
template <std::size_t... Lane>
Batch exchanged_pairs(const Batch& value, std::index_sequence<Lane...>) {
  const auto lanes = static_cast<typename Batch::register_type>(value);
  return Batch(__builtin_shufflevector(lanes, lanes, (Lane ^ 1)...));
}

/// Motion of the rotors between two shots.
template <TrainLayout N>
class RotorStep {
 public:
  static constexpr std::size_t kBatches = (2 * N + kLanes - 1) / kLanes;  ///< of the rotors' rows

  explicit RotorStep(const RotorProcess* process) : process_(process) {}

  void set(double seconds) {
    if (seconds == seconds_) return;
    seconds_ = seconds;
    for (std::size_t k = 0; k < N; ++k) {
      const std::size_t angle = 2 * k, speed = angle + 1;
      const RotorStepCovariance q = step_covariance(process_[k], seconds);
      angle_by_speed_[angle] = seconds;
      noise_[angle][angle] = q.angle_angle;
      noise_[angle][speed] = noise_[speed][angle] = q.angle_speed;
      noise_[speed][speed] = q.speed_speed;
    }
  }
  double seconds() const { return seconds_; }

  /// Batch v of a column, or of the mean: adds the speeds, times the step, to the angles.
  Batch advanced(const Batch& states, std::size_t v) const {
    return xsimd::fma(Batch::load_aligned(angle_by_speed_ + v * kLanes),
                      exchanged_pairs(states, std::make_index_sequence<kLanes>()), states);
  }
  /// Batch v of a rotor's column of the step's contribution to the covariance.
  Batch noise(std::size_t state, std::size_t v) const {
    return Batch::load_aligned(noise_[state] + v * kLanes);
  }

 private:
  const RotorProcess* process_;
  double seconds_ = 0;
  alignas(64) double angle_by_speed_[kBatches * kLanes] = {};
  alignas(64) double noise_[2 * N][kBatches * kLanes] = {};
};

/// Location of the derivatives by the free parameters among those by places, for one emitter.
template <TrainLayout N>
struct FreeDerivatives {
  static constexpr std::size_t kNone = parameter_count(N);  ///< holds 0
  std::size_t first[kMostFree<N>];
  /// A parameter of several places: the others are added to its first.
  std::size_t more = 0, to[kMostFree<N>], from[kMostFree<N>];

  FreeDerivatives() = default;
  FreeDerivatives(const FilterArguments& a, int emitter) {
    for (int i = 0; i < a.free; ++i) {
      first[i] = kNone;
      for (int p = a.place_begin[i]; p < a.place_begin[i + 1]; ++p) {
        int at = a.places[p];
        const int of = place::emitter(at, N);
        if (of >= 0 && of != emitter) continue;
        if (of >= 0) {
          at += place::incident_beam_horizontal() - place::incident_beam_horizontal(of, N);
        }
        if (first[i] == kNone) {
          first[i] = static_cast<std::size_t>(at);
        } else {
          to[more] = first[i];
          from[more++] = static_cast<std::size_t>(at);
        }
      }
    }
  }
};

/// Numbers needed in all lanes.
struct InAllLanes {
  const double* value;
  Batch operator[](std::size_t i) const { return Batch(value[i]); }
};
/// As InAllLanes, of sines and cosines.
struct SinesInAllLanes {
  const double* sine;
  const double* cosine;
  SinePair<Batch> operator[](std::size_t i) const { return {Batch(sine[i]), Batch(cosine[i])}; }
};

/// The filter on its way through the shots.
template <TrainLayout N, int Free>
class FilterPass {
 public:
  explicit FilterPass(const FilterArguments& a) : a_(a), states_(a), step_(a.process) {
    for (int i = 0; i < parameter_count(TrainShape{N, a.emitters}); ++i) {
      parameters_[i] = a.parameters[i];
    }
    for (int e = 0; e < a.emitters; ++e) free_derivatives_[e] = FreeDerivatives<N>(a, e);
    for (int i = 0; i < a.free; ++i) {
      for (int p = a.place_begin[i]; p < a.place_begin[i + 1]; ++p) {
        wanted_[a.places[p]] = true;
        place_of_[p] = static_cast<std::size_t>(a.places[p]);
        parameter_of_[p] = static_cast<std::size_t>(i);
      }
    }
    places_ = static_cast<std::size_t>(a.place_begin[a.free]);
  }

  std::size_t run() {
    const FilterRun& run = a_.run;
    std::size_t done = 0;
    for (; finite_ && done < run.count; ++done) {
      const std::size_t shot = run.backwards ? run.first - done : run.first + done;
      step_.set(1e-9 * static_cast<double>(a_.time_ns[shot] - *a_.state_time_ns));
      *a_.state_time_ns = a_.time_ns[shot];
      chi_square_ = 0;
      determinant_ = 1;
      if (run.outlier[shot]) {
        advance_mean();
        advance_covariance();
        if (run.kept && run.keep_predicted) keep(done);
      } else if (!take(shot, done) && run.refused) {
        run.refused[shot] = 1;
      }
      if (run.chi_square) run.chi_square[done] = chi_square_;
      if (run.determinant) run.determinant[done] = determinant_;
      if (run.kept && !run.keep_predicted) {
        settle();
        keep(done);
      }
    }
    settle();
    states_.store(a_.mean, a_.covariance);
    return finite_ ? done : done - 1;
  }

 private:
  using States = FilterStates<N, Free>;

  void keep(std::size_t n) const {
    const std::size_t size = states_.size();
    double* const mean = a_.run.kept + n * (size + size * size);
    states_.store(mean, mean + size);
  }
  /// Completes the pending update of the covariance.
  [[gnu::noinline]] void settle() {
    step_.set(0);
    advance_covariance();
  }

  /// angle += dt speed                                                       [B21 Eq. (27)]
  void advance_mean() {
#pragma GCC unroll 4
    for (std::size_t v = 0; v < RotorStep<N>::kBatches; ++v) {
      double* const at = states_.mean + v * kLanes;
      step_.advanced(Batch::load_aligned(at), v).store_aligned(at);
    }
  }

  /// P = F (P - u u^T - w w^T) F^T + Q, with u and w of the previous shot: see take().
  void advance_covariance() {
    const std::size_t rows = states_.rows();
    for (std::size_t block = 0; block < rows; block += kRows) {
      Batch u[kRowBatches], w[kRowBatches];
#pragma GCC unroll 6
      for (std::size_t v = 0; v < kRowBatches; ++v) {
        u[v] = Batch::load_aligned(u_ + block + v * kLanes);
        w[v] = Batch::load_aligned(w_ + block + v * kLanes);
      }
      for (std::size_t j = 0; j < states_.size(); ++j) {
        double* const column = states_.column(j) + block;
        const Batch uj(u_[j]), wj(w_[j]);
#pragma GCC unroll 6
        for (std::size_t v = 0; v < kRowBatches; ++v) {
          Batch p = Batch::load_aligned(column + v * kLanes) - uj * u[v] - wj * w[v];
          if (v < RotorStep<N>::kBatches && block == 0) p = step_.advanced(p, v);
          p.store_aligned(column + v * kLanes);
        }
      }
    }
    const Batch seconds(step_.seconds());
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k) {
      double* const angle = states_.column(2 * k);
      double* const speed = angle + rows;
      for (std::size_t i = 0; i < rows; i += kLanes) {
        Batch by_speed = Batch::load_aligned(speed + i);
        Batch by_angle = xsimd::fma(seconds, by_speed, Batch::load_aligned(angle + i));
        const std::size_t v = i / kLanes;
        if (v < RotorStep<N>::kBatches) {
          by_angle = by_angle + step_.noise(2 * k, v);
          by_speed = by_speed + step_.noise(2 * k + 1, v);
          by_speed.store_aligned(speed + i);
        }
        by_angle.store_aligned(angle + i);
      }
      // Row and column were summed in different order: this keeps P symmetric to the bit.
      for (std::size_t l = 0; l < k; ++l) angle[2 * l] = states_.column(2 * l)[2 * k];
    }
    if (a_.walk_variance > 0) {
      const double walk = a_.walk_variance * __builtin_fabs(step_.seconds());
      for (std::size_t j = States::kRotors; j < states_.size(); ++j) states_.column(j)[j] += walk;
    }
    for (std::size_t i = 0; i < rows; i += kLanes) {
      Batch(0.0).store_aligned(u_ + i);
      Batch(0.0).store_aligned(w_ + i);
    }
  }

  /// Moves to a shot and uses its observation, unless the gate rejects it. With i the innovations,
  /// H their derivatives, R their noise, f and g the columns of P H^T, S = H P H^T + R and
  ///   c = S01 / S00,  d = S11 - c S01,  i1' = i1 - c i0,  g' = g - c f:
  ///   mean += f i0 / S00 + g' i1' / d,  P -= f f^T / S00 + g' g'^T / d,
  ///   chi-square = i0^2 / S00 + i1'^2 / d.
  /// This is P - K S K^T of the gain K = P H^T S^-1, without a root before the mean, and keeps P
  /// symmetric to the bit. P itself is changed together with the prediction for the next shot,
  /// while that one's beam waits for roots: this saves 5 % of a step.
  [[gnu::flatten]] bool take(std::size_t shot, std::size_t done) {
    advance_mean();
    const int beam = a_.beam != nullptr ? a_.beam[shot] : 0;
    const double* const values =
        a_.reference_parameters ? a_.reference_parameters : states_.mean + States::kRotors;
    for (std::size_t p = 0; p < places_; ++p) {
      parameters_[place_of_[p]] = values[parameter_of_[p]];
    }
    const auto order = face_orders<Batch, N>(a_.face_order);
    set_sines(shot, beam, order);

    // Each prism's constants are prepared right before they are needed: with all at once, most of
    // them would go through memory, which costs 17 % of a step.
    const InAllLanes parameters{parameters_};
    SinesInAllLanes sines{sine_, cosine_};
    PreparedTrain<Batch, N> train;
    Trace<Batch, N> forward;
    forward.beam[0] = leaning_direction<Batch>(sines[leaning::incident_horizontal()],
                                               sines[leaning::incident_vertical()]);
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k) {
      prepare_prism(parameters, sines, k, train);
      forward.sine[k] = Batch(sine_[leaning::count(N) + k]);
      forward.cosine[k] = Batch(cosine_[leaning::count(N) + k]);
      pass_prism(train, k, forward);
    }
    const Vector3<Batch>& direction = forward.direction();
    advance_covariance();
    if (a_.run.kept && a_.run.keep_predicted) keep(done);

    // Back for azimuth in lane 0 and zenith in the others.
    AngleSeeds<Batch> seeds = angle_seeds(direction);
    Vector3<Batch> seed{in_lanes(seeds.azimuth.x, seeds.zenith.x),
                        in_lanes(seeds.azimuth.y, seeds.zenith.y),
                        in_lanes(seeds.azimuth.z, seeds.zenith.z)};
    PreparedDerivatives<Batch, N> derivatives;
    auto pass = begin_reverse<N>(direction, std::array<Vector3<Batch>, 1>{seed});
    const auto wanted = [this](int place) {
      return Free < 0 ? wanted_[place] : UsualParameters<N>::wanted(place);
    };
#pragma GCC unroll 4
    for (std::size_t i = 0; i < kElements<N>; ++i) {
      const std::size_t k = N - 1 - i;
      prepare_prism_derivatives(parameters, order[k], sines, wanted, k, derivatives);
      reverse_prism(train, derivatives, forward, k, pass);
    }
    prepare_incident_derivatives(sines, derivatives);
    end_reverse(derivatives, pass);
    store_derivatives(pass.gradients[0], free_derivatives_[beam]);

    const SphericalAngles<Batch> modelled = angles_from_unit_vector(direction);
    Batch innovations = in_lanes(wrapped(Batch(a_.azimuth[shot]) - modelled.azimuth),
                                 Batch(a_.zenith[shot]) - modelled.zenith);
    if (a_.reference_parameters) innovations = innovations - beyond_reference(shot, beam);
    return update(shot, beam, innovations);
  }

  /// Sines and cosines of all angles of a shot: the leaning ones, then the rotors'.
  void set_sines(std::size_t shot, int beam, const std::array<FaceOrder, N>& order) {
    std::array<double, parameter_count(N)> own;
#pragma GCC unroll 32
    for (std::size_t i = 0; i < own.size(); ++i) own[i] = parameters_[i];
    own[place::incident_beam_horizontal()] = parameters_[place::incident_beam_horizontal(beam, N)];
    own[place::incident_beam_vertical()] = parameters_[place::incident_beam_vertical(beam, N)];
    const auto angles = leaning_angles<double, N>(own, order);
    alignas(64) double angle[kAngles] = {};
#pragma GCC unroll 32
    for (std::size_t i = 0; i < angles.size(); ++i) angle[i] = angles[i];
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k) {
      angle[angles.size() + k] =
          a_.reference_angle ? a_.reference_angle[shot * N + k] : states_.mean[2 * k];
    }
#pragma GCC unroll 16
    for (std::size_t i = 0; i < kAngles; i += kLanes) {
      const auto both = sine_cosine(Batch::load_aligned(angle + i));
      both.first.store_aligned(sine_ + i);
      both.second.store_aligned(cosine_ + i);
    }
  }

  /// The azimuth's part in lane 0, and the zenith's in the others.
  static Batch in_lanes(const Batch& azimuth, const Batch& zenith) {
    alignas(64) static constexpr double kNumber[8] = {0, 1, 1, 1, 1, 1, 1, 1};
    return xsimd::select(Batch::load_aligned(kNumber) == Batch(0.0), azimuth, zenith);
  }

  void store_derivatives(const Gradient<Batch, N>& gradient, const FreeDerivatives<N>& free) {
#pragma GCC unroll 32
    for (std::size_t i = 0; i < FreeDerivatives<N>::kNone; ++i) {
      gradient.parameters[i].store_aligned(by_place_[i]);
    }
    for (std::size_t i = 0; i < free.more; ++i) {
      const Batch sum =
          Batch::load_aligned(by_place_[free.to[i]]) + Batch::load_aligned(by_place_[free.from[i]]);
      sum.store_aligned(by_place_[free.to[i]]);
    }
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k)
      gradient.rotation_angles[k].store_aligned(by_angle_[k]);
  }

  /// Calls take(state, derivative) for every state that the angles depend on, so not for speeds.
  template <class Take>
  void with_derivatives(int beam, const Take& take) const {
    const FreeDerivatives<N>& free = free_derivatives_[beam];
    for (std::size_t i = 0; i < states_.free(); ++i) {
      take(States::kRotors + i, by_place_[free.first[i]]);
    }
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k) take(2 * k, by_angle_[k]);
  }

  /// Distance of the state from the reference, in azimuth and zenith.
  Batch beyond_reference(std::size_t shot, int beam) const {
    Batch sum(0.0);
    with_derivatives(beam, [&](std::size_t state, const double* by) {
      const double from = state < States::kRotors
                              ? a_.reference_angle[shot * N + state / 2]
                              : a_.reference_parameters[state - States::kRotors];
      sum = xsimd::fma(Batch::load_aligned(by), Batch(states_.mean[state] - from), sum);
    });
    return sum;
  }

  bool update(std::size_t shot, int beam, const Batch& innovations) {
    alignas(64) double f[States::kMost], g[States::kMost];
    for (std::size_t block = 0; block < states_.rows(); block += kRows) {
      Batch by_azimuth[kRowBatches], by_zenith[kRowBatches];
#pragma GCC unroll 6
      for (std::size_t v = 0; v < kRowBatches; ++v) by_azimuth[v] = by_zenith[v] = Batch(0.0);
      with_derivatives(beam, [&](std::size_t state, const double* by) {
        const Batch azimuth(by[0]), zenith(by[1]);
        const double* const column = states_.column(state) + block;
#pragma GCC unroll 6
        for (std::size_t v = 0; v < kRowBatches; ++v) {
          const Batch p = Batch::load_aligned(column + v * kLanes);
          by_azimuth[v] = xsimd::fma(azimuth, p, by_azimuth[v]);
          by_zenith[v] = xsimd::fma(zenith, p, by_zenith[v]);
        }
      });
#pragma GCC unroll 6
      for (std::size_t v = 0; v < kRowBatches; ++v) {
        by_azimuth[v].store_aligned(f + block + v * kLanes);
        by_zenith[v].store_aligned(g + block + v * kLanes);
      }
    }
    Batch along_f(0.0), along_g(0.0);  // H f, H g
    with_derivatives(beam, [&](std::size_t state, const double* by) {
      const Batch h = Batch::load_aligned(by);
      along_f = xsimd::fma(h, Batch(f[state]), along_f);
      along_g = xsimd::fma(h, Batch(g[state]), along_g);
    });
    alignas(64) double s0[kLanes], s1[kLanes], i[kLanes];
    along_f.store_aligned(s0);
    along_g.store_aligned(s1);
    innovations.store_aligned(i);
    const double s00 =
        s0[0] + (a_.noise_variance + static_cast<double>(a_.azimuth_rounding_variance[shot]));
    const double s11 =
        s1[1] + (a_.noise_variance + static_cast<double>(a_.zenith_rounding_variance[shot]));
    const double over_s00 = 1.0 / s00, c = s0[1] * over_s00;
    const double d = s11 - c * s0[1], over_d = 1.0 / d;
    const double second = i[1] - c * i[0];
    const double to_f = i[0] * over_s00, to_g = second * over_d;
    const double chi_square = i[0] * to_f + second * to_g;
    if (!(chi_square <= a_.run.gate)) return false;  // nor is NaN, of an invalid beam
    chi_square_ = chi_square;
    determinant_ = s00 * d;
    const Batch root_f(__builtin_sqrt(over_s00)), root_g(__builtin_sqrt(over_d));
    Batch change(0.0);
    for (std::size_t at = 0; at < states_.rows(); at += kLanes) {
      const Batch column_f = Batch::load_aligned(f + at);
      const Batch column_g = Batch::load_aligned(g + at) - Batch(c) * column_f;
      const Batch mean =
          Batch::load_aligned(states_.mean + at) + Batch(to_f) * column_f + Batch(to_g) * column_g;
      mean.store_aligned(states_.mean + at);
      change = change + (mean - mean);  // 0, or NaN
      (root_f * column_f).store_aligned(u_ + at);
      (root_g * column_g).store_aligned(w_ + at);
    }
    finite_ = xsimd::all(change == Batch(0.0));
    return true;
  }

  /// Room for the sines of all angles, in whole batches.
  static constexpr std::size_t kAngles = (leaning::count(N) + N + kLanes - 1) / kLanes * kLanes;

  const FilterArguments& a_;
  States states_;
  RotorStep<N> step_;
  double chi_square_ = 0, determinant_ = 1;
  bool finite_ = true;
  alignas(64) double u_[States::kMost] = {};
  alignas(64) double w_[States::kMost] = {};

  double parameters_[kMostFree<N>];  ///< whole flat vector
  std::size_t places_, place_of_[kMostFree<N>], parameter_of_[kMostFree<N>];
  bool wanted_[kMostFree<N>] = {};  ///< by place
  FreeDerivatives<N> free_derivatives_[kMaxEmitters];

  alignas(64) double sine_[kAngles];
  alignas(64) double cosine_[kAngles];
  /// By azimuth and zenith, in their lanes.
  alignas(64) double by_place_[FreeDerivatives<N>::kNone + 1][kLanes] = {};
  alignas(64) double by_angle_[N][kLanes];
};

template <TrainLayout N>
bool are_usual(const FilterArguments& a) {
  const int* const end = a.places + a.place_begin[a.free];
  for (const int* place = a.places; place != end; ++place) {
    for (int k = 0; k < N; ++k) {
      const bool dear =
          *place == place::wedge_angle(k) || *place == place::prism_tilt_horizontal(k);
      if (dear && !UsualParameters<N>::wanted(*place)) return false;
    }
  }
  return a.free == UsualParameters<N>::kCount;
}

}  // namespace

std::size_t run_filter(const FilterArguments& a) {
  return with_layout(a.prisms, [&]<TrainLayout N>() {
    if (are_usual<N>(a)) return FilterPass<N, UsualParameters<N>::kCount>(a).run();
    return FilterPass<N, -1>(a).run();
  });
}

}  // namespace risley::estimation::RISLEY_KERNEL_NAMESPACE
