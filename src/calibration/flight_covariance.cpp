// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "risley/calibration/flight_adjustment.hpp"
#include "risley/core/require.hpp"

#include "calibration/plane_knowledge.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Parts of an interval within which the trajectory's process counts as one value.
constexpr int kIntervalParts = 8;
/// Share of a shot's variance that stays its own, however rough the ground is.
constexpr double kLeastOwnShare = 0.25;

/// Effect of the shots of a counted cell on the functions, patch by patch, weighted.
struct PatchSums {
  std::int32_t plane = 0;
  Eigen::Matrix<float, Eigen::Dynamic, RoughGround::kPatches> sums;  // [functions, patches]
};

/// Those of a piece. Its rows come plane by plane.
std::vector<PatchSums> patch_sums(const FlightRows& rows, const PlaneOfShot& plane,
                                  const RoughGround& ground, const VectorXd& weight,
                                  const MatrixXd& moved) {
  std::vector<PatchSums> all;
  for (Index i = 0; i < moved.rows(); ++i) {
    const std::size_t shot = rows.shots[i];
    if (ground.patch[shot] < 0 || !(weight[i] > 0)) continue;
    if (all.empty() || all.back().plane != plane[shot]) {
      all.push_back({plane[shot], {}});
      all.back().sums.setZero(moved.cols(), RoughGround::kPatches);
    }
    all.back().sums.col(ground.patch[shot]) += (weight[i] * moved.row(i)).cast<float>().transpose();
  }
  return all;
}

/// Effect of the errors of the shots of one piece on the functions.
struct PieceErrors {
  MatrixXd noise;  // [functions, functions]: of each shot's own errors, or a sample's
  MatrixXd parts;  // [functions, 6 parts]: of the trajectory's process
  std::vector<PatchSums> patches;
  std::size_t interval = 0;
};

/// Effect of errors of shots on functions of the solution.
struct FunctionErrors {
  const FlightShots& shots;
  const PlaneOfShot& plane;
  const FlightModel& model;
  const FlightWeights& weights;
  const RoughGround* ground;
  MatrixXd solved, planes;  // of the functionals [size, functions], [3 planes, functions]
  Index globals;
  MatrixXd by_global = solved.bottomRows(globals);

  PieceErrors of_piece(const FlightRows& rows) const;

 private:
  /// Common errors of the shots of a sample or of a part of the interval.
  void add_shared(const FlightRows& rows, const MatrixXd& pose, const VectorXd& weight,
                  const VectorXd& weight_behind, const MatrixXd& moved, PieceErrors& own) const;
};

PieceErrors FunctionErrors::of_piece(const FlightRows& rows) const {
  const Index count = solved.cols();
  PieceErrors own;
  own.interval = rows.interval;
  own.noise = MatrixXd::Zero(count, count);
  own.parts = MatrixXd::Zero(count, kCorrections * kIntervalParts);
  if (rows.shots.empty()) return own;
  const TrajectoryKnots::Interval& interval = model.knots.intervals[rows.interval];
  const Index n = rows.shots.size();
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>
      values(rows.values.data(), n, rows.columns);
  const MatrixXd pose = values.middleCols(globals, kCorrections);
  const Index knot = kCorrections * interval.knot;
  MatrixXd moved = values.leftCols(globals) * by_global;  // [n, count]
  VectorXd weight_behind(n);
  const auto length = static_cast<double>(interval.end_ns - interval.begin_ns);
  for (Index i = 0; i < n; ++i) {
    const std::int64_t time = shots.time_ns[rows.shots[i]];
    weight_behind[i] = static_cast<double>(time - interval.begin_ns) / length;
  }
  const MatrixXd before = pose * solved.middleRows<kCorrections>(knot);
  const MatrixXd behind = pose * solved.middleRows<kCorrections>(knot + kCorrections);
  moved += before + weight_behind.asDiagonal() * (behind - before);
  for (Index i = 0; i < n; ++i) {
    const std::int32_t p = plane[rows.shots[i]];
    for (Index k = 0; k < 3; ++k) {
      moved.row(i) += values(i, globals + kCorrections + k) * planes.row(3 * p + k);
    }
  }
  const VectorXd weight = values.col(globals + 11);
  // Rows of lost shots may hold NaN.
  for (Index i = 0; i < n; ++i) {
    if (weight[i] == 0) moved.row(i).setZero();
  }
  const VectorXd variance =
      (weight.array() > 0).select(weight.array().square() * values.col(globals + 10).array(), 0.0);
  if (ground == nullptr) {
    own.noise = moved.transpose() * variance.asDiagonal() * moved;
  } else {
    const double of_ground = ground->covariance.diagonal().mean();
    const VectorXd left = (variance.array() - of_ground * weight.array().square())
                              .max(kLeastOwnShare * variance.array());
    own.noise = moved.transpose() * left.asDiagonal() * moved;
    own.patches = patch_sums(rows, plane, *ground, weight, moved);
  }
  add_shared(rows, pose, weight, weight_behind, moved, own);
  return own;
}

void FunctionErrors::add_shared(const FlightRows& rows, const MatrixXd& pose,
                                const VectorXd& weight, const VectorXd& weight_behind,
                                const MatrixXd& moved, PieceErrors& own) const {
  const TrajectoryKnots::Interval& interval = model.knots.intervals[rows.interval];
  const Index n = moved.rows(), count = moved.cols();
  const double sample_ns = weights.sample_interval * 1e9;
  const std::int64_t first_ns = shots.time_ns[rows.begin];
  const auto samples =
      static_cast<Index>(static_cast<double>(shots.time_ns[rows.end - 1] - first_ns) / sample_ns) +
      2;
  MatrixXd shared = MatrixXd::Zero(count, kCorrections * samples);
  const auto first_sample =
      static_cast<Index>(std::floor(static_cast<double>(first_ns - interval.begin_ns) / sample_ns));
  for (Index i = 0; i < n; ++i) {
    if (weight[i] == 0) continue;
    const std::int64_t time = shots.time_ns[rows.shots[i]];
    const auto sample =
        static_cast<Index>(std::floor(static_cast<double>(time - interval.begin_ns) / sample_ns)) -
        first_sample;
    const auto part = std::clamp<Index>(static_cast<Index>(weight_behind[i] * kIntervalParts), 0,
                                        kIntervalParts - 1);
    const VectorXd weighted = weight[i] * moved.row(i).transpose();
    for (Index k = 0; k < kCorrections; ++k) {
      own.parts.col(kCorrections * part + k) += pose(i, k) * weighted;
      const double white = weights.white[k];
      if (white == 0) continue;
      shared.col(kCorrections * std::min(sample, samples - 1) + k) += white * pose(i, k) * weighted;
    }
  }
  own.noise += shared * shared.transpose();
}

}  // namespace

MatrixXd flight_covariance(const FlightShots& shots, const ShotPoses& poses,
                           const PlaneOfShot& plane, const FlightModel& model,
                           const FlightWeights& weights, const FlightPriors& priors,
                           const FlightSystem& system, const MatrixXd& functionals,
                           const RoughGround* ground, InstructionSet set) {
  if (ground != nullptr) require_length("patches", ground->patch.size(), shots.size());
  MatrixXd solution = system.solve(functionals);
  MatrixXd of_planes = system.planes_of(solution);
  const FunctionErrors errors{
      shots,           plane, model, weights, ground, std::move(solution), std::move(of_planes),
      system.globals()};
  const Index count = functionals.cols();
  const std::size_t pieces = flight_pieces(model);
  std::vector<PieceErrors> sums(pieces);
  for_each_flight_piece(
      shots, poses, plane, model, weights,
      [&](std::size_t piece, const FlightRows& rows) { sums[piece] = errors.of_piece(rows); }, set);

  MatrixXd covariance = errors.solved.transpose() * system.prior_times(errors.solved);
  for (const PlanePrior& prior : priors.planes) {
    const auto own = errors.planes.middleRows<3>(3 * prior.plane);
    const PlaneKnowledge known = knowledge_of(prior, model.planes[prior.plane]);
    covariance += own.transpose() * known.information.asDiagonal() * own;
  }
  if (ground != nullptr) {
    std::map<std::int32_t, MatrixXd> by_plane;
    for (const PieceErrors& own : sums) {
      for (const PatchSums& one : own.patches) {
        MatrixXd& all = by_plane[one.plane];
        if (all.size() == 0) all = MatrixXd::Zero(count, RoughGround::kPatches);
        all += one.sums.cast<double>();
      }
    }
    for (const auto& [number, all] : by_plane) {
      covariance += ground->cells_for_each * all * ground->covariance * all.transpose();
    }
  }
  for (std::size_t first = 0; first < pieces;) {
    MatrixXd parts = MatrixXd::Zero(count, kCorrections * kIntervalParts);
    const std::size_t interval = sums[first].interval;
    while (first < pieces && sums[first].interval == interval) {
      covariance += sums[first].noise;
      parts += sums[first].parts;
      ++first;
    }
    const TrajectoryKnots::Interval& own = model.knots.intervals[interval];
    for (int c = 0; c < kCorrections; ++c) {
      MatrixXd of_part(count, kIntervalParts);
      for (Index k = 0; k < kIntervalParts; ++k) of_part.col(k) = parts.col(kCorrections * k + c);
      covariance +=
          of_part *
          covariance_between_knots(priors.process, c, own.begin_ns, own.end_ns, kIntervalParts) *
          of_part.transpose();
    }
  }
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace risley::calibration
