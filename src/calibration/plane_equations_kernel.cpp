// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Compiled once per instruction set under the rules of risley/core/simd.hpp.
#include "calibration/plane_equations_kernel.hpp"

#include <array>

#include "risley/core/column_products.hpp"
#include "risley/core/simd.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/emitter_lanes.hpp"
#include "risley/optics/observation_adjoint.hpp"

namespace risley::calibration::RISLEY_KERNEL_NAMESPACE {
namespace {

using Batch = xsimd::batch<double>;
using Lanes = xsimd::batch_bool<double>;
constexpr std::size_t kLanes = Batch::size;
constexpr double kLargest = __DBL_MAX__;

/// Groups of shots whose rows are kept until they are multiplied with each other: enough for the
/// sums to stay in registers for a while, few enough for the rows to stay in the nearest cache.
constexpr std::size_t kGroups = 16;
constexpr std::size_t kBlock = kGroups * kLanes;

/// Rows of columns and the sums of their products.
template <TrainLayout N>
class Products {
 public:
  /// @param columns  residual included
  explicit Products(std::size_t columns) : sums_(columns), stride_(Sums::padded(columns)) {
    const Batch zero(0.0);
    for (std::size_t group = 0; group < kGroups; ++group) {
      for (std::size_t i = columns; i < stride_; ++i) row(group)[i] = zero;
    }
  }

  /// Destination of a group's columns, each times the root of the weight.
  Batch* row(std::size_t group) { return rows_ + group * stride_; }
  /// Adds the products of the first groups.
  void add(std::size_t groups) { sums_.add(rows_, stride_, groups); }
  void store(double* out) const { sums_.store(out); }
  /// Column of a shot of the rows.
  double entry(std::size_t shot, std::size_t column) const {
    return reinterpret_cast<const double*>(rows_ + shot / kLanes * stride_ + column)[shot % kLanes];
  }

 private:
  static constexpr std::size_t kMost =
      EmitterLanes<Batch, N>::kPlaces + N + kMostSizes + kMostRangeTerms + 5;
  using Sums = ColumnProducts<Batch, kMost>;

  Sums sums_;
  std::size_t stride_;
  Batch rows_[kGroups * Sums::padded(kMost)];
};

/// Everything of a call that is the same for all shots, except for the emitters of a group.
template <TrainLayout N>
struct Constants {
  EmitterLanes<Batch, N> emitters;
  PreparedTrain<Batch, N> train;
  PreparedDerivatives<Batch, N> derivatives;
  std::array<Batch, 2 * N> face_position;
  std::array<std::array<Batch, 2 * N>, kMostSizes> size_rates;
  Vector3<Batch> normal, tangent_1, tangent_2;
  Batch distance, range_offset, range_variance;

  explicit Constants(const PlaneArguments& a)
      : emitters(a.parameters, a.emitters, a.beam),
        normal(vector(a.normal)),
        tangent_1(vector(a.tangent[0])),
        tangent_2(vector(a.tangent[1])),
        distance(a.distance),
        range_offset(a.range_offset),
        range_variance(a.range_variance) {
    train = prepared_train<Batch, N>(a.parameters, a.face_order);
    derivatives = prepared_derivatives<Batch, N>(a.parameters, a.face_order, [&a](int place) {
      for (int i = 0; i < a.place_count; ++i) {
        if (a.places[i] == place) return true;
      }
      return false;
    });
    for (std::size_t i = 0; i < 2 * N; ++i) face_position[i] = Batch(a.face_position[i]);
    for (int j = 0; j < a.size_count; ++j) {
      for (std::size_t i = 0; i < 2 * N; ++i) size_rates[j][i] = Batch(a.size_rates[2 * N * j + i]);
    }
  }

  /// The emitters of shots [shot, shot + kLanes).
  void turn_to(std::size_t shot, std::size_t end) {
    emitters.select(shot, end);
    emitters.apply(train);
    emitters.apply(derivatives);
  }

 private:
  static Vector3<Batch> vector(const double* v) { return {Batch(v[0]), Batch(v[1]), Batch(v[2])}; }
};

/// The columns of one block of shots. After the last shot of a call follow some lost ones.
template <TrainLayout N>
class ShotBlock {
 public:
  static constexpr std::size_t kPairs = N * (N + 1) / 2;

  /// Columns [from, from + shots). @param shots  1 to kBlock
  void load(const PlaneArguments& a, std::size_t from, std::size_t shots) {
    shots_ = shots;
    const bool full = shots == kBlock;
    for (std::size_t k = 0; k < N; ++k) {
      rotation_angle_[k] =
          full ? a.rotation_angle[k] + from : padded(a.rotation_angle[k] + from, angles_[k], 0.0);
    }
    range_ = full ? a.range + from : padded(a.range + from, ranges_, __builtin_nan(""));
    for (std::size_t pair = 0; pair < kPairs; ++pair) {
      const float* column = a.angle_covariance[pair] + from;
      for (std::size_t i = 0; i < shots; ++i) {
        covariance_[pair][i] = static_cast<double>(column[i]);
      }
      for (std::size_t i = shots; i < kBlock; ++i) covariance_[pair][i] = 0;
    }
    for (int term = 0; term < a.term_count; ++term) {
      const float* column = a.range_terms[term] + from;
      for (std::size_t i = 0; i < shots; ++i) terms_[term][i] = static_cast<double>(column[i]);
      for (std::size_t i = shots; i < kBlock; ++i) terms_[term][i] = 0;
    }
  }

  std::size_t groups() const { return (shots_ + kLanes - 1) / kLanes; }
  std::size_t shots() const { return shots_; }
  Batch rotation_angle(std::size_t rotor, std::size_t group) const {
    return Batch::load_unaligned(rotation_angle_[rotor] + group * kLanes);
  }
  Batch range(std::size_t group) const { return Batch::load_unaligned(range_ + group * kLanes); }
  Batch covariance(std::size_t pair, std::size_t group) const {
    return Batch::load_aligned(covariance_[pair] + group * kLanes);
  }
  Batch range_term(int term, std::size_t group) const {
    return Batch::load_aligned(terms_[term] + group * kLanes);
  }

 private:
  const double* padded(const double* column, double* copy, double value) const {
    for (std::size_t i = 0; i < shots_; ++i) copy[i] = column[i];
    for (std::size_t i = shots_; i < kBlock; ++i) copy[i] = value;
    return copy;
  }

  std::size_t shots_ = 0;
  const double* rotation_angle_[N];
  const double* range_;
  alignas(64) double covariance_[kPairs][kBlock];
  alignas(64) double terms_[kMostRangeTerms][kBlock];
  alignas(64) double angles_[N][kBlock];
  alignas(64) double ranges_[kBlock];
};

/// What a block leaves for ResidualColumns.
struct BlockResiduals {
  alignas(64) double residual[kBlock];
  alignas(64) double variance[kBlock];
};

/// The groups of a block on their way to the plane and back, which take each step of the model
/// together: see AngleLinearisations.
template <TrainLayout N>
class Walks {
 public:
  /// Writes the rows of all groups.
  /// @param first  shot of the call's columns
  /// @return lanes that are lost
  [[gnu::flatten]] std::size_t fill_rows(const PlaneArguments& a, Constants<N>& c,
                                         const ShotBlock<N>& block, std::size_t first,
                                         Products<N>& products, BlockResiduals& residuals) {
    const std::size_t groups = block.groups();
    for (std::size_t g = 0; g < groups; ++g) {
      c.turn_to(first + g * kLanes, a.end);
      trace_[g].beam[0] = c.train.incident;
    }
    for (std::size_t k = 0; k < N; ++k) {
      for (std::size_t g = 0; g < groups; ++g) {
        turn_prism(block.rotation_angle(k, g), k, trace_[g]);
      }
    }
#pragma GCC unroll 4  // gcc 12 keeps batches in registers only where indices are constants
    for (std::size_t k = 0; k < kElements<N>; ++k) {
      for (std::size_t g = 0; g < groups; ++g) {
        pass_prism(c.train, k, trace_[g]);
        set_inside(c.train, k, trace_[g]);
      }
    }
    for (std::size_t g = 0; g < groups; ++g) meet_plane(c, g);
#pragma GCC unroll 4
    for (std::size_t k = 0; k < kElements<N>; ++k) {
      for (std::size_t g = 0; g < groups; ++g) {
        reverse_prism(c.train, c.derivatives, trace_[g], N - 1 - k, pass_[g]);
      }
    }
    std::size_t lost = 0;
    for (std::size_t g = 0; g < groups; ++g) {
      c.turn_to(first + g * kLanes, a.end);
      end_reverse(c.derivatives, pass_[g]);
      lost += fill_row(a, c, block, g, products.row(g), residuals);
    }
    return lost;
  }

 private:
  struct Meeting {
    BeamPath<Batch, N> path;
    Batch approach, over_approach, range;
    const Vector3<Batch>& origin() const { return path.origin(); }
  };

  /// Points where the beams of a group meet the plane, and their derivatives by the directions.
  void meet_plane(const Constants<N>& c, std::size_t g) {
    const Vector3<Batch>& direction = trace_[g].direction();
    Meeting& m = meeting_[g];
    m.path = beam_path(trace_[g], c.face_position);
    m.approach = dot(c.normal, direction);
    m.over_approach = Batch(1.0) / m.approach;
    m.range = (c.distance - dot(c.normal, m.origin())) * m.over_approach;
    pass_[g] = begin_reverse<N>(
        direction, std::array<Vector3<Batch>, 1>{-m.range * m.over_approach * c.normal});
  }

  /// One group of shots, a lane each: writes its row.
  /// @return lanes that are lost
  std::size_t fill_row(const PlaneArguments& a, const Constants<N>& c, const ShotBlock<N>& block,
                       std::size_t group, Batch* row, BlockResiduals& residuals) const {
    const Batch zero(0.0), one(1.0);
    const Meeting& m = meeting_[group];
    Batch residual = block.range(group) - c.range_offset - m.range;
    for (int term = 0; term < a.term_count; ++term) {
      residual = xsimd::fnma(Batch(a.term_values[term]), block.range_term(term, group), residual);
    }
    const Gradient<Batch, N>& gradient = pass_[group].gradients[0];
    Batch variance = c.range_variance;
    std::size_t pair = 0;
    for (std::size_t k = 0; k < N; ++k) {
      Batch sum = gradient.rotation_angles[k] * block.covariance(pair++, group);
      for (std::size_t l = k + 1; l < N; ++l) {
        const Batch twice = gradient.rotation_angles[l] + gradient.rotation_angles[l];
        sum = xsimd::fma(twice, block.covariance(pair++, group), sum);
      }
      variance = xsimd::fma(gradient.rotation_angles[k], sum, variance);
    }

    const Batch scale = one / xsimd::sqrt(variance);
    Batch storage[EmitterLanes<Batch, N>::kPlaces];
    const Batch* by_place = c.emitters.by_place(gradient, storage);
    Batch* column = row;
    for (int i = 0; i < a.place_count; ++i) *column++ = scale * by_place[a.places[i]];
    for (std::size_t k = 0; k < N; ++k) *column++ = scale * gradient.rotation_angles[k];
    const Batch slope = scale * m.over_approach;
    if (a.size_count > 0) {
      const auto of_path =
          beam_path_adjoint(trace_[group], m.path, c.face_position, -slope * c.normal);
      for (int j = 0; j < a.size_count; ++j) {
        Batch sum = of_path.face_position[0] * c.size_rates[j][0];
        for (std::size_t i = 1; i < 2 * N; ++i) {
          sum = xsimd::fma(of_path.face_position[i], c.size_rates[j][i], sum);
        }
        *column++ = sum;
      }
    }
    for (int term = 0; term < a.term_count; ++term) {
      *column++ = scale * block.range_term(term, group);
    }
    *column++ = scale;
    const Vector3<Batch> point = m.origin() + m.range * trace_[group].direction();
    *column++ = -slope * dot(c.tangent_1, point);
    *column++ = -slope * dot(c.tangent_2, point);
    *column++ = slope;
    *column++ = scale * residual;

    // Comparison with NaN is false, and so are results of a blocked beam.
    const Lanes good = (m.approach > Batch(kLeastApproach)) & (m.range > zero) &
                       (xsimd::abs(residual) <= Batch(kLargest)) & (variance > zero) &
                       (variance <= Batch(kLargest));
    std::size_t lost = 0;
    if (!xsimd::all(good)) {
      for (Batch* entry = row; entry != column; ++entry) *entry = xsimd::select(good, *entry, zero);
      const Batch nan(__builtin_nan(""));
      residual = xsimd::select(good, residual, nan);
      variance = xsimd::select(good, variance, nan);
      lost = static_cast<std::size_t>(sum_of_lanes(xsimd::select(good, zero, one)));
    }
    residual.store_aligned(residuals.residual + group * kLanes);
    variance.store_aligned(residuals.variance + group * kLanes);
    return lost;
  }

  Trace<Batch, N> trace_[kGroups];
  Meeting meeting_[kGroups];
  ReversePass<Batch, N, 1> pass_[kGroups];
};

/// Adds the products of a block's shots to those of their cells.
/// @param first  shot of the call's columns
/// @param cell   of the shot before, moved on
template <TrainLayout N>
void add_to_cells(const PlaneArguments& a, const Products<N>& products, std::size_t columns,
                  std::size_t first, std::size_t shots, std::size_t& cell) {
  for (std::size_t i = 0; i < shots; ++i) {
    while (first + i >= a.cell_begin[cell + 1]) ++cell;
    double* out = a.cell_products + cell * 3 * columns;
    // Distance, normal 1 and 2: the last columns before the residual.
    const double d = products.entry(i, columns - 2), n1 = products.entry(i, columns - 4),
                 n2 = products.entry(i, columns - 3);
    for (std::size_t j = 0; j < columns; ++j) {
      const double value = products.entry(i, j);
      out[j] += d * value;
      out[columns + j] += n1 * value;
      out[2 * columns + j] += n2 * value;
    }
  }
}

template <TrainLayout N>
std::size_t accumulate_shots(const PlaneArguments& a) {
  Constants<N> constants(a);
  const auto columns =
      static_cast<std::size_t>(a.place_count + a.size_count + a.term_count) + N + 5;
  Products<N> products(columns);
  std::size_t cell = a.first_cell;
  ShotBlock<N> block;
  BlockResiduals residuals;
  Walks<N> walks;
  std::size_t lost = 0;
  for (std::size_t shot = a.begin; shot < a.end; shot += kBlock) {
    block.load(a, shot, a.end - shot < kBlock ? a.end - shot : kBlock);
    lost += walks.fill_rows(a, constants, block, shot, products, residuals);
    lost -= block.groups() * kLanes - block.shots();
    products.add(block.groups());
    if (a.cell_begin) add_to_cells<N>(a, products, columns, shot, block.shots(), cell);
    for (std::size_t i = 0; a.residual && i < block.shots(); ++i) {
      a.residual[shot + i] = residuals.residual[i];
    }
    for (std::size_t i = 0; a.variance && i < block.shots(); ++i) {
      a.variance[shot + i] = residuals.variance[i];
    }
  }
  products.store(a.products);
  return lost;
}

}  // namespace

std::size_t accumulate_plane(const PlaneArguments& a) {
  return with_layout(a.prisms, [&]<TrainLayout N>() { return accumulate_shots<N>(a); });
}

}  // namespace risley::calibration::RISLEY_KERNEL_NAMESPACE
