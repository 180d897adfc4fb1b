// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/normal_equations.hpp"

#include <algorithm>

#include <tbb/parallel_for.h>

#include "risley/core/require.hpp"

#include "estimation/normal_equations_kernel.hpp"

namespace risley::estimation {
namespace {

static_assert(kRotorStates == kStatesPerRotor);

/// Knots that one task sums up: fixed, so that sums do not depend on the number of threads.
constexpr std::size_t kBlockKnots = 1000;

void require_shots(const AngleSeries& series, const RotorTrajectory& knots,
                   const ShotColumns& columns) {
  const std::size_t shots = series.size();
  require_length("azimuth", series.azimuth.size(), shots);
  require_length("zenith", series.zenith.size(), shots);
  require_length("azimuth_rounding_variance", series.azimuth_rounding_variance.size(), shots);
  require_length("zenith_rounding_variance", series.zenith_rounding_variance.size(), shots);
  require_length("first_shot", knots.first_shot.size(), knots.size());
  require_length("last_shot", knots.last_shot.size(), knots.size());
  require_length("state", knots.state.size(),
                 knots.size() * static_cast<std::size_t>(knots.states()));
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    require_rows("shots of a knot", knots.first_shot[knot], knots.last_shot[knot], shots);
  }
  require_length_or_none("azimuth_residual", columns.azimuth_residual.size(), shots);
  require_length("zenith_residual", columns.zenith_residual.size(),
                 columns.azimuth_residual.size());
  require_length_or_none("outlier", columns.outlier.size(), shots);
}

/// Whether some knot has a beam that the train does not have. Others are not looked at: a rotor is
/// tracked through a recording a knot at a time.
bool has_unknown_beam(const AngleSeries& series, const RotorTrajectory& knots,
                      const PrismTrain& train) {
  if (series.beam.empty()) return false;
  require_length("beam", series.beam.size(), series.size());
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
  check_shape(train.shape());
  require_shots(series, knots, columns);
  require_free(free, train);
  require_between("number of prisms of the knots", knots.prisms, train.prisms(), train.prisms());
  check_noise(weights.angle_noise);
  require_not_below("softening", weights.softening, 0);
  require_threshold("cut", weights.cut);
  if (has_unknown_beam(series, knots, train)) {
    check_beams(train, series.beam, series.size());
  }
  const auto n = static_cast<int>(free.size());
  const auto prisms = static_cast<std::size_t>(knots.prisms);
  std::vector<int> place_begin{0}, places;
  for (const FreeParameter& parameter : free) {
    places.insert(places.end(), parameter.places.begin(), parameter.places.end());
    place_begin.push_back(static_cast<int>(places.size()));
  }
  equations.prisms = knots.prisms;
  equations.free = n;
  equations.curvature.resize(knots.size() * (prisms * (prisms + 1) / 2) * kTimePowers);
  equations.coupling.resize(knots.size() * prisms * kRotorStates * free.size());
  equations.gradient.resize(knots.size() * prisms * kRotorStates);

  NormalEquationArguments all;
  all.parameters = train.parameters().data();
  all.face_order = train.face_order().data();
  all.prisms = knots.prisms;
  all.emitters = train.emitters();
  if (!series.beam.empty()) all.beam = series.beam.data();
  all.free = n;
  all.place_begin = place_begin.data();
  all.places = places.data();
  all.first_shot = knots.first_shot.data();
  all.last_shot = knots.last_shot.data();
  all.knot_time_ns = knots.time_ns.data();
  all.state = knots.state.data();
  all.time_ns = series.time_ns.data();
  all.azimuth = series.azimuth.data();
  all.zenith = series.zenith.data();
  all.azimuth_rounding_variance = series.azimuth_rounding_variance.data();
  all.zenith_rounding_variance = series.zenith_rounding_variance.data();
  all.azimuth_noise_variance = weights.angle_noise.azimuth * weights.angle_noise.azimuth;
  all.zenith_noise_variance = weights.angle_noise.zenith * weights.angle_noise.zenith;
  all.turned = std::any_of(places.begin(), places.end(), [&](int place) {
    return place == place::frame_yaw(knots.prisms) || place == place::frame_pitch(knots.prisms);
  });
  all.softening = weights.softening;
  all.cut = weights.cut;
  all.curvature = equations.curvature.data();
  all.coupling = equations.coupling.data();
  all.gradient = equations.gradient.data();
  if (!columns.azimuth_residual.empty()) {
    all.azimuth_residual = columns.azimuth_residual.data();
    all.zenith_residual = columns.zenith_residual.data();
  }
  if (!columns.outlier.empty()) all.outlier = columns.outlier.data();

  const auto& kernel = RISLEY_KERNEL_COPIES(accumulate).at(set);
  const std::size_t blocks = (knots.size() + kBlockKnots - 1) / kBlockKnots;
  const std::size_t triangle = free.size() * (free.size() + 1) / 2;
  std::vector<double> hessians(blocks * triangle), gradients(blocks * free.size());
  std::vector<NormalEquationCounts> counts(blocks);
  tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t block) {
    NormalEquationArguments mine = all;
    mine.knot_begin = block * kBlockKnots;
    mine.knot_end = std::min(mine.knot_begin + kBlockKnots, knots.size());
    mine.static_hessian = hessians.data() + block * triangle;
    mine.static_gradient = gradients.data() + block * free.size();
    counts[block] = kernel(mine);
  });

  equations.static_hessian = Eigen::MatrixXd::Zero(n, n);
  equations.static_gradient = Eigen::VectorXd::Zero(n);
  equations.cost = 0;
  equations.outliers = 0;
  equations.shots = 0;
  for (std::size_t knot = 0; knot < knots.size(); ++knot) {
    equations.shots += knots.last_shot[knot] - knots.first_shot[knot];
  }
  for (std::size_t block = 0; block < blocks; ++block) {
    equations.cost += counts[block].cost;
    equations.outliers += counts[block].outliers;
    const double* entry = hessians.data() + block * triangle;
    for (int i = 0; i < n; ++i) {
      equations.static_gradient[i] += gradients[block * free.size() + static_cast<std::size_t>(i)];
      for (int j = i; j < n; ++j) equations.static_hessian(i, j) += *entry++;
    }
  }
  equations.static_hessian.triangularView<Eigen::StrictlyLower>() =
      equations.static_hessian.transpose();
}

}  // namespace risley::estimation
