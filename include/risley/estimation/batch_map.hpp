// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "risley/core/progress.hpp"
#include "risley/estimation/angle_noise.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/initialisation.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/rotor_states.hpp"
#include "risley/estimation/rotor_trajectory.hpp"

namespace risley::estimation {

/// Settings of the batch estimator.
struct BatchMapOptions {
  std::optional<AngleNoise> angle_noise;  ///< held; empty: found, one variance for each angle
  std::vector<FreeParameter> free;        ///< constants to estimate; may be empty
  /// 1 sigma of the turn that the series' frame may have against the sensor's about both axes
  /// across the beam, rad; 0: none
  double frame_sigma = 0;
  /// Motion model of the rotors [prisms]; empty chooses it by maximum likelihood.
  std::vector<RotorProcess> rotor_process;
  double knot_interval = kKnotInterval;  ///< s
  /// Shots with more chi2 (2 degrees of freedom) than this are outliers: 1 good one in 22,000.
  double outlier_chi2 = 20.0;
  int most_iterations = 40;  ///< of the coarse pass
};

/// The most probable parameters and trajectory.
struct BatchMapResult {
  Eigen::VectorXd parameters;   ///< [free], SI units
  Eigen::MatrixXd covariance;   ///< [free, free], variance factor included
  Eigen::MatrixXd information;  ///< [constants], of the data alone, variance factor included
  PrismTrain train;             ///< with the estimated parameters
  /// Turn of the series' frame against the sensor's: residuals and angles are those of the series
  /// turned back by it. Identity unless a frame_sigma was given.
  Eigen::Matrix3d frame = Eigen::Matrix3d::Identity();
  Eigen::Matrix2d frame_covariance = Eigen::Matrix2d::Zero();  ///< turns about Z and Y, rad^2
  NoiseEstimate noise;                                         ///< sigma 0 where it was held
  /// Parameters, frame: what the data alone tell of both together [free + 2 or 0].
  std::vector<FreeParameter> constants;
  RotorTrajectory trajectory;  ///< with covariances
  /// How the rotation angles follow the parameters, mean over the recording [prisms, free]: an
  /// error of the parameters moves all angles of a rotor by nearly the same.
  Eigen::MatrixXd angle_sensitivity;
  /// What all shots together tell of a shift that all angles of a rotor share, at given parameters
  /// [prisms, prisms], rad^-2: its inverse is the covariance of the mean errors of the angles.
  Eigen::MatrixXd angle_information;
  std::vector<RotorProcess> rotor_process;
  std::vector<double> azimuth_residual,
      zenith_residual;                 ///< [shots], rad; NaN for unused stretches
  std::vector<unsigned char> outlier;  ///< [shots]
  std::size_t outliers = 0;
  std::size_t unused_shots = 0;     ///< in stretches too short to find their rotors' phases
  std::size_t iterations = 0;       ///< of both passes together
  bool settled = false;             ///< the last step was a tenth of a sigma or less
  Autocorrelation autocorrelation;  ///< of the residuals
  /// Mean square of residuals over stated variances, outliers left out.
  double unit_variance = 0;
  /// By how much the stated variances of single shots were enlarged: autocorrelation times excess.
  double variance_factor = 1;
};

/// Maximum a posteriori estimate of the constant parameters and of the rotors' motion from all
/// shots at once: Gauss-Newton over the whole trajectory with parameters that have no process
/// noise, first on shots thinned to 1 kHz with weights that gross errors cannot bend, then on all
/// of them, where one or two steps remain. At the end a hard cut decides on outliers, and the
/// covariance is that of shots with the autocorrelation and the scatter that the residuals show.
/// [B21 section 2.4 states the model; the method departs from it: docs/theory/map.md]
/// @param series  as it is to be used: prepare_shots()
/// @param start   of the first stretch
/// @throws EstimationError when there is nothing to estimate from; InvalidArgument
BatchMapResult run_batch_map(const AngleSeries& series, const Start& start,
                             const sensors::Sensor& sensor, const BatchMapOptions& options,
                             const Progress& progress = {});

/// Rotor states of shots [begin, end) of the series that a result was estimated from.
RotorStates states_of_shots(const BatchMapResult& result, const AngleSeries& series,
                            ShotRange shots);

/// Rotor states of one shot per knot, the one nearest to it.
RotorStates states_of_knots(const BatchMapResult& result, const AngleSeries& series);

}  // namespace risley::estimation
