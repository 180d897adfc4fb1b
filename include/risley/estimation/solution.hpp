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

/// Errors that all rotation angles of a rotor share.
struct CommonAngleErrors {
  /// How the rotation angles follow the parameters, mean over the recording [prisms, free]: an
  /// error of the parameters moves all angles of a rotor by nearly the same.
  Eigen::MatrixXd sensitivity;
  /// What all shots together say about a shift of all angles, at given parameters [prisms, prisms],
  /// rad^-2: its inverse is the covariance of the mean errors of the angles.
  Eigen::MatrixXd information;
};

/// What an estimator found: constants, the rotors' motion, and how well the shots fit them.
struct Solution {
  Eigen::VectorXd parameters;  ///< [free], SI units
  Eigen::MatrixXd covariance;  ///< [free, free], variance factor included
  PrismTrain train;            ///< with the estimated parameters
  std::vector<RotorProcess> rotor_process;
  /// With covariances. A knot serves as many shots as its estimator takes together, one at least.
  RotorTrajectory trajectory;

  std::vector<unsigned char> outlier;  ///< [shots], not 0 where the shot was left out
  /// Residuals [shots] of a filter, whose parameters may wander; empty where those of the solution
  /// leave them, see residuals_of_shots().
  std::vector<double> azimuth_residual, zenith_residual;
  std::size_t outliers = 0;
  std::size_t unused_shots = 0;  ///< in stretches too short to find their rotors' phases
  /// Mean square of residuals over stated variances, outliers left out.
  double unit_variance = 0;
  Autocorrelation autocorrelation;  ///< of the residuals
  /// By how much the stated variances of single shots were enlarged.
  double variance_factor = 1;
  std::size_t iterations = 0;
  bool settled = false;  ///< the last step was a tenth of a sigma or less

  NoiseEstimate noise;  ///< of the angles before rounding; sigma 0 where it was held
  /// Turn of the series' frame against the sensor's: residuals and angles are those of the series
  /// turned back by it. Identity unless it was free.
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
  Eigen::Matrix2d frame_covariance = Eigen::Matrix2d::Zero();  ///< turns about Z and Y, rad^2
  /// Parameters, frame: what the data alone say about both together, variance factor included.
  /// Empty where the estimator does not separate data from prior.
  std::vector<FreeParameter> constants;
  Eigen::MatrixXd information;  ///< [constants, constants]
  /// What the angles of a rotor have in common, if the estimator provides it.
  std::optional<CommonAngleErrors> common_angles;
};

/// Residuals of shots: observed minus estimated, rad; NaN in stretches that were not used.
struct ShotResiduals {
  std::vector<double> azimuth, zenith;
};

/// Residuals of shots [begin, end) of the series that a solution is of, turned back by its frame.
/// @throws InvalidArgument for rows that are not there
ShotResiduals residuals_of_shots(const Solution& solution, const PackedSeries& series,
                                 ShotRange shots);

/// Rotor states of such shots; NaN for shots of stretches that were not used.
/// @throws InvalidArgument for rows that are not there
RotorStates states_of_shots(const Solution& solution, const PackedSeries& series, ShotRange shots);

/// Rotor states of one shot per knot, the one nearest to it.
RotorStates states_of_knots(const Solution& solution, const PackedSeries& series);

}  // namespace risley::estimation
