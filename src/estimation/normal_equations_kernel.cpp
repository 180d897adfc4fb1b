// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "estimation/normal_equations_kernel.hpp"

#include <array>

#include "risley/core/column_products.hpp"
#include "risley/core/simd.hpp"
#include "risley/optics/angle_linearisations.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley::estimation::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
using Lanes = xsimd::batch_bool<double>;
constexpr std::size_t kLanes = Batch::size;
constexpr double kTurn = 6.283185307179586;

using risley::wrapped;
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

  void load(const NormalEquationArguments& a, std::size_t knot, const Shots& shots) {
    alignas(64) double lanes[5][kLanes];
    const std::int64_t origin = a.knot_time_ns[knot];
    const std::size_t first = shots.first;
    if (shots.places == nullptr && shots.count == kLanes) {  // loops that the compiler can
                                                             // vectorise
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

/// The shots of a knot, emitter by emitter: derivatives that are zero for an emitter's shots need
/// not be summed for them.
class ShotOrder {
 public:
  static constexpr std::size_t kMost = 1024;  ///< number of shots sorted together

  ShotOrder(const std::uint8_t* beam, int emitters) : beam_(beam), emitters_(emitters) {}

  /// @param end  at most kMost after begin
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

  /// End of the places of an emitter; its first one follows those of the previous emitter.
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

/// Weights of a group's angles. Rounding is usually the same from shot to shot, and division and
/// root are slow, so they are only repeated when it changes.
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

/// Groups that take each step of the model together: see AngleLinearisations.
constexpr std::size_t kGroups = 8;

/// Most columns of a row: a free parameter per place, and the residual.
template <TrainLayout N>
constexpr std::size_t kMostColumns = EmitterLanes<Batch, N>::kPlaces + 1;

/// Squares of 3 x 3 also with eight lanes: rows have some nine columns, and in squares of four as
/// many products of padding as of columns.
template <TrainLayout N>
using Products = ColumnProducts<Batch, kMostColumns<N>, 3>;

/// The columns for the shots of one emitter: the free parameters that they depend on, then the
/// residual, which counts as one parameter more.
template <TrainLayout N>
struct OwnColumns {
  std::size_t count = 0;                       ///< residual included
  std::size_t number[kMostColumns<N>];         ///< among all free ones, ascending
  int local[EmitterLanes<Batch, N>::kPlaces];  ///< place in a gradient of a place, or -1
  /// A column is the derivative by one place of the gradient; some add more of the call's places.
  std::size_t first[kMostColumns<N>];
  std::size_t more = 0, with_more[kMostColumns<N>];
  int more_begin[kMostColumns<N>], more_end[kMostColumns<N>];
  const int* places = nullptr;

  OwnColumns() = default;
  OwnColumns(const NormalEquationArguments& a, int emitter) : places(a.places) {
    for (int place = 0; place < parameter_count(TrainShape{N, a.emitters}); ++place) {
      const int of = place::emitter(place, N);
      local[place] = of < 0          ? place
                     : of != emitter ? -1
                                     : place - place::incident_beam_horizontal(of, N) +
                                           place::incident_beam_horizontal();
    }
    for (int j = 0; j < a.free; ++j) {
      for (int p = a.place_begin[j]; p < a.place_begin[j + 1]; ++p) {
        if (local[a.places[p]] < 0) continue;
        first[count] = static_cast<std::size_t>(local[a.places[p]]);
        if (p + 1 < a.place_begin[j + 1]) {
          with_more[more] = count;
          more_begin[more] = p + 1;
          more_end[more++] = a.place_begin[j + 1];
        }
        number[count++] = static_cast<std::size_t>(j);
        break;
      }
    }
    number[count++] = static_cast<std::size_t>(a.free);
  }
};

/// Two rows per group, azimuth and zenith: residual and derivatives, all divided by sigma.
template <TrainLayout N>
struct Rows {
  static constexpr std::size_t kRows = 2 * kGroups;
  std::size_t stride = 0;
  Batch columns[kRows * Products<N>::padded(kMostColumns<N>)];
  Batch angles[kRows][N];  ///< by the rotation angles

  /// @param count  columns of a row
  void set_width(std::size_t count) {
    stride = Products<N>::padded(count);
    const Batch zero(0.0);
    for (std::size_t row = 0; row < kRows; ++row) {
      for (std::size_t i = count; i < stride; ++i) columns[row * stride + i] = zero;
    }
  }

  /// Both rows of a group. @param azimuth,zenith  divided by sigma
  void fill(std::size_t group, const OwnColumns<N>& own, const Gradient<Batch, N>& azimuth,
            const Gradient<Batch, N>& zenith) {
    const std::size_t row = 2 * group;
    for (std::size_t k = 0; k < N; ++k) {
      angles[row][k] = azimuth.rotation_angles[k];
      angles[row + 1][k] = zenith.rotation_angles[k];
    }
    Batch* const first = columns + row * stride;
    Batch* const second = first + stride;
    for (std::size_t i = 0; i + 1 < own.count; ++i) {
      first[i] = azimuth.parameters[own.first[i]];
      second[i] = zenith.parameters[own.first[i]];
    }
    for (std::size_t m = 0; m < own.more; ++m) {
      const std::size_t i = own.with_more[m];
      for (int p = own.more_begin[m]; p < own.more_end[m]; ++p) {
        const int local = own.local[own.places[p]];
        if (local < 0) continue;
        first[i] = first[i] + azimuth.parameters[static_cast<std::size_t>(local)];
        second[i] = second[i] + zenith.parameters[static_cast<std::size_t>(local)];
      }
    }
  }
  void set_residuals(std::size_t group, const OwnColumns<N>& own, const Batch& azimuth,
                     const Batch& zenith) {
    Batch* const first = columns + 2 * group * stride;
    first[own.count - 1] = azimuth;
    first[stride + own.count - 1] = zenith;
  }

  /// Lanes to ignore become zero in everything that is summed.
  void clear_lanes(std::size_t row, std::size_t count, const Lanes& good) {
    const Batch zero(0.0);
    for (Batch& angle : angles[row]) angle = xsimd::select(good, angle, zero);
    Batch* const out = columns + row * stride;
    for (std::size_t i = 0; i < count; ++i) out[i] = xsimd::select(good, out[i], zero);
  }
};

/// Powers of the times of a group since the knot. States act on an angle as 1, t and t^2/2.
struct Times {
  Batch t, half_square, square, cube, fourth;

  void set(const Batch& time) {
    t = time;
    square = time * time;
    half_square = 0.5 * square;
    cube = square * time;
    fourth = square * square;
  }
};

/// Sums over the shots of one knot.
template <TrainLayout N>
struct KnotSums {
  static constexpr std::size_t kPairs = N * (N + 1) / 2;
  static constexpr std::size_t kTile = Products<N>::kTile;
  Batch curvature[kPairs][kTimePowers];
  /// With all free parameters, of which the last is the residual.
  Batch coupling[N][kRotorStates][kMostColumns<N>];

  void clear(int free) {
    const Batch zero(0.0);
    for (auto& pair : curvature) {
      for (Batch& sum : pair) sum = zero;
    }
    for (auto& rotor : coupling) {
      for (auto& state : rotor) {
        for (int j = 0; j <= free; ++j) state[j] = zero;
      }
    }
  }

  /// Sums stay in registers over all groups: curvature pair by pair, coupling in as many columns as
  /// the registers allow.
  void add(const Rows<N>& rows, const Times* times, std::size_t groups, const OwnColumns<N>& own) {
    std::size_t pair = 0;
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k) {
#pragma GCC unroll 4
      for (std::size_t l = k; l < kElements<N>; ++l, ++pair) {
        Batch* const sums = curvature[pair];
        Batch s0 = sums[0], s1 = sums[1], s2 = sums[2], s3 = sums[3], s4 = sums[4];
        for (std::size_t g = 0; g < groups; ++g) {
          const Batch* const azimuth = rows.angles[2 * g];
          const Batch* const zenith = rows.angles[2 * g + 1];
          const Batch term = xsimd::fma(azimuth[k], azimuth[l], zenith[k] * zenith[l]);
          s0 = s0 + term;
          s1 = xsimd::fma(term, times[g].t, s1);
          s2 = xsimd::fma(term, times[g].square, s2);
          s3 = xsimd::fma(term, times[g].cube, s3);
          s4 = xsimd::fma(term, times[g].fourth, s4);
        }
        sums[0] = s0;
        sums[1] = s1;
        sums[2] = s2;
        sums[3] = s3;
        sums[4] = s4;
      }
      for (std::size_t first = 0; first < own.count; first += kTile) {
        add_columns(rows, times, groups, own, k, first);
      }
    }
  }

  void store(const NormalEquationArguments& a, std::size_t knot) const {
    double* out = a.curvature + knot * kPairs * kTimePowers;
    for (const auto& pair : curvature) {
      for (const Batch& sum : pair) *out++ = sum_of_lanes(sum);
    }
    double* gradient = a.gradient + knot * N * kRotorStates;
    out = a.coupling + knot * N * kRotorStates * static_cast<std::size_t>(a.free);
    for (const auto& rotor : coupling) {
      for (const auto& state : rotor) {
        for (int j = 0; j < a.free; ++j) *out++ = sum_of_lanes(state[j]);
        *gradient++ = sum_of_lanes(state[a.free]);
      }
    }
  }

 private:
  void add_columns(const Rows<N>& rows, const Times* times, std::size_t groups,
                   const OwnColumns<N>& own, std::size_t k, std::size_t first) {
    Batch sum[kRotorStates][kTile];
    for (auto& state : sum) {
      for (Batch& entry : state) entry = Batch(0.0);
    }
    for (std::size_t g = 0; g < groups; ++g) {
      const Batch* const azimuth = rows.columns + 2 * g * rows.stride + first;
      const Batch* const zenith = azimuth + rows.stride;
      const Batch &by_azimuth = rows.angles[2 * g][k], &by_zenith = rows.angles[2 * g + 1][k];
      for (std::size_t i = 0; i < kTile; ++i) {
        const Batch term = xsimd::fma(by_azimuth, azimuth[i], by_zenith * zenith[i]);
        sum[0][i] = sum[0][i] + term;
        sum[1][i] = xsimd::fma(term, times[g].t, sum[1][i]);
        sum[2][i] = xsimd::fma(term, times[g].half_square, sum[2][i]);
      }
    }
    for (std::size_t i = 0; i < kTile && first + i < own.count; ++i) {
      for (std::size_t state = 0; state < kRotorStates; ++state) {
        Batch& entry = coupling[k][state][own.number[first + i]];
        entry = entry + sum[state][i];
      }
    }
  }
};

/// All sums of one call.
template <TrainLayout N>
class Accumulation {
 public:
  explicit Accumulation(const NormalEquationArguments& a)
      : a_(a),
        emitters_(a.parameters, a.emitters, a.beam),
        shots_by_emitter_(a.beam, a.emitters),
        firing_(a.beam == nullptr ? 1 : static_cast<std::size_t>(a.emitters)),
        weights_(a.azimuth_noise_variance, a.zenith_noise_variance),
        // A rejected shot costs as much as the maximum.
        lost_(a.softening * a.cut > 1.0 ? 1.0 / a.softening : a.cut),
        cost_(0.0),
        products_(0) {
    train_ = prepared_train<Batch, N>(a.parameters, a.face_order);
    derivatives_ = prepared_derivatives<Batch, N>(a.parameters, a.face_order, [&a](int place) {
      const int* const end = a.places + a.place_begin[a.free];
      for (const int* at = a.places; at != end; ++at) {
        if (*at == place) return true;
      }
      return false;
    });
    for (std::size_t e = 0; e < firing_; ++e) own_[e] = OwnColumns<N>(a, static_cast<int>(e));
    const Batch zero(0.0);
    for (int i = 0; i < (a.free + 1) * (a.free + 2) / 2; ++i) static_sums_[i] = zero;
    begin_emitter(0);
  }

  void add_knot(std::size_t knot) {
    knot_ = knot;
    sums_.clear(a_.free);
    for (std::size_t k = 0; k < N; ++k) {
      const double* state = a_.state + (knot * N + k) * kRotorStates;
      angle_[k] = Batch(wrapped(state[0]));
      speed_[k] = Batch(state[1]);
      half_acceleration_[k] = Batch(0.5 * state[2]);
    }
    const std::size_t last = a_.last_shot[knot];
    for (std::size_t begin = a_.first_shot[knot], end = begin; begin < last; begin = end) {
      end = begin + ShotOrder::kMost < last ? begin + ShotOrder::kMost : last;
      shots_by_emitter_.take(begin, end);
      for (std::size_t e = 0, place = 0; e < firing_; ++e) {
        const std::size_t place_end = shots_by_emitter_.end(e);
        if (place == place_end) continue;
        if (e != emitter_) {
          keep_products();
          begin_emitter(e);
        }
        for (; place < place_end; place += kGroups * kLanes) add_block(place, place_end);
        place = place_end;
      }
    }
    sums_.store(a_, knot);
  }

  NormalEquationCounts finish() {
    keep_products();
    double* hessian = a_.static_hessian;
    double* gradient = a_.static_gradient;
    const Batch* sum = static_sums_;
    for (int i = 0; i < a_.free; ++i) {
      for (int j = i; j < a_.free; ++j) *hessian++ = sum_of_lanes(*sum++);
      *gradient++ = sum_of_lanes(*sum++);
    }
    counts_.cost = sum_of_lanes(cost_);
    return counts_;
  }

 private:
  void begin_emitter(std::size_t emitter) {
    emitter_ = emitter;
    emitters_.select(emitter);
    emitters_.apply(train_);
    emitters_.apply(derivatives_);
    const std::size_t count = own_[emitter].count;
    products_.start(count);
    rows_.set_width(count);
  }

  /// Adds the products of the emitter's own columns to those of all.
  void keep_products() {
    const OwnColumns<N>& own = own_[emitter_];
    const auto all = static_cast<std::size_t>(a_.free + 1);
    for (std::size_t i = 0; i < own.count; ++i) {
      const std::size_t first = own.number[i] * all - own.number[i] * (own.number[i] + 1) / 2;
      Batch* const row = static_sums_ + first;
      for (std::size_t j = i; j < own.count; ++j) {
        row[own.number[j]] = row[own.number[j]] + products_.sum(i, j);
      }
    }
  }

  /// Up to kGroups groups from a place on.
  [[gnu::flatten]] void add_block(std::size_t place, std::size_t place_end) {
    const OwnColumns<N>& own = own_[emitter_];
    std::size_t groups = 0;
    for (; groups < kGroups && place < place_end; ++groups, place += kLanes) {
      shots_[groups] = shots_by_emitter_.group(place, place_end);
      observed_[groups].load(a_, knot_, shots_[groups]);
      times_[groups].set(observed_[groups].time);
      model_.start(groups, train_.incident);
    }
    for (std::size_t k = 0; k < N; ++k) {
      for (std::size_t g = 0; g < groups; ++g) {
        const Batch& t = times_[g].t;
        model_.turn(g, k,
                    xsimd::fma(t, xsimd::fma(t, half_acceleration_[k], speed_[k]), angle_[k]));
      }
    }
    model_.trace(train_, groups);
    for (std::size_t g = 0; g < groups; ++g) compare(g);
    model_.reverse(train_, derivatives_, groups);
    for (std::size_t g = 0; g < groups; ++g) {
      model_.end(g, derivatives_);
      if (a_.turned) add_turn(g);
      rows_.fill(g, own, model_.azimuth(g), model_.zenith(g));
      if (!all_good_[g]) {
        rows_.clear_lanes(2 * g, own.count, good_[g]);
        rows_.clear_lanes(2 * g + 1, own.count, good_[g]);
      }
    }
    sums_.add(rows_, times_, groups, own);
    products_.add(rows_.columns, rows_.stride, 2 * groups);
  }

  /// Residuals, weights and losses of a group, and the start of its reverse pass, from seeds over
  /// sigma: so all derivatives are divided by it, which saves a product for each.
  void compare(std::size_t g) {
    const Batch one(1.0);
    const Group& group = observed_[g];
    const Shots& shots = shots_[g];
    const Vector3<Batch>& direction = model_.direction(g);
    const auto modelled = angles_from_unit_vector(direction);
    const Batch azimuth_residual = wrapped(group.azimuth - modelled.azimuth);
    const Batch zenith_residual = group.zenith - modelled.zenith;
    weights_.set(group);
    const Batch normalised_azimuth = weights_.azimuth_root * azimuth_residual;
    const Batch normalised_zenith = weights_.zenith_root * zenith_residual;
    const Batch chi2 =
        xsimd::fma(normalised_azimuth, normalised_azimuth, normalised_zenith * normalised_zenith);
    const Batch share = a_.softening > 0 ? one / (one + a_.softening * chi2) : one;
    const Batch azimuth_scale = share * weights_.azimuth_root;
    const Batch zenith_scale = share * weights_.zenith_root;
    scale_[g] = {azimuth_scale, zenith_scale};
    rows_.set_residuals(g, own_[emitter_], share * normalised_azimuth, share * normalised_zenith);
    const AngleSeeds<Batch> seeds = angle_seeds(direction);
    model_.begin(g, {azimuth_scale * seeds.azimuth, zenith_scale * seeds.zenith});
    // Comparison with NaN is false: a blocked beam counts as an outlier.
    Lanes good = chi2 <= Batch(a_.cut);
    Batch loss = xsimd::select(good, chi2 * share, lost_);
    all_good_[g] = shots.count == kLanes && xsimd::all(good);
    if (!all_good_[g]) {
      alignas(64) double number[kLanes];
      for (std::size_t i = 0; i < kLanes; ++i) number[i] = static_cast<double>(i);
      const Lanes present = Batch::load_aligned(number) < Batch(static_cast<double>(shots.count));
      loss = xsimd::select(present, loss, Batch(0.0));
      good = good & present;
      alignas(64) double counted[kLanes];
      xsimd::select(good, one, Batch(0.0)).store_aligned(counted);
      for (std::size_t i = 0; i < shots.count; ++i) {
        const bool out = counted[i] == 0.0;
        counts_.outliers += out;
        if (a_.outlier) a_.outlier[shots[i]] = out;
      }
    } else if (a_.outlier && shots.places == nullptr) {
      __builtin_memset(a_.outlier + shots.first, 0, kLanes);
    } else if (a_.outlier) {
      for (std::size_t i = 0; i < kLanes; ++i) a_.outlier[shots[i]] = 0;
    }
    good_[g] = good;
    cost_ = cost_ + loss;
    if (a_.azimuth_residual && shots.places == nullptr && shots.count == kLanes) {
      azimuth_residual.store_unaligned(a_.azimuth_residual + shots.first);
      zenith_residual.store_unaligned(a_.zenith_residual + shots.first);
    } else if (a_.azimuth_residual) {
      alignas(64) double azimuths[kLanes], zeniths[kLanes];
      azimuth_residual.store_aligned(azimuths);
      zenith_residual.store_aligned(zeniths);
      for (std::size_t i = 0; i < shots.count; ++i) {
        a_.azimuth_residual[shots[i]] = azimuths[i];
        a_.zenith_residual[shots[i]] = zeniths[i];
      }
    }
  }

  /// Effect of a turn of the whole frame on both angles, divided by sigma like the rest.
  void add_turn(std::size_t g) {
    constexpr auto kYaw = static_cast<std::size_t>(place::frame_yaw(N));
    constexpr auto kPitch = static_cast<std::size_t>(place::frame_pitch(N));
    const TurnDerivatives<Batch> turn = turn_derivatives<N>(model_.direction(g));
    auto& azimuth = model_.azimuth(g).parameters;
    auto& zenith = model_.zenith(g).parameters;
    azimuth[kYaw] = scale_[g].azimuth * turn.azimuth_by_yaw;
    zenith[kYaw] = scale_[g].zenith * turn.zenith_by_yaw;
    azimuth[kPitch] = scale_[g].azimuth * turn.azimuth_by_pitch;
    zenith[kPitch] = scale_[g].zenith * turn.zenith_by_pitch;
  }

  struct Pair {
    Batch azimuth, zenith;
  };

  const NormalEquationArguments& a_;
  EmitterLanes<Batch, N> emitters_;
  ShotOrder shots_by_emitter_;
  std::size_t firing_;
  Weights weights_;
  Batch lost_, cost_;
  NormalEquationCounts counts_;
  PreparedTrain<Batch, N> train_;
  PreparedDerivatives<Batch, N> derivatives_;
  OwnColumns<N> own_[kMaxEmitters];
  std::size_t emitter_ = 0, knot_ = 0;
  std::array<Batch, N> angle_, speed_, half_acceleration_;

  AngleLinearisations<Batch, N, kGroups> model_;
  Shots shots_[kGroups];
  Group observed_[kGroups];
  Times times_[kGroups];
  Pair scale_[kGroups];
  Lanes good_[kGroups];
  bool all_good_[kGroups];
  Rows<N> rows_;

  KnotSums<N> sums_;
  Products<N> products_;
  /// Of all free parameters and the residual, upper triangle row by row.
  Batch static_sums_[kMostColumns<N> * (kMostColumns<N> + 1) / 2];
};

template <TrainLayout N>
NormalEquationCounts accumulate_knots(const NormalEquationArguments& a) {
  Accumulation<N> accumulation(a);
  for (std::size_t knot = a.knot_begin; knot < a.knot_end; ++knot) accumulation.add_knot(knot);
  return accumulation.finish();
}

}  // namespace

NormalEquationCounts accumulate(const NormalEquationArguments& a) {
  return with_layout(a.prisms, [&]<TrainLayout N>() { return accumulate_knots<N>(a); });
}

}  // namespace risley::estimation::RISLEY_KERNEL_NAMESPACE
