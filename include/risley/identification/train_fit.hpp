// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "risley/core/progress.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/identification/rotor_curves.hpp"
#include "risley/identification/shot_grid.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley::identification {

/// Optics and motion that predict every shot of a grid.
struct TrainModel {
  PrismTrain train;             ///< one emitter for each of the grid's
  std::vector<double> lag;      ///< [emitters], s: delay at which its shots see the rotors
  estimation::FrameTurn frame;  ///< of the recording
  RotorCurves rotors;
};

/// Unknowns in addition to the rotors' motion.
struct TrainFreedom {
  bool glass = false;      ///< indices and deviations of the prisms, angles of faces and mirrors
  bool one_glass = false;  ///< all indices are the same
  bool emitters = false;   ///< directions of all emitters
  bool lags = false;       ///< of all emitters but the first
  bool frame = false;      ///< yaw and pitch
  bool tilts = false;      ///< of prisms and bearings, with a prior of 0.3 degree

  friend bool operator==(const TrainFreedom&, const TrainFreedom&) = default;
};

/// A train and its motion as fitted to the shots of a grid, and the quality of the fit.
struct TrainFit {
  TrainModel model;
  double rms = 0;         ///< of azimuth and zenith together, rad; infinite if nothing fits
  std::size_t shots = 0;  ///< that count
  std::size_t outliers = 0;
  std::size_t unknowns = 0;
  /// Of the values below, variance of the shots from their rms; independent shots.
  std::vector<std::string> names;  ///< as in parameter_list(), and "lag_2_s", "frame_yaw_deg"
  /// SI units: the free parameters of optics, lags and frame; rotation angles where the curves
  /// begin, and their mean speeds. Infinite variances if nothing determines them.
  Eigen::MatrixXd covariance;
  std::vector<double> azimuth_residual, zenith_residual;  ///< [shots], observed minus predicted
};

/// Convergence and other settings of a fit.
struct TrainFitOptions {
  int iterations = 30;
  double tolerance = 1e-7;  ///< a step that gains a smaller share of the sum of squares is the last
  bool without_outliers = false;  ///< they are rejected after convergence: outlier_limit()
  bool covariance = false;
};

/// Least squares of azimuths and zeniths: Gauss and Newton's steps, damped by Levenberg and
/// Marquardt. Indices move at a held deviation (n - 1) wedge, which data determine much better than
/// either, and stay within 1.3 and 2.3. docs/theory/identify.md
/// @param start  with as many emitters as the grid
TrainFit fit_train(const ShotGrid& grid, const TrainModel& start, const TrainFreedom& freedom,
                   const TrainFitOptions& options = {}, const Progress& progress = {});

/// Residuals beyond this are not noise, rad: 6 robust sigmas, from the quantiles of half of the
/// shots and of 95 % of them.
double outlier_limit(const TrainFit& fit);

/// Of all residuals, including outliers, each limited to this value, rad^2.
double mean_square(const TrainFit& fit, double limit);

/// A model's prediction for every shot of a grid, instead of the observation.
ShotGrid predicted(const ShotGrid& grid, const TrainModel& model);

}  // namespace risley::identification
