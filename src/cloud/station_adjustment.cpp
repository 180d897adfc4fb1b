// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/cloud/station_adjustment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/algebra/distributions.hpp"
#include "risley/algebra/rotation_vector.hpp"
#include "risley/algebra/symmetric.hpp"
#include "risley/cloud/point_covariance.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/square.hpp"

namespace risley::cloud {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// Points of a picked target's surface lie within this, m, or this share of the distance.
constexpr double kNearPicked = 0.1, kNearPickedShare = 0.01;
/// Points kept for a sphere lie within this many radii of its stated place.
constexpr double kNearSphere = 3;
/// Beyond this angle of incidence beams meet both a sphere and its background.
constexpr double kSteepest = 60 * kRadiansPerDegree;
constexpr std::size_t kFewestOfSphere = 20;
constexpr int kSteps = 50;
/// Largest step of a sphere, in radii.
constexpr double kLongestStep = 0.5;
/// Required share of the beams that meet a sphere with ranges to it, and their largest scatter in
/// sigmas.
constexpr double kShareOfSphere = 0.7, kWorstSphere = 2;
/// Ranges that miss a sphere by this many sigmas belong to another object.
constexpr double kOutlier = 4;
/// Three targets that determine a rotation by less than this, rad, are on a line.
constexpr double kLeastTold = 5 * kRadiansPerDegree;
/// Sigmas of places are raised to this share of the worst one, which would otherwise have no
/// weight.
constexpr double kLeastSigmaShare = 1e-3;
/// Targets have no common line about which they could turn.
constexpr double kLeastTurning = 1e-14;

double reach_of(const StationTarget& target) {
  if (target.radius) return kNearSphere * *target.radius;
  return std::max(kNearPicked, kNearPickedShare * target.in_scan.norm());
}

}  // namespace

/// A point with its errors.
struct TargetPoints::Near {
  Vector3d at;
  Matrix3d own;
  std::vector<Vector3d> loading;
};

class TargetPoints::Sink final : public CloudWriter {
 public:
  explicit Sink(TargetPoints& whole) : whole_(whole) {}

  void write(const Points& points) override {
    for (std::size_t t = 0; t < whole_.targets_.size(); ++t) {
      const StationTarget& target = whole_.targets_[t];
      const double reach = square(reach_of(target));
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Vector3d at(points.x[i], points.y[i], points.z[i]);
        if (!((at - target.in_scan).squaredNorm() < reach)) continue;
        Near& near = whole_.near_[t].emplace_back();
        near.at = at;
        near.own = own_covariance(points, i);
        for (const auto& factor : points.loading) {
          near.loading.emplace_back(factor[0][i], factor[1][i], factor[2][i]);
        }
      }
    }
  }
  void close() override {}

 private:
  TargetPoints& whole_;
};

namespace {

/// The sphere of a known radius on which points lie, from their ranges: directions are taken as
/// exact, and ranges scatter. Selecting beams by direction alone does not bias the range.
template <class Near>
MeasuredTarget fit_sphere(const StationTarget& target, const std::vector<Near>& near) {
  const double radius = *target.radius;
  MeasuredTarget result;
  result.at = target.in_scan;
  const auto refuse = [&](const std::string& why) {
    throw InvalidArgument(
        fmt::format("target {}: no sphere with a radius of {:g} m within {:g} m of in_scan_m: {}",
                    target.name, radius, reach_of(target), why));
  };
  double reach = 0.8 * radius;  // of the middle of beams, until the place is known
  for (int step = 0; step < kSteps; ++step) {
    Matrix3d normal = Matrix3d::Zero();
    Vector3d right = Vector3d::Zero();
    std::vector<Vector3d> moved;
    double squares = 0;
    std::size_t used = 0, met = 0;
    const bool near_end = step > kSteps / 2;
    for (const Near& one : near) {
      const Vector3d beam = one.at.normalized();
      const double along = beam.dot(result.at);
      const Vector3d across = along * beam - result.at;
      const double aside = across.squaredNorm();
      if (aside > square(std::min(reach, radius * std::sin(kSteepest)))) continue;
      ++met;
      const Vector3d out = across - std::sqrt(square(radius) - aside) * beam;
      const Vector3d n = out / radius;  // point where the beam meets the sphere
      const double off = n.dot(one.at - result.at) - radius;
      const double variance = n.dot(one.own * n);
      if (near_end && square(off) > square(kOutlier) * variance) continue;
      // Far off: an object in front of or behind the sphere.
      if (!near_end && std::abs(off) > 2 * radius) continue;
      ++used;
      squares += square(off) / variance;
      normal += n * n.transpose() / variance;
      right += n * off / variance;
      moved.resize(one.loading.size(), Vector3d::Zero());
      for (std::size_t k = 0; k < moved.size(); ++k) {
        moved[k] += n * n.dot(one.loading[k]) / variance;
      }
    }
    if (used < kFewestOfSphere) {
      refuse(fmt::format("{} points meet it, expected {} at least", used, kFewestOfSphere));
    }
    const algebra::SymmetricSolver solver{MatrixXd(normal)};
    if (!solver.positive()) refuse("its points do not determine its position");
    Vector3d shift = solver.solve(VectorXd(right));
    // After a long step other beams meet the sphere.
    shift *= std::min(1.0, kLongestStep * radius / std::max(shift.norm(), 1e-300));
    result.at += shift;
    result.points = used;
    reach = radius;
    if (shift.norm() > 1e-6 && step + 1 < kSteps) continue;
    if (!near_end && step + 1 < kSteps) {
      step = kSteps / 2;  // once more without points that do not belong to it
      continue;
    }
    const double unit = squares / static_cast<double>(used - 3);
    if (static_cast<double>(used) < kShareOfSphere * static_cast<double>(met)) {
      refuse(fmt::format("of {} beams towards it, {} have ranges to it", met, used));
    }
    if (unit > square(kWorstSphere) || (result.at - target.in_scan).norm() > reach_of(target)) {
      refuse(fmt::format("ranges miss the best one by {:.1f} sigmas", std::sqrt(unit)));
    }
    result.own = solver.inverse() * std::max(1.0, unit);
    for (const Vector3d& m : moved) result.loading.push_back(solver.solve(VectorXd(m)));
    return result;
  }
  return result;
}

/// A picked point, with the common factors' effect on the surrounding points.
template <class Near>
MeasuredTarget picked(const StationTarget& target, const std::vector<Near>& near) {
  MeasuredTarget result;
  result.at = target.in_scan;
  result.own = square(target.in_scan_sigma) * Matrix3d::Identity();
  result.points = near.size();
  result.loading.assign(near.front().loading.size(), Vector3d::Zero());
  for (const Near& one : near) {
    for (std::size_t k = 0; k < one.loading.size(); ++k) {
      result.loading[k] += one.loading[k] / static_cast<double>(near.size());
    }
  }
  return result;
}

}  // namespace

TargetPoints::TargetPoints(const std::vector<StationTarget>& targets)
    : targets_(targets), near_(targets.size()) {}
TargetPoints::~TargetPoints() = default;

std::unique_ptr<CloudWriter> TargetPoints::sink() { return std::make_unique<Sink>(*this); }

std::vector<MeasuredTarget> TargetPoints::measured() const {
  std::vector<MeasuredTarget> result;
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    const StationTarget& target = targets_[t];
    if (near_[t].empty()) {
      throw InvalidArgument(
          fmt::format("target {}: no point of the scan within {:.2f} m of in_scan_m = [{:.3f}, "
                      "{:.3f}, {:.3f}], "
                      "which is in the frame of the sensor as this calibration has it",
                      target.name, reach_of(target), target.in_scan.x(), target.in_scan.y(),
                      target.in_scan.z()));
    }
    result.push_back(target.radius ? fit_sphere(target, near_[t]) : picked(target, near_[t]));
  }
  return result;
}

namespace {

[[noreturn]] void refuse_line() {
  throw InvalidArgument(
      fmt::format("the targets do not determine the pose of the scan, its rotation not even to "
                  "{:g} degrees: they are on one line or too close together",
                  degrees_from_radians(kLeastTold)));
}

}  // namespace

AdjustedStation adjust_station(const std::vector<StationTarget>& targets,
                               std::span<const MeasuredTarget> measured, const MapProjection* map) {
  require_length("measured", measured.size(), targets.size());
  require_at_least("number of targets", std::ssize(targets), 3);
  const Index n = std::ssize(targets), rows = 3 * n;
  AdjustedStation result;
  StandingPose& pose = result.pose;
  pose.frame = map == nullptr ? trajectories::Frame::local : trajectories::Frame::geocentric;

  // Places in the frame, less their middle, for numerical precision; and the first guess.
  Eigen::Matrix3Xd places(3, n), seen(3, n);
  for (Index t = 0; t < n; ++t) {
    places.col(t) = map == nullptr ? targets[t].place : map->unproject(targets[t].place);
    seen.col(t) = measured[t].at;
  }
  const Vector3d middle = places.rowwise().mean();
  places.colwise() -= middle;
  const Eigen::Matrix4d first = Eigen::umeyama(seen, places, false);
  pose.turn = first.topLeftCorner<3, 3>();
  Vector3d position = first.topRightCorner<3, 1>();
  const Matrix3d axes = map_axes(map, middle);

  const std::size_t factors = measured.front().loading.size();
  MatrixXd loading(rows, factors);
  for (Index t = 0; t < n; ++t) {
    require_length("loading", measured[t].loading.size(), factors);
    for (std::size_t k = 0; k < factors; ++k) {
      loading.block<3, 1>(3 * t, static_cast<Index>(k)) = measured[t].loading[k];
    }
  }
  MatrixXd design(rows, 6), own = MatrixXd::Zero(rows, rows), gain;
  VectorXd off(rows);
  MatrixXd variance;
  for (int step = 0;; ++step) {
    for (Index t = 0; t < n; ++t) {
      const Vector3d& p = measured[t].at;
      off.segment<3>(3 * t) = pose.turn.transpose() * (places.col(t) - position) - p;
      design.block<3, 3>(3 * t, 0) = -algebra::cross_matrix(p);
      design.block<3, 3>(3 * t, 3).setIdentity();
      const Matrix3d to_sensor = pose.turn.transpose() * axes;
      own.block<3, 3>(3 * t, 3 * t) =
          measured[t].own +
          to_sensor * targets[t].sigma.cwiseAbs2().asDiagonal() * to_sensor.transpose();
    }
    variance = own + loading * loading.transpose();
    const algebra::SymmetricSolver weights(variance);
    const MatrixXd weighted = weights.solve_columns(design);  // V^-1 A
    const algebra::SymmetricSolver normal(MatrixXd(design.transpose() * weighted));
    if (!normal.positive()) refuse_line();
    const VectorXd change = normal.solve(weighted.transpose() * off);
    position += pose.turn * change.tail<3>();
    pose.turn = pose.turn * algebra::rotation_by(change.head<3>()).toRotationMatrix();
    if (change.norm() > 1e-10 && step < kSteps) continue;
    gain = normal.solve_columns(weighted.transpose());
    off -= design * change;
    result.chi2 = weights.chi2(off);
    break;
  }
  pose.position = middle + position;
  pose.covariance = gain * own * gain.transpose();
  pose.response = -gain * loading;
  result.of_places.resize(6, rows);
  for (Index t = 0; t < n; ++t) {
    result.of_places.middleCols<3>(3 * t) =
        gain.middleCols<3>(3 * t) * pose.turn.transpose() * axes * targets[t].sigma.asDiagonal();
  }
  // Only the rotation, ignoring the sensor's own errors.
  const double told = std::sqrt(
      algebra::principal_axes(pose.covariance.topLeftCorner<3, 3>()).values.tail<1>().value());
  if (!(told < kLeastTold)) refuse_line();
  result.degrees_of_freedom = static_cast<int>(rows) - 6;
  result.p_value = algebra::chi_square_tail(result.chi2, result.degrees_of_freedom);
  const MatrixXd left = variance - design * gain * variance;  // covariance of the residuals
  double worst = -1;
  for (Index t = 0; t < n; ++t) {
    const Vector3d residual = off.segment<3>(3 * t);
    result.residuals.push_back(-(axes.transpose() * pose.turn * residual));
    const Vector3d sigma2 = left.diagonal().segment<3>(3 * t);
    const double in_sigmas = (residual.cwiseAbs2().array() / sigma2.array().max(1e-12)).sum();
    if (in_sigmas <= worst) continue;
    worst = in_sigmas;
    result.worst = static_cast<std::size_t>(t);
  }
  return result;
}

std::string share_targets(std::span<const Station> stations,
                          std::span<std::optional<AdjustedStation>> adjusted) {
  require_length("adjusted", adjusted.size(), stations.size());
  // Each place once, in an order independent of the stations.
  using Key = std::tuple<std::string, std::array<double, 6>>;
  const auto key_of = [](const StationTarget& one) {
    return Key(one.name, {one.place.x(), one.place.y(), one.place.z(), one.sigma.x(), one.sigma.y(),
                          one.sigma.z()});
  };
  std::map<Key, Index> places;
  double largest = 0;
  Vector3d middle = Vector3d::Zero();
  for (std::size_t s = 0; s < stations.size(); ++s) {
    if (!adjusted[s]) continue;
    for (const StationTarget& one : stations[s].targets) {
      if (!places.emplace(key_of(one), 0).second) continue;
      largest = std::max(largest, one.sigma.maxCoeff());
      middle += one.place;
    }
  }
  if (places.empty() || largest == 0) return {};
  middle /= static_cast<double>(places.size());
  std::string words;
  // Common rotation and shift of all of them, weighted by their sigmas, in its own sigmas.
  const Index rows = 3 * std::ssize(places);
  MatrixXd turned(rows, 6);
  Index row = 0;
  for (auto& [key, at] : places) {
    const auto& [name, numbers] = key;
    const Eigen::Map<const Vector3d> place(numbers.data()), sigma(numbers.data() + 3);
    const Vector3d weight = sigma.cwiseMax(kLeastSigmaShare * largest).cwiseInverse();
    turned.block<3, 3>(row, 0) = weight.asDiagonal() * -algebra::cross_matrix(place - middle);
    turned.block<3, 3>(row, 3) = weight.asDiagonal();
    at = row;
    row += 3;
    words += fmt::format("{} {}\n", name, fmt::join(numbers, " "));
  }
  const Eigen::LLT<MatrixXd> root(MatrixXd(turned.transpose() * turned));
  if (root.info() != Eigen::Success || root.rcond() < kLeastTurning) return {};
  const MatrixXd together = root.matrixL().solve(turned.transpose());  // rows are orthonormal
  for (std::size_t s = 0; s < stations.size(); ++s) {
    if (!adjusted[s]) continue;
    StandingPose& pose = adjusted[s]->pose;
    pose.of_survey = MatrixXd::Zero(6, 6);
    const std::vector<StationTarget>& targets = stations[s].targets;
    for (std::size_t t = 0; t < targets.size(); ++t) {
      pose.of_survey += adjusted[s]->of_places.middleCols<3>(3 * static_cast<Index>(t)) *
                        together.middleCols<3>(places.at(key_of(targets[t]))).transpose();
    }
    pose.covariance -= pose.of_survey * pose.of_survey.transpose();
  }
  return words;
}

}  // namespace risley::cloud
