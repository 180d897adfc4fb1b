// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/normal_equations.hpp"

#include <algorithm>
#include <limits>

#include "risley/core/require.hpp"
#include "risley/parallel/in_order.hpp"
#include "risley/parallel/parallel.hpp"
#include "risley/parallel/pool.hpp"

#include "estimation/entry_checks.hpp"
#include "estimation/kernel_call.hpp"
#include "estimation/normal_equations_kernel.hpp"

namespace risley::estimation {
namespace {

static_assert(kRotorStates == kStatesPerRotor);

/// Knots summed by one task: fixed, so that sums do not depend on the number of threads. Their
/// shots, some ten thousand, stay in the processor's cache.
constexpr std::size_t kBlockKnots = 125;

void require_knots(std::size_t shots, const RotorTrajectory& knots) {
  require_length("first_shot", knots.first_shot.size(), knots.size());
  require_length("last_shot", knots.last_shot.size(), knots.size());
  require_length("state", knots.state.size(),
                 knots.size() * static_cast<std::size_t>(knots.states()));
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    require_rows("shots of a knot", knots.first_shot[knot], knots.last_shot[knot], shots);
  }
}

void require_shots(const AngleSeries& series, const ShotColumns& columns) {
  require_columns(series);
  require_length_or_none("azimuth_residual", columns.azimuth_residual.size(), series.size());
  require_length("zenith_residual", columns.zenith_residual.size(),
                 columns.azimuth_residual.size());
  require_length_or_none("outlier", columns.outlier.size(), series.size());
}

/// Whether some knot has a beam that the train does not have. Others are not checked: a rotor is
/// tracked through a recording knot by knot.
bool has_unknown_beam(const AngleSeries& series, const RotorTrajectory& knots,
                      const PrismTrain& train) {
  if (series.beam.empty()) return false;
  std::size_t begin = series.size(), end = 0;
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    begin = std::min(begin, knots.first_shot[knot]);
    end = std::max(end, knots.last_shot[knot]);
  }
  const auto at = [&](std::size_t row) {
    return series.beam.begin() + static_cast<std::ptrdiff_t>(row);
  };
  return begin < end && *std::max_element(at(begin), at(end)) >= train.emitters();
}

/// The sums of one call, block by block of knots.
class BlockSums {
 public:
  BlockSums(const RotorTrajectory& knots, const PrismTrain& train,
            const std::vector<FreeParameter>& free, const ShotWeights& weights,
            NormalEquations& equations, InstructionSet set)
      : knots_(knots),
        equations_(equations),
        kernel_(RISLEY_KERNEL_COPIES(accumulate).at(set)),
        places_(free),
        triangle_(free.size() * (free.size() + 1) / 2) {
    check_shape(train.shape());
    require_free(free, train);
    require_between("number of prisms of the knots", knots.prisms, train.prisms(), train.prisms());
    check_noise(weights.angle_noise);
    require_not_below("softening", weights.softening, 0);
    require_threshold("cut", weights.cut);
    const auto prisms = static_cast<std::size_t>(knots.prisms);
    equations.prisms = knots.prisms;
    equations.free = static_cast<int>(free.size());
    equations.curvature.resize(knots.size() * (prisms * (prisms + 1) / 2) * kTimePowers);
    equations.coupling.resize(knots.size() * prisms * kRotorStates * free.size());
    equations.gradient.resize(knots.size() * prisms * kRotorStates);
    hessians_.resize(blocks() * triangle_);
    gradients_.resize(blocks() * free.size());
    counts_.resize(blocks());

    static_cast<TrainArguments&>(all_) = arguments_of(train, places_);
    all_.azimuth_noise_variance = weights.angle_noise.azimuth * weights.angle_noise.azimuth;
    all_.zenith_noise_variance = weights.angle_noise.zenith * weights.angle_noise.zenith;
    all_.turned = std::any_of(free.begin(), free.end(),
                              [](const FreeParameter& parameter) { return parameter.of_frame; });
    all_.softening = weights.softening;
    all_.cut = weights.cut;
  }

  std::size_t blocks() const { return (knots_.size() + kBlockKnots - 1) / kBlockKnots; }
  /// Knots [begin, end) of a block.
  ShotRange knots_of(std::size_t block) const {
    return {block * kBlockKnots, std::min((block + 1) * kBlockKnots, knots_.size())};
  }

  /// Sums up a block. @param rows  of the series from row `first` on, with all shots of the block
  void add(std::size_t block, const AngleSeries& rows, std::size_t first,
           const ShotColumns& columns) {
    const ShotRange own = knots_of(block);
    NormalEquationArguments mine = all_;
    std::vector<std::size_t> first_shot, last_shot;
    for (std::size_t knot = own.begin; knot < own.end; ++knot) {
      first_shot.push_back(knots_.first_shot[knot] - first);
      last_shot.push_back(knots_.last_shot[knot] - first);
    }
    const auto states = static_cast<std::size_t>(knots_.states());
    const std::size_t curvatures = equations_.curvature.size() / knots_.size();
    const auto free = static_cast<std::size_t>(all_.free);
    mine.knot_end = own.size();
    mine.first_shot = first_shot.data();
    mine.last_shot = last_shot.data();
    mine.knot_time_ns = knots_.time_ns.data() + own.begin;
    mine.state = knots_.state.data() + own.begin * states;
    mine.curvature = equations_.curvature.data() + own.begin * curvatures;
    mine.coupling = equations_.coupling.data() + own.begin * states * free;
    mine.gradient = equations_.gradient.data() + own.begin * states;
    mine.static_hessian = hessians_.data() + block * triangle_;
    mine.static_gradient = gradients_.data() + block * free;
    static_cast<ShotArguments&>(mine) = arguments_of(rows);
    if (!columns.azimuth_residual.empty()) {
      mine.azimuth_residual = columns.azimuth_residual.data();
      mine.zenith_residual = columns.zenith_residual.data();
    }
    if (!columns.outlier.empty()) mine.outlier = columns.outlier.data();
    counts_[block] = kernel_(mine);
  }

  /// Sums the blocks, once all are complete.
  void finish() {
    const int n = equations_.free;
    const auto free = static_cast<std::size_t>(n);
    equations_.static_hessian = Eigen::MatrixXd::Zero(n, n);
    equations_.static_gradient = Eigen::VectorXd::Zero(n);
    equations_.cost = 0;
    equations_.outliers = 0;
    equations_.shots = 0;
    for (std::size_t knot = 0; knot < knots_.size(); ++knot) {
      equations_.shots += knots_.last_shot[knot] - knots_.first_shot[knot];
    }
    for (std::size_t block = 0; block < blocks(); ++block) {
      equations_.cost += counts_[block].cost;
      equations_.outliers += counts_[block].outliers;
      const double* entry = hessians_.data() + block * triangle_;
      for (int i = 0; i < n; ++i) {
        equations_.static_gradient[i] += gradients_[block * free + static_cast<std::size_t>(i)];
        for (int j = i; j < n; ++j) equations_.static_hessian(i, j) += *entry++;
      }
    }
    equations_.static_hessian.triangularView<Eigen::StrictlyLower>() =
        equations_.static_hessian.transpose();
  }

 private:
  const RotorTrajectory& knots_;
  NormalEquations& equations_;
  NormalEquationCounts (*kernel_)(const NormalEquationArguments&);
  FreePlaces places_;
  std::size_t triangle_;
  NormalEquationArguments all_;
  std::vector<double> hessians_, gradients_;
  std::vector<NormalEquationCounts> counts_;
};

/// Memory of one thread for a block of shots.
struct Unpacked {
  AngleSeries rows;
  std::vector<double> azimuth_residual, zenith_residual;
  std::vector<unsigned char> outlier;
};

}  // namespace

void NormalEquations::scale(double factor) {
  require_above("factor", factor, 0);
  for (auto* column : {&curvature, &coupling, &gradient}) {
    for (double& value : *column) value *= factor;
  }
  static_hessian *= factor;
  static_gradient *= factor;
}

void accumulate(const AngleSeries& series, const RotorTrajectory& knots, const PrismTrain& train,
                const std::vector<FreeParameter>& free, const ShotWeights& weights,
                NormalEquations& equations, const ShotColumns& columns, InstructionSet set) {
  check_available(set);
  require_shots(series, columns);
  require_knots(series.size(), knots);
  BlockSums sums(knots, train, free, weights, equations, set);
  if (has_unknown_beam(series, knots, train)) {
    check_beams(train, series.beam, series.size());
  }
  parallel::for_each(sums.blocks(),
                     [&](std::size_t block) { sums.add(block, series, 0, columns); });
  sums.finish();
}

void accumulate(const PackedSeries& series, const RotorTrajectory& knots, const PrismTrain& train,
                const std::vector<FreeParameter>& free, const ShotWeights& weights,
                NormalEquations& equations, const ShotLooks& looks) {
  require_knots(series.size(), knots);
  BlockSums sums(knots, train, free, weights, equations, best_instruction_set());
  if (series.size() > 0 && series.largest_beam() >= train.emitters()) {
    check_beams(train, series.rows().beam, series.size());
  }
  parallel::Pool<Unpacked> memory;
  parallel::in_order(
      sums.blocks(),
      [&](std::size_t block) -> std::function<void()> {
        const auto taken = memory.take();
        Unpacked& own = *taken;
        const ShotRange served = sums.knots_of(block);
        const ShotRange shots{knots.first_shot[served.begin], knots.last_shot[served.end - 1]};
        series.rows(shots, own.rows);
        if (looks.prepare) looks.prepare(own.rows);
        if (!looks.look) {
          sums.add(block, own.rows, shots.begin, {});
          return {};
        }
        own.azimuth_residual.resize(shots.size());
        own.zenith_residual.resize(shots.size());
        own.outlier.resize(shots.size());
        std::size_t row = 0;  // after those of the knots so far
        for (std::size_t knot = served.begin; knot < served.end; ++knot) {
          for (; row < knots.first_shot[knot] - shots.begin; ++row) {
            own.azimuth_residual[row] = own.zenith_residual[row] =
                std::numeric_limits<double>::quiet_NaN();
            own.outlier[row] = 1;
          }
          row = knots.last_shot[knot] - shots.begin;
        }
        sums.add(block, own.rows, shots.begin,
                 {own.azimuth_residual, own.zenith_residual, own.outlier});
        return looks.look(
            {own.rows, shots.begin, own.azimuth_residual, own.zenith_residual, own.outlier});
      },
      [](const std::function<void()>& after) {
        if (after) after();
      });
  sums.finish();
}

}  // namespace risley::estimation
