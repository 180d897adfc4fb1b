// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/piecewise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/estimation/batch_map.hpp"
#include "risley/parallel/parallel.hpp"

namespace risley::estimation {
namespace {

constexpr std::size_t kMostPieceShots = 100000;  // of one piece
constexpr std::size_t kFewestPieceShots = 500;

struct Piece {
  double time = 0, duration = 0;
  Eigen::VectorXd parameters;
  Eigen::MatrixXd covariance;
};

std::optional<Piece> estimate_piece(const Estimate& estimate, const sensors::Sensor& sensor,
                                    ShotRange shots, const Progress& progress) {
  const RotorTrajectory& trajectory = estimate.trajectory;
  const auto knot = trajectory.knot_of_shot(shots.begin);
  shots.end = std::min(shots.end, shots.begin + kMostPieceShots);
  if (!knot || shots.size() < kFewestPieceShots) return std::nullopt;
  Start start = estimate.start;
  start.time_ns = estimate.series.time_ns(shots.begin);
  start.train = estimate.train;
  const double seconds = 1e-9 * static_cast<double>(start.time_ns - trajectory.time_ns[*knot]);
  for (std::size_t k = 0; k < start.rotation_angle.size(); ++k) {
    start.rotation_angle[k] = trajectory.angle(*knot, k, seconds);
    start.angular_velocity[k] = trajectory.speed(*knot, k, seconds);
  }
  BatchMapOptions options;
  options.angle_noise = usable_noise(estimate.noise.value);
  options.free = estimate.free;
  options.rotor_process = estimate.rotor_process;
  const AngleSeries series = estimate.series.rows(shots);
  try {
    const Solution result = run_batch_map(series, start, sensor, options, progress);
    if (!result.settled) return std::nullopt;
    Piece piece{0, series.duration(), result.parameters, result.covariance};
    piece.time = estimate.series.time(shots.begin) + 0.5 * piece.duration;
    return piece;
  } catch (const EstimationError&) {  // such as a piece across a clock reset
    return std::nullopt;
  }
}

/// Differences from the weighted mean against their covariances; all parameters together, so that
/// their correlations count.
void fill_chi2(const std::vector<Piece>& pieces, PiecewiseEstimate& result) {
  result.chi2 = std::numeric_limits<double>::quiet_NaN();
  if (pieces.size() < 2 || pieces.front().parameters.size() == 0) return;
  const Eigen::Index n = pieces.front().parameters.size();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n);
  for (const Piece& piece : pieces) {
    const Eigen::MatrixXd weight = algebra::SymmetricSolver(piece.covariance).inverse();
    information += weight;
    sum += algebra::times(weight, piece.parameters);
  }
  const Eigen::VectorXd mean = algebra::SymmetricSolver(information).solve(sum);
  double chi2 = 0;
  for (const Piece& piece : pieces) {
    chi2 += algebra::SymmetricSolver(piece.covariance).chi2(piece.parameters - mean);
  }
  result.degrees_of_freedom = static_cast<double>(n) * static_cast<double>(pieces.size() - 1);
  result.chi2 = chi2 / result.degrees_of_freedom;
}

}  // namespace

PiecewiseEstimate estimate_piecewise(const Estimate& estimate, const sensors::Sensor& sensor,
                                     std::size_t pieces, const Progress& progress) {
  require_at_least("pieces", static_cast<long long>(pieces), 1);
  std::vector<std::optional<Piece>> all(pieces);
  const std::size_t shots = estimate.series.size();
  parallel::for_each_job(
      pieces,
      [&](std::size_t i) {
        all[i] = estimate_piece(estimate, sensor, {i * shots / pieces, (i + 1) * shots / pieces},
                                progress.silent());
      },
      progress);
  std::vector<Piece> sound;
  PiecewiseEstimate result;
  result.value.resize(estimate.free.size());
  result.sigma.resize(estimate.free.size());
  for (const std::optional<Piece>& piece : all) {
    if (!piece) {
      ++result.failed;
      continue;
    }
    sound.push_back(*piece);
    result.time.push_back(piece->time);
    result.duration = std::max(result.duration, piece->duration);
    for (std::size_t k = 0; k < estimate.free.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      result.value[k].push_back(piece->parameters[at]);
      result.sigma[k].push_back(std::sqrt(piece->covariance(at, at)));
    }
  }
  fill_chi2(sound, result);
  return result;
}

}  // namespace risley::estimation
