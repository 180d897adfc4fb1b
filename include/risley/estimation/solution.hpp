// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/angle_noise.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/packed_series.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/rotor_states.hpp"
#include "risley/estimation/rotor_trajectory.hpp"

namespace risley::estimation {

/// Errors common to all rotation angles of a rotor.
struct CommonAngleErrors {
  /// Derivatives of the rotation angles by the parameters, mean over the recording [prisms, free]:
  /// an error of the parameters moves all angles of a rotor by nearly the same.
  Eigen::MatrixXd sensitivity;
  /// Information of all shots together on a shift of all angles, at given parameters [prisms,
  /// prisms], rad^-2: its inverse is the covariance of the mean errors of the angles.
  Eigen::MatrixXd information;
};

/// Result of an estimator: constants, the rotors' motion, and the fit of the shots.
struct Solution {
  Eigen::VectorXd parameters;  ///< [free], SI units
  Eigen::MatrixXd covariance;  ///< [free, free], variance factor included
  PrismTrain train;            ///< with the estimated parameters
  std::vector<RotorProcess> rotor_process;
  /// With covariances. A knot covers as many shots as its estimator combines, at least one.
  RotorTrajectory trajectory;

  std::vector<unsigned char> outlier;  ///< [shots], not 0 if the shot was rejected
  /// Residuals [shots] of a filter, whose parameters may wander; empty if they follow from the
  /// solution, see residuals_of_shots().
  std::vector<double> azimuth_residual, zenith_residual;
  std::size_t outliers = 0;
  std::size_t unused_shots = 0;  ///< in stretches too short to find their rotors' phases
  /// Mean square of residuals over stated variances, without outliers.
  double unit_variance = 0;
  Autocorrelation autocorrelation;  ///< of the residuals
  /// Factor by which the stated variances of single shots were enlarged.
  double variance_factor = 1;
  std::size_t iterations = 0;
  bool settled = false;  ///< the last step was a tenth of a sigma or less

  NoiseEstimate noise;  ///< of the angles before rounding; sigma 0 if it was held
  /// Turn of the series' frame against the sensor's: residuals and angles are those of the series
  /// turned back by it. Identity unless it was free.
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
  Eigen::Matrix2d frame_covariance = Eigen::Matrix2d::Zero();  ///< turns about Z and Y, rad^2
  /// Parameters, frame: information of the data alone on both, variance factor included. Empty if
  /// the estimator does not separate data from prior.
  std::vector<FreeParameter> constants;
  Eigen::MatrixXd information;  ///< [constants, constants]
  /// Common errors of a rotor's angles, if the estimator provides them.
  std::optional<CommonAngleErrors> common_angles;
};

/// Residuals of shots: observed minus estimated, rad; NaN in stretches that were not used.
struct ShotResiduals {
  std::vector<double> azimuth, zenith;
};

/// Residuals of shots [begin, end) of a solution's series, turned back by its frame.
/// @throws InvalidArgument for rows that do not exist
ShotResiduals residuals_of_shots(const Solution& solution, const PackedSeries& series,
                                 ShotRange shots);

/// Rotor states of such shots; NaN for shots of stretches that were not used.
/// @throws InvalidArgument for rows that do not exist
RotorStates states_of_shots(const Solution& solution, const PackedSeries& series, ShotRange shots);

/// Rotor states of one shot per knot, the one nearest to it.
RotorStates states_of_knots(const Solution& solution, const PackedSeries& series);

}  // namespace risley::estimation
