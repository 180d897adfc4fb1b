// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/datum.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/algebra/distributions.hpp"
#include "risley/algebra/products.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/optics/batch.hpp"
#include "risley/optics/observation_adjoint.hpp"
#include "risley/optics/observation_model.hpp"

#include "calibration/eigen_vectors.hpp"

namespace risley::calibration {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;

/// Sigma of a quantity with given derivatives by free and held ones.
double sigma_of(const Eigen::RowVectorXd& gradient, const Eigen::MatrixXd& covariance) {
  const Eigen::RowVectorXd product = gradient * covariance;
  return std::sqrt(std::max(product.dot(gradient), 0.0));  // NaN stays
}

}  // namespace

DirectionErrors direction_errors(std::span<const Vector3<double>> computed,
                                 std::span<const Vector3<double>> truth) {
  require_length("computed", computed.size(), truth.size());
  Matrix3d normal = Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  DirectionErrors errors;
  double count = 0;
  const auto sound = [&](std::size_t i) {
    return std::isfinite(computed[i].x) && std::isfinite(truth[i].x);
  };
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!sound(i)) continue;
    count += 1.0;
    const Eigen::Vector3d beam = eigen(truth[i]), error = eigen(computed[i]) - beam;
    normal += Matrix3d::Identity() - beam * beam.transpose();
    right += beam.cross(error);
    const auto a = angles_from_direction(computed[i]), b = angles_from_direction(truth[i]);
    const double azimuth = wrap_to_pi(a.azimuth - b.azimuth);
    const double zenith = a.zenith - b.zenith;
    errors.azimuth_bias += azimuth;
    errors.zenith_bias += zenith;
    errors.azimuth_rmse += azimuth * azimuth;
    errors.zenith_rmse += zenith * zenith;
  }
  if (count < 3) throw InvalidArgument("fewer than three directions to compare");
  const Eigen::Vector3d turn = algebra::SymmetricSolver(normal).solve(right);
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (!sound(i)) continue;
    const Eigen::Vector3d beam = eigen(truth[i]), rigid = turn.cross(beam);
    errors.gauge += rigid.squaredNorm();
    errors.shape += (eigen(computed[i]) - beam - rigid).squaredNorm();
  }
  errors.azimuth_bias /= count;
  errors.zenith_bias /= count;
  for (double* sum : {&errors.azimuth_rmse, &errors.zenith_rmse, &errors.gauge, &errors.shape}) {
    *sum = std::sqrt(*sum / count);
  }
  errors.total = std::hypot(errors.azimuth_rmse, errors.zenith_rmse);
  errors.rotation = {turn[0], turn[1], turn[2]};
  return errors;
}

BeamBundle::BeamBundle(const PrismTrain& train, const std::vector<estimation::FreeParameter>& free,
                       const std::vector<std::vector<double>>& rotation_angles,
                       std::span<const std::uint8_t> emitter, const HeldMovement& held)
    : prisms_(train.prisms()),
      emitters_(train.emitters()),
      free_(free.size()),
      held_(held.train.cols()) {
  if (held_ > 0) {
    require_length("rows of the held quantities", held.train.rows(), train.parameters().size());
    require_length("rows of their rotation angles", held.rotation_angles.rows(), prisms_);
    require_length("columns of their rotation angles", held.rotation_angles.cols(), held_);
    if (held.turn.size() > 0) {
      require_length("rows of their turns", held.turn.rows(), 3);
      require_length("columns of their turns", held.turn.cols(), held_);
    }
  }
  require_length("rotation_angles", rotation_angles.size(), prisms_);
  for (const auto& column : rotation_angles) {
    require_length("rotation angles of a prism", column.size(), rotation_angles.front().size());
  }
  with_layout(train.layout(), [&]<TrainLayout N>() {
    check_beams(train, emitter, rotation_angles.front().size());
    add_beams<N>(train, free, rotation_angles, emitter, held);
  });
  if (beams_.empty()) throw InvalidArgument("no beam passes through the prisms");
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(3, free_ + held_);
  for (const Beam& beam : beams_) {
    normal_ += Matrix3d::Identity() - beam.direction * beam.direction.transpose();
    for (Index j = 0; j < right.cols(); ++j) {
      right.col(j) += beam.direction.cross(beam.jacobian.col(j));
    }
  }
  turn_ = algebra::SymmetricSolver(normal_).solve_columns(right);
}

template <TrainLayout N>
void BeamBundle::add_beams(const PrismTrain& train,
                           const std::vector<estimation::FreeParameter>& free,
                           const std::vector<std::vector<double>>& rotation_angles,
                           std::span<const std::uint8_t> emitter, const HeldMovement& held) {
  const auto order = face_order_array<N>(train);
  std::vector<PreparedTrain<double, N>> prepared;
  std::vector<PreparedDerivatives<double, N>> derivatives;
  for (int j = 0; j < emitters_; ++j) {
    prepared.push_back(prepare<double, N>(parameter_array<N>(train, j), order));
    derivatives.push_back(prepare_derivatives<double, N>(parameter_array<N>(train, j), order));
  }
  for (std::size_t i = 0; i < rotation_angles.front().size(); ++i) {
    std::array<double, N> angles;
    for (std::size_t k = 0; k < N; ++k) angles[k] = rotation_angles[k][i];
    const std::uint8_t own = emitter.empty() ? std::uint8_t{0} : emitter[i];
    const auto linear = linearise_direction(prepared[own], derivatives[own], angles);
    if (!linear.valid) continue;
    Beam beam{{angles.begin(), angles.end()}, own, eigen(linear.direction), {}, {}};
    beam.jacobian.resize(3, free_ + held_);
    for (Index row = 0; row < 3; ++row) {
      const auto& gradient = linear.components[row];
      for (Index j = 0; j < free_; ++j) {
        double sum = 0;
        for (const int place : free[j].places) {
          sum += derivative_by(gradient, place, own);
        }
        beam.jacobian(row, j) = sum;
      }
      for (Index h = 0; h < held_; ++h) {
        double sum = 0;
        for (Index at = 0; at < held.train.rows(); ++at) {
          if (held.train(at, h) == 0) continue;
          sum += held.train(at, h) * derivative_by(gradient, static_cast<int>(at), own);
        }
        for (std::size_t k = 0; k < N; ++k) {
          sum += held.rotation_angles(k, h) * gradient.rotation_angles[k];
        }
        beam.jacobian(row, free_ + h) = sum;
      }
    }
    for (Index h = 0; h < held.turn.cols(); ++h) {
      const Eigen::Vector3d turn = held.turn.col(h);
      beam.jacobian.col(free_ + h) += turn.cross(beam.direction);
    }
    const AngleSeeds<double> seeds = angle_seeds(linear.direction);
    beam.of_angles.resize(2, free_ + held_);
    for (Index j = 0; j < free_ + held_; ++j) {
      beam.of_angles(0, j) = eigen(seeds.azimuth).dot(beam.jacobian.col(j));
      beam.of_angles(1, j) = eigen(seeds.zenith).dot(beam.jacobian.col(j));
    }
    beams_.push_back(std::move(beam));
  }
}

/// Of free parameters and what was held, which has sigmas of one [free + held, free + held].
Eigen::MatrixXd BeamBundle::covariance_of_all(const Eigen::MatrixXd& covariance,
                                              HeldErrors held) const {
  require_length("rows of the covariance", covariance.rows(), free_);
  require_length("columns of the covariance", covariance.cols(), free_);
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(free_ + held_, free_ + held_);
  all.topLeftCorner(free_, free_) = covariance;
  if (held == HeldErrors::included) all.bottomRightCorner(held_, held_).setIdentity();
  return all;
}

/// A beam's movements without the shared rotation [3, free + held].
Eigen::MatrixXd BeamBundle::rest(const Beam& beam) const {
  Eigen::MatrixXd result = beam.jacobian;
  for (Index j = 0; j < result.cols(); ++j) {
    const Eigen::Vector3d shared = turn_.col(j);
    result.col(j) += beam.direction.cross(shared);
  }
  return result;
}

FormalDatum BeamBundle::formal_datum(const Eigen::MatrixXd& covariance, HeldErrors held) const {
  const Eigen::MatrixXd all = covariance_of_all(covariance, held);
  const Matrix3d turn_covariance = algebra::propagated(turn_, all);
  FormalDatum datum;
  datum.sigma_roll = std::sqrt(turn_covariance(0, 0));
  datum.sigma_pitch = std::sqrt(turn_covariance(1, 1));
  datum.sigma_yaw = std::sqrt(turn_covariance(2, 2));
  datum.gauge = std::sqrt(turn_covariance.cwiseProduct(normal_).sum() / count());
  // Sums of J^T J over the beams: their products with the covariance are the summed variances.
  Eigen::MatrixXd shape = Eigen::MatrixXd::Zero(all.rows(), all.cols()), total = shape;
  for (const Beam& beam : beams_) {
    const Eigen::MatrixXd rest_of_beam = rest(beam);
    algebra::add_transposed_product(rest_of_beam, rest_of_beam, rest_of_beam.rows(), shape);
    algebra::add_transposed_product(beam.of_angles, beam.of_angles, 2, total);
  }
  const auto rms = [&](const Eigen::MatrixXd& squares) {
    return std::sqrt(std::max(0.0, squares.cwiseProduct(all).sum()) / count());
  };
  datum.shape = rms(shape);
  datum.total = rms(total);
  return datum;
}

PointingError BeamBundle::pointing_error(const PrismTrain& believed,
                                         const Eigen::MatrixXd& covariance) const {
  require_between("number of prisms of the believed train", believed.prisms(), prisms_, prisms_);
  require_between("number of emitters of the believed train", believed.emitters(), emitters_,
                  emitters_);
  const Eigen::MatrixXd all = covariance_of_all(covariance, HeldErrors::included);
  const Eigen::MatrixXd given_held = covariance_of_all(covariance, HeldErrors::left_out);
  std::vector<Vector3<double>> reported, calibrated;
  for (const Beam& beam : beams_) {
    reported.push_back(observe(believed, beam.rotation_angles, beam.emitter).direction);
    calibrated.push_back({beam.direction.x(), beam.direction.y(), beam.direction.z()});
  }
  PointingError result;
  result.errors = direction_errors(reported, calibrated);
  const Eigen::Vector3d turn = eigen(result.errors.rotation);
  // Each of the three is the root of a mean square: half the slope of the sum of squares, over
  // number and root.
  Eigen::RowVectorXd total = Eigen::RowVectorXd::Zero(all.cols()), shape = total;
  for (std::size_t i = 0; i < beams_.size(); ++i) {
    const Beam& beam = beams_[i];
    if (!std::isfinite(reported[i].x)) continue;
    const auto from = angles_from_direction(reported[i]), to = angles_from_direction(calibrated[i]);
    const Eigen::RowVector2d apart(wrap_to_pi(from.azimuth - to.azimuth), from.zenith - to.zenith);
    total += apart * beam.of_angles;
    const Eigen::Vector3d left = eigen(reported[i]) - beam.direction - turn.cross(beam.direction);
    const Eigen::RowVectorXd slope = left.transpose() * rest(beam);
    shape += slope;
    if (left.norm() <= result.worst_shape) continue;
    result.worst_shape = left.norm();
    result.worst_shape_sigma = sigma_of(slope / left.norm(), all);
  }
  const Eigen::RowVectorXd gauge = (turn.transpose() * normal_) * turn_;
  const auto sigma = [&](const Eigen::RowVectorXd& slope, double root,
                         const Eigen::MatrixXd& of_all) {
    return root > 0 ? sigma_of(slope / (count() * root), of_all) : 0.0;
  };
  result.total_sigma = sigma(total, result.errors.total, all);
  result.gauge_sigma = sigma(gauge, result.errors.gauge, all);
  result.shape_sigma = sigma(shape, result.errors.shape, all);
  result.total_sigma_given_held = sigma(total, result.errors.total, given_held);
  return result;
}

double better_probability(const PointingError& error) {
  const double total = error.errors.total, sigma = error.total_sigma_given_held;
  if (total == 0) return 0.5;  // they are the same
  return algebra::normal_tail(-total / (2 * sigma));
}

double beyond_probability(double error, double sigma, double tolerance) {
  if (!(sigma > 0)) return error > tolerance ? 1 : 0;
  return algebra::normal_tail((tolerance - error) / sigma);
}

DatumKind datum_kind(bool planes, bool stations) {
  if (planes) return stations ? DatumKind::both : DatumKind::planes;
  return stations ? DatumKind::stations : DatumKind::none;
}

const char* to_string(DatumKind kind) {
  switch (kind) {
    case DatumKind::none:
      return "walls only";
    case DatumKind::planes:
      return "known planes";
    case DatumKind::stations:
      return "known stations";
    case DatumKind::both:
      return "known planes and stations";
  }
  return "walls only";
}

}  // namespace risley::calibration
