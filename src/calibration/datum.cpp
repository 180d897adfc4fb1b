// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/datum.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <fmt/format.h>

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

/// One beam of a bundle and how it follows the parameters.
struct BundleBeam {
  std::size_t row = 0;  ///< of the rotation angles
  Eigen::Vector3d direction;
  Eigen::Matrix<double, 3, Eigen::Dynamic> jacobian;   ///< of the direction [3, free + held]
  Eigen::Matrix<double, 2, Eigen::Dynamic> of_angles;  ///< of azimuth and zenith [2, free + held]
};

template <int N>
std::vector<BundleBeam> bundle(const PrismTrain& train,
                               const std::vector<estimation::FreeParameter>& free,
                               const std::vector<std::vector<double>>& rotation_angles,
                               std::span<const std::uint8_t> emitter, const HeldMovement& held) {
  const auto order = face_order_array<N>(train);
  std::vector<PreparedTrain<double, N>> prepared;
  std::vector<PreparedDerivatives<double, N>> derivatives;
  for (int j = 0; j < train.emitters(); ++j) {
    prepared.push_back(prepare<double, N>(parameter_array<N>(train, j), order));
    derivatives.push_back(prepare_derivatives<double, N>(parameter_array<N>(train, j), order));
  }
  const auto n = static_cast<Index>(free.size());
  const Index all = n + held.train.cols();
  std::vector<BundleBeam> beams;
  for (std::size_t i = 0; i < rotation_angles.front().size(); ++i) {
    std::array<double, N> angles;
    for (std::size_t k = 0; k < N; ++k) angles[k] = rotation_angles[k][i];
    const std::size_t own = emitter.empty() ? 0 : emitter[i];
    const auto linear = linearise_direction(prepared[own], derivatives[own], angles);
    if (!linear.valid) continue;
    BundleBeam beam{i, eigen(linear.direction), {}, {}};
    beam.jacobian.resize(3, all);
    for (Index row = 0; row < 3; ++row) {
      const auto& gradient = linear.components[static_cast<std::size_t>(row)];
      for (Index j = 0; j < n; ++j) {
        double sum = 0;
        for (const int place : free[static_cast<std::size_t>(j)].places) {
          sum += derivative_by(gradient, place, static_cast<int>(own));
        }
        beam.jacobian(row, j) = sum;
      }
      for (Index h = 0; h < held.train.cols(); ++h) {
        double sum = 0;
        for (Index at = 0; at < held.train.rows(); ++at) {
          if (held.train(at, h) == 0) continue;
          sum += held.train(at, h) *
                 derivative_by(gradient, static_cast<int>(at), static_cast<int>(own));
        }
        for (std::size_t k = 0; k < N; ++k) {
          sum += held.rotation_angles(static_cast<Index>(k), h) * gradient.rotation_angles[k];
        }
        beam.jacobian(row, n + h) = sum;
      }
    }
    for (Index h = 0; h < held.turn.cols(); ++h) {
      const Eigen::Vector3d turn = held.turn.col(h);
      beam.jacobian.col(n + h) += turn.cross(beam.direction);
    }
    const AngleSeeds<double> seeds = angle_seeds(linear.direction);
    beam.of_angles.resize(2, all);
    for (Index j = 0; j < all; ++j) {
      beam.of_angles(0, j) = eigen(seeds.azimuth).dot(beam.jacobian.col(j));
      beam.of_angles(1, j) = eigen(seeds.zenith).dot(beam.jacobian.col(j));
    }
    beams.push_back(std::move(beam));
  }
  return beams;
}

/// Beams that get through the prisms, and how they turn together.
struct Bundle {
  std::vector<BundleBeam> beams;
  Eigen::MatrixXd covariance;  ///< of free and held [free + held, free + held]
  Matrix3d normal = Matrix3d::Zero();
  Eigen::MatrixXd turn;  ///< the shared rotation that each of them makes [3, free + held]

  double count() const { return static_cast<double>(beams.size()); }
  /// What is left of a beam's movements without the shared rotation [3, free + held].
  Eigen::MatrixXd rest(const BundleBeam& beam) const {
    Eigen::MatrixXd result = beam.jacobian;
    for (Index j = 0; j < result.cols(); ++j) {
      const Eigen::Vector3d shared = turn.col(j);
      result.col(j) += beam.direction.cross(shared);
    }
    return result;
  }
};

Bundle bundle_of(const PrismTrain& train, const std::vector<estimation::FreeParameter>& free,
                 const Eigen::MatrixXd& free_covariance,
                 const std::vector<std::vector<double>>& rotation_angles,
                 std::span<const std::uint8_t> emitter, const HeldMovement& held) {
  require_length("rows of the covariance", static_cast<std::size_t>(free_covariance.rows()),
                 free.size());
  require_length("columns of the covariance", static_cast<std::size_t>(free_covariance.cols()),
                 free.size());
  const Index n = free_covariance.rows(), all = n + held.train.cols();
  if (all > n) {
    require_length("rows of the held quantities", static_cast<std::size_t>(held.train.rows()),
                   train.parameters().size());
    require_length("rows of their rotation angles",
                   static_cast<std::size_t>(held.rotation_angles.rows()),
                   static_cast<std::size_t>(train.prisms()));
    require_length("columns of their rotation angles",
                   static_cast<std::size_t>(held.rotation_angles.cols()),
                   static_cast<std::size_t>(held.train.cols()));
    if (held.turn.size() > 0) {
      require_length("rows of their turns", static_cast<std::size_t>(held.turn.rows()), 3);
      require_length("columns of their turns", static_cast<std::size_t>(held.turn.cols()),
                     static_cast<std::size_t>(held.train.cols()));
    }
  }
  Bundle result;
  result.covariance = Eigen::MatrixXd::Identity(all, all);
  result.covariance.topLeftCorner(n, n) = free_covariance;
  require_length("rotation_angles", rotation_angles.size(),
                 static_cast<std::size_t>(train.prisms()));
  for (const auto& column : rotation_angles) {
    require_length("rotation angles of a prism", column.size(), rotation_angles.front().size());
  }
  result.beams = with_prism_count(train.prisms(), [&]<int N>() {
    check_beams(train, emitter, rotation_angles.front().size());
    return bundle<N>(train, free, rotation_angles, emitter, held);
  });
  if (result.beams.empty()) throw InvalidArgument("no beam gets through the prisms");
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(3, all);
  for (const BundleBeam& beam : result.beams) {
    result.normal += Matrix3d::Identity() - beam.direction * beam.direction.transpose();
    for (Index j = 0; j < right.cols(); ++j) {
      right.col(j) += beam.direction.cross(beam.jacobian.col(j));
    }
  }
  result.turn = algebra::SymmetricSolver(result.normal).solve_columns(right);
  return result;
}

/// Sigma of a quantity that changes by a row with free and held.
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
    const double azimuth = std::remainder(a.azimuth - b.azimuth, kTwoPi);
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

FormalDatum formal_datum(const PrismTrain& train,
                         const std::vector<estimation::FreeParameter>& free,
                         const Eigen::MatrixXd& covariance,
                         const std::vector<std::vector<double>>& rotation_angles,
                         std::span<const std::uint8_t> emitter, const HeldMovement& held) {
  const Bundle bundle = bundle_of(train, free, covariance, rotation_angles, emitter, held);
  const Matrix3d turn_covariance = algebra::propagated(bundle.turn, bundle.covariance);
  FormalDatum datum;
  datum.sigma_roll = std::sqrt(turn_covariance(0, 0));
  datum.sigma_pitch = std::sqrt(turn_covariance(1, 1));
  datum.sigma_yaw = std::sqrt(turn_covariance(2, 2));
  datum.gauge = std::sqrt(turn_covariance.cwiseProduct(bundle.normal).sum() / bundle.count());
  // Sums of J^T J over the beams: their products with the covariance sum up the variances.
  Eigen::MatrixXd shape = Eigen::MatrixXd::Zero(bundle.covariance.rows(), bundle.covariance.cols());
  Eigen::MatrixXd total = shape;
  for (const BundleBeam& beam : bundle.beams) {
    const Eigen::MatrixXd rest = bundle.rest(beam);
    algebra::add_transposed_product(rest, rest, rest.rows(), shape);
    algebra::add_transposed_product(beam.of_angles, beam.of_angles, 2, total);
  }
  const auto rms = [&bundle](const Eigen::MatrixXd& squares) {
    return std::sqrt(std::max(0.0, squares.cwiseProduct(bundle.covariance).sum()) / bundle.count());
  };
  datum.shape = rms(shape);
  datum.total = rms(total);
  return datum;
}

PointingErrors pointing_errors(const PrismTrain& believed, const PrismTrain& train,
                               const std::vector<estimation::FreeParameter>& free,
                               const Eigen::MatrixXd& covariance,
                               const std::vector<std::vector<double>>& rotation_angles,
                               std::span<const std::uint8_t> emitter, const HeldMovement& held) {
  require_between("number of prisms of the believed train", believed.prisms(), train.prisms(),
                  train.prisms());
  require_between("number of emitters of the believed train", believed.emitters(), train.emitters(),
                  train.emitters());
  const Bundle bundle = bundle_of(train, free, covariance, rotation_angles, emitter, held);
  std::vector<Vector3<double>> reported, calibrated;
  std::vector<double> angles(rotation_angles.size());
  for (const BundleBeam& beam : bundle.beams) {
    for (std::size_t k = 0; k < angles.size(); ++k) angles[k] = rotation_angles[k][beam.row];
    reported.push_back(
        observe(believed, angles, emitter.empty() ? 0 : emitter[beam.row]).direction);
    calibrated.push_back({beam.direction.x(), beam.direction.y(), beam.direction.z()});
  }
  PointingErrors result;
  result.errors = direction_errors(reported, calibrated);
  const Eigen::Vector3d turn = eigen(result.errors.rotation);
  // Each of the three is the root of a mean square: half the slope of the sum of squares, over
  // number and root.
  Eigen::RowVectorXd total = Eigen::RowVectorXd::Zero(bundle.covariance.cols()), shape = total;
  for (std::size_t i = 0; i < bundle.beams.size(); ++i) {
    const BundleBeam& beam = bundle.beams[i];
    if (!std::isfinite(reported[i].x)) continue;
    const auto from = angles_from_direction(reported[i]), to = angles_from_direction(calibrated[i]);
    total += std::remainder(from.azimuth - to.azimuth, kTwoPi) * beam.of_angles.row(0) +
             (from.zenith - to.zenith) * beam.of_angles.row(1);
    const Eigen::Vector3d rest = eigen(reported[i]) - beam.direction - turn.cross(beam.direction);
    shape += rest.transpose() * bundle.rest(beam);
    result.largest_shape = std::max(result.largest_shape, rest.norm());
  }
  const Eigen::RowVectorXd gauge = (turn.transpose() * bundle.normal) * bundle.turn;
  const auto sigma = [&bundle](const Eigen::RowVectorXd& slope, double root) {
    return root > 0 ? sigma_of(slope / (bundle.count() * root), bundle.covariance) : 0.0;
  };
  result.total_sigma = sigma(total, result.errors.total);
  result.gauge_sigma = sigma(gauge, result.errors.gauge);
  result.shape_sigma = sigma(shape, result.errors.shape);
  return result;
}

double better_probability(const PointingErrors& reported) {
  const double total = reported.errors.total, sigma = reported.total_sigma;
  if (total == 0) return 0.5;  // they are the same
  return 0.5 * std::erfc(-total / (2 * sigma) / std::sqrt(2.0));
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
