// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/trajectories/trajectory.hpp"

namespace risley::trajectories {

/// Errors of a pose, in this order: of the position along north, east and up, m; rotations of the
/// body about north, about east and about down, rad. In a local frame north is y and east is x.
enum class PoseError : std::uint8_t { north, east, up, tilt_north, tilt_east, heading };
/// Number of errors of a pose.
inline constexpr std::size_t kPoseErrors = 6;

/// One value per error of a pose, in the order of PoseError.
using PoseErrorVector = Eigen::Matrix<double, 6, 1>;
/// A covariance of the errors of a pose, rows and columns in the order of PoseError.
using PoseErrorMatrix = Eigen::Matrix<double, 6, 6>;

/// Model of one error: a Gauss-Markov process, whose correlation falls by e within the correlation
/// time, and a white part, which is constant within each sample of the trajectory.
struct ErrorTerm {
  std::optional<double> sigma;  ///< m or rad; without it the accuracies of the trajectory apply
  double correlation_time = 0;  ///< s, above 0
  double white = 0;             ///< sigma of the white part, m or rad
  std::string source;
};

/// Model of all errors.
struct ErrorModel {
  std::array<ErrorTerm, kPoseErrors> terms;  ///< by PoseError
  double sample_interval = 0;                ///< of the white parts, s; above 0 where there are any
};

/// Default correlation times of trajectories: 120 s for positions and tilts,
/// 300 s for the heading, as assumptions. No program writes them into its trajectories.
ErrorModel assumed_error_model();

/// Reads
///
///     risley_trajectory_errors: 1
///     sample_interval_s: 0.005               # where there are white parts
///     north_m:        {sigma: 0.02, correlation_time_s: 120, source: data sheet}
///     east_m:         ...
///     up_m:           ...
///     tilt_north_deg: {sigma: 0.025, correlation_time_s: 120, white: 0.005, source: data sheet}
///     tilt_east_deg:  ...
///     heading_deg:    {correlation_time_s: 300, source: assumed}
///
/// Without a sigma the accuracies of the trajectory apply. Without white there is none.
/// @param path  for messages only
/// @throws FileError with the line for anything else
ErrorModel parse_error_model(const std::string& text, const std::string& path);

/// parse_error_model of a file. @throws FileError
ErrorModel load_error_model(const std::string& path);

/// @throws InvalidArgument for sigmas below 0, correlation times not above 0, white parts without a
/// sample interval and non-finite values
void require_error_model(const ErrorModel& model);

/// Covariances of the errors of a trajectory at any two times:
///
///     K(t, u) = s(t) s(u) exp(-|t - u| / correlation time) + [same sample] white^2
///
/// for each of the six errors, which are independent of each other. s is the stated sigma, or that
/// of the trajectory's accuracies, between their records linear and constant beyond the ends. Their
/// roll and pitch become tilts about north and east by the heading; the resulting correlation
/// between the two if roll and pitch differ is dropped. docs/theory/trajectories.md
class ErrorProcess {
 public:
  /// @throws InvalidArgument as require_error_model and require_trajectory, and if a sigma is
  /// neither stated nor in the trajectory
  ErrorProcess(const ErrorModel& model, const Trajectory& trajectory);

  /// The same process with its Gauss-Markov parts scaled.
  /// @param factors  [6], above 0 @throws InvalidArgument for others
  ErrorProcess scaled(const PoseErrorVector& factors) const;

  /// Standard deviations of the Gauss-Markov parts at a time [6].
  PoseErrorVector sigmas(std::int64_t time_ns) const;
  /// Standard deviations of the white parts [6].
  const PoseErrorVector& white() const { return white_; }
  /// Duration for which white errors stay the same, s; 0 if there are none.
  double sample_interval() const { return 1e-9 * static_cast<double>(sample_ns_); }
  /// Correlation times, s [6].
  const PoseErrorVector& correlation_times() const { return correlation_times_; }
  /// Number of the trajectory's sample at a time, which has its own white errors; 0 everywhere if
  /// there are no white parts.
  std::int64_t sample(std::int64_t time_ns) const;

  /// Covariance [6, 6] between the errors at two times.
  PoseErrorMatrix covariance(std::int64_t time_ns, std::int64_t other_ns) const;
  /// Covariance [6, 6] at one time.
  PoseErrorMatrix covariance(std::int64_t time_ns) const { return covariance(time_ns, time_ns); }

 private:
  std::vector<std::int64_t> time_ns_;    ///< of the sigmas; empty if all are stated
  std::vector<PoseErrorVector> sigmas_;  ///< of these times; one if all are stated
  PoseErrorVector correlation_times_, white_;
  std::int64_t first_ns_ = 0, sample_ns_ = 0;
};

}  // namespace risley::trajectories
