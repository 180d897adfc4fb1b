// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/cloud/cloud_writer.hpp"
#include "risley/cloud/station.hpp"

namespace risley::cloud {

/// Where a target is in a scan.
struct MeasuredTarget {
  Eigen::Vector3d at{0, 0, 0};                    ///< frame of the sensor, m
  Eigen::Matrix3d own = Eigen::Matrix3d::Zero();  ///< covariance that no factor explains, m^2
  std::vector<Eigen::Vector3d> loading;           ///< of each common factor of the points, m
  std::size_t points = 0;                         ///< of the scan that determine it
};

/// Finds the targets of a station in its points as they are made: a CloudWriter that keeps the
/// points near them.
class TargetPoints {
 public:
  /// @param targets  must outlive this
  explicit TargetPoints(const std::vector<StationTarget>& targets);
  ~TargetPoints();
  TargetPoints(const TargetPoints&) = delete;
  TargetPoints& operator=(const TargetPoints&) = delete;

  /// Takes points of the sensor's frame with their own covariance and the loadings of the common
  /// factors. This must outlive it.
  std::unique_ptr<CloudWriter> sink();

  /// Their positions in the scan: picked points as given, with the loadings of the points about
  /// them; spheres at the best fit to the ranges of points that meet them.
  /// @throws InvalidArgument naming a target without points near it, and a sphere that its points
  /// do not fit
  std::vector<MeasuredTarget> measured() const;

 private:
  struct Near;
  class Sink;
  const std::vector<StationTarget>& targets_;
  std::vector<std::vector<Near>> near_;  ///< of each target
};

/// What targets say of a station.
struct AdjustedStation {
  StandingPose pose;
  /// Misfit of each target: adjusted position in the scan less known position, along east, north
  /// and up, m.
  std::vector<Eigen::Vector3d> residuals;
  double chi2 = 0;             ///< of the residuals with all their common errors
  int degrees_of_freedom = 0;  ///< of it
  double p_value = 1;          ///< probability of a chi2 at least as large
  std::size_t worst = 0;       ///< the target with the largest residual in sigmas
  /// Effect of one standard deviation of each target's place along east, north and up on the pose,
  /// which its covariance includes: [6, 3 targets].
  Eigen::MatrixXd of_places;
};

/// The pose that fits the targets best, as a rigid motion: weights include the errors of the
/// targets' places, of their positions in the scan and of the sensor's common factors.
/// @param measured  of each target  @param map  of the places; nullptr: none
/// @throws InvalidArgument for fewer than three targets, targets on one line, and where the map has
///         no such places
AdjustedStation adjust_station(const std::vector<StationTarget>& targets,
                               std::span<const MeasuredTarget> measured, const MapProjection* map);

/// A survey's stations with the same targets share the errors of these: the part that turns and
/// shifts all targets together is moved from the covariances of the poses into their six errors
/// of_survey, the same ones in every survey with the same places. The remaining errors of the
/// places count as each station's own. Targets are the same if name, place and sigmas are.
/// @param adjusted  of each station; empty if the pose is stated
/// @return the targets as text, equal to that of another survey with the same errors; empty if no
/// errors are shared: no targets, all of them exact, or on one line
std::string share_targets(std::span<const Station> stations,
                          std::span<std::optional<AdjustedStation>> adjusted);

}  // namespace risley::cloud
