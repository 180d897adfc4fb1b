// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "calibration/judge_flight.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "risley/algebra/symmetric.hpp"
#include "risley/calibration/datum.hpp"
#include "risley/calibration/planar_adjustment.hpp"
#include "risley/core/median.hpp"
#include "risley/estimation/weak_directions.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Combinations that the flight determines less well than prior knowledge are named.
constexpr double kUntold = 1;
/// A mean error of the trajectory that keeps this part of its sigma and correlates this strongly
/// with a boresight angle is determined only as a sum with it.
constexpr double kKeptSigma = 0.6, kTiedCorrelation = 0.8;
constexpr std::size_t kDatumBeams = 4000;

/// A root of a covariance, [n, n]: its product with its transpose.
MatrixXd root_of(const MatrixXd& covariance) {
  const algebra::PrincipalAxes axes = algebra::principal_axes(covariance);
  return axes.vectors * axes.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

FlightDatum datum_of(const FlightEvidence& e, const MatrixXd& movement) {
  const FlightShots& shots = e.shots;
  const std::vector<std::size_t> rows = spread_rows(shots.size(), kDatumBeams);
  std::vector<std::vector<double>> angles(shots.rotation_angle.size());
  std::vector<std::uint8_t> beam;
  std::vector<double> ranges;
  for (const std::size_t row : rows) {
    for (std::size_t k = 0; k < angles.size(); ++k) {
      angles[k].push_back(shots.rotation_angle[k][row]);
    }
    if (!shots.beam.empty()) beam.push_back(shots.beam[row]);
    ranges.push_back(shots.range[row]);
  }
  HeldMovement bundle;
  bundle.train = MatrixXd::Zero(e.model.train.parameters().size(), movement.cols());
  bundle.rotation_angles = MatrixXd::Zero(e.model.train.prisms(), movement.cols());
  bundle.turn = movement.topRows<3>();
  for (std::size_t j = 0; j < e.model.free.size(); ++j) {
    for (const int at : e.model.free[j].places) {
      bundle.train.row(at) = movement.row(FlightUnknowns::parameter(static_cast<int>(j)));
    }
  }
  const FormalDatum formal =
      BeamBundle(e.model.train, {}, angles, beam, bundle).formal_datum(MatrixXd::Zero(0, 0));
  FlightDatum datum;
  datum.sigma_x = formal.sigma_roll;
  datum.sigma_y = formal.sigma_pitch;
  datum.sigma_z = formal.sigma_yaw;
  datum.rotation = formal.gauge;
  datum.shape = formal.shape;
  datum.total = std::hypot(formal.gauge, formal.shape);
  datum.height = upper_median(ranges);
  return datum;
}

std::vector<NotTold> not_told_of(const FlightEvidence& e, const MatrixXd& all) {
  std::vector<NotTold> not_told;
  const Index globals = e.model.unknowns().size();
  const std::vector<std::string> names = unknown_names(e.model);
  std::vector<Index> adjusted;
  std::vector<estimation::FreeParameter> unknowns;
  for (Index i = 0; i < globals; ++i) {
    if (e.priors.held[i]) continue;
    adjusted.push_back(i);
    unknowns.push_back({names[i], {}, e.prior_sigma[i]});
  }
  const Index count = adjusted.size();
  MatrixXd covariance(count, count), prior(count, count);
  for (Index i = 0; i < count; ++i) {
    for (Index j = 0; j < count; ++j) {
      const Index row = adjusted[i], column = adjusted[j];
      covariance(i, j) = all(row, column);
      prior(i, j) = e.priors.information(row, column);
    }
  }
  // Of the flight alone.
  const MatrixXd information = algebra::SymmetricSolver(covariance).inverse() - prior;
  for (const auto& weak : estimation::weak_directions(information, unknowns, kUntold)) {
    not_told.push_back(
        {estimation::direction_text(weak), weak.sigma / std::hypot(1.0, weak.sigma)});
  }
  // Constant errors of the trajectory look like a boresight.
  constexpr const char* kMeans[] = {"tilts about east", "tilts about north", "heading"};
  const TrajectoryKnots& knots = e.model.knots;
  for (Index c = 3; c < kCorrections; ++c) {
    const auto row = static_cast<Index>(error_of(static_cast<int>(c)));
    const double time = e.priors.process.correlation_times()[row];
    std::vector<double> sigmas;
    for (const std::int64_t one : knots.time_ns) {
      sigmas.push_back(e.priors.process.sigmas(one)[row]);
    }
    double before = 0;
    for (std::size_t i = 0; i < knots.size(); ++i) {
      for (std::size_t j = 0; j < knots.size(); ++j) {
        before +=
            sigmas[i] * sigmas[j] *
            std::exp(-std::abs(static_cast<double>(knots.time_ns[i] - knots.time_ns[j]) * 1e-9) /
                     time);
      }
    }
    if (!(before > 0)) continue;
    const double sigma_before = std::sqrt(before) / static_cast<double>(knots.size());
    const double variance = all(globals + c, globals + c);
    const double kept = std::sqrt(variance) / sigma_before;
    if (kept < kKeptSigma) continue;
    for (Index i = 0; i < 3; ++i) {
      if (e.priors.held[i]) continue;
      const double correlation = all(i, globals + c) / std::sqrt(all(i, i) * variance);
      if (std::abs(correlation) < kTiedCorrelation) continue;
      not_told.push_back(
          {fmt::format("{} against the {} of the trajectory", names[i], kMeans[c - 3]), kept});
    }
  }
  return not_told;
}

}  // namespace

FlightJudgement judge_flight(const FlightEvidence& e) {
  FlightJudgement result;
  const Index globals = e.system.globals(), size = e.system.size();
  const Index knots = (size - globals) / kCorrections;
  MatrixXd functionals = MatrixXd::Zero(size, globals + kCorrections);
  functionals.bottomLeftCorner(globals, globals).setIdentity();
  for (Index k = 0; k < knots; ++k) {
    functionals.block(kCorrections * k, globals, kCorrections, kCorrections) =
        MatrixXd::Identity(kCorrections, kCorrections) / static_cast<double>(knots);
  }
  const MatrixXd all = flight_covariance(e.shots, e.poses, e.plane, e.model, e.weights, e.priors,
                                         e.system, functionals, e.ground);
  result.not_told = not_told_of(e, all);
  // Held quantities that may be off, one sigma each, shift everything else.
  const MatrixXd changes = e.system.held_changes();
  const auto considered = static_cast<Index>(e.considered);
  MatrixXd movement = MatrixXd::Zero(globals, globals + considered + e.further.cols());
  if (e.further.cols() > 0) movement.rightCols(e.further.cols()) = e.further;
  movement.leftCols(globals) = root_of(all.topLeftCorner(globals, globals));
  Index column = 0, of_considered = globals;
  for (Index i = 0; i < globals; ++i) {
    if (!e.priors.held[i]) continue;
    if (i >= globals - considered) {
      movement.col(of_considered) = e.prior_sigma[i] * changes.col(column).tail(globals);
      movement(i, of_considered++) = e.prior_sigma[i];
    }
    ++column;
  }
  result.datum = datum_of(e, movement);
  const MatrixXd rates = value_rates(e.model);
  result.covariance = rates * movement * movement.transpose() * rates.transpose();
  const VectorXd diagonal =
      e.inverse_diagonal != nullptr ? *e.inverse_diagonal : e.system.inverse_diagonal();
  result.correction_sigma = Eigen::Map<const MatrixXd>(diagonal.data(), kCorrections, knots);
  result.correction_sigma = result.correction_sigma.cwiseSqrt().eval();

  const std::vector<std::string> names = unknown_names(e.model);
  const VectorXd values = unknown_values(e.model);
  for (Index i = 0; i < globals; ++i) {
    FlightUnknown& own = result.unknowns.emplace_back();
    own.name = names[i];
    own.start = e.priors.mean[i];
    own.value = values[i];
    own.sigma = std::sqrt(result.covariance(i, i));
    own.prior_sigma = e.prior_sigma[i];
    own.held = e.priors.held[i];
    if (own.held) continue;
    own.prior_share = std::min(1.0, std::pow(own.sigma / own.prior_sigma, 2));
    for (Index j = 0; j < globals; ++j) {
      if (j == i || e.priors.held[j]) continue;
      const double correlation =
          result.covariance(i, j) / std::sqrt(result.covariance(i, i) * result.covariance(j, j));
      if (std::abs(correlation) > std::abs(own.twin_correlation)) {
        own.twin_correlation = correlation;
        own.twin = names[j];
      }
    }
  }
  return result;
}

}  // namespace risley::calibration
