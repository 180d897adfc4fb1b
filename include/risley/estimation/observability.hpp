// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/core/progress.hpp"
#include "risley/estimation/angle_series.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// A combination of parameters that data do not tell.
struct WeakDirection {
  /// Parameters by name, each in its prior sigmas (1 degree, 0.01 in an index), as a unit vector;
  /// weights below 0.05 are left out. The largest is positive.
  std::vector<std::pair<std::string, double>> weights;
  double ratio = 0;  ///< its singular value over the largest one
  double sigma = 0;  ///< of the combination after the data, in prior sigmas
};

/// Singular values of what data say of the parameters, each scaled by its prior sigma: the
/// directions that stay wider than most_sigma prior sigmas.
/// @param information  [free, free], of the data alone, rotors eliminated
std::vector<WeakDirection> weak_directions(const Eigen::MatrixXd& information,
                                           const std::vector<FreeParameter>& free,
                                           double most_sigma);

/// "0.71 refractive_index_air - 0.70 refractive_index"
std::string direction_text(const WeakDirection& direction);

/// A recording that need not exist yet.
struct ObservabilityPlan {
  sensors::Sensor sensor;
  double duration = 30;     ///< s
  double rate = 100000;     ///< shots per second
  double angle_noise = 0;   ///< 1 sigma of azimuth and zenith, rad
  double angle_resolution = 0;  ///< rounding step, rad; 0: none
  std::vector<FreeParameter> free;  ///< what the bounds are for
  /// Motion model; empty takes rotors like those that the paper saw (Fig. 9).
  std::vector<RotorProcess> rotor_process;
};

/// What one parameter means to the observations and what they mean to it.
struct ParameterObservability {
  std::string name;
  bool free = false;  ///< among the free ones of the plan
  /// Root mean square change of azimuth and zenith together for a change of the parameter alone,
  /// rad per SI unit.
  double sensitivity = 0;
  /// Cramer-Rao bound, SI units: with the free parameters, and this one too when it is not among
  /// them. Infinite where the data cannot tell.
  double sigma = 0;
  /// What it is mixed up with, by name, and the correlation: the strongest one, rotation angles and
  /// speeds included.
  std::string twin;
  double twin_correlation = 0;
};

/// Section 2.3 of the paper for any plan, sensor and recording.
struct Observability {
  std::vector<ParameterObservability> parameters;  ///< of the prisms, shared names
  /// Joint correlation of the free parameters, then of each rotor's angle and speed in the middle
  /// of the recording.
  std::vector<std::string> correlation_names;
  Eigen::MatrixXd correlation;
  /// With every parameter of the prisms free: combinations that no data of this plan tell.
  std::vector<WeakDirection> unobservable;
  double observations = 0;  ///< shots
  std::vector<std::string> words;  ///< for people: what to hold fixed, and what it would take
};

/// Cramer-Rao bounds of a plan: the information of constantly turning prisms with the plan's motion
/// model, on a quarter of a second or so and scaled up where that is exact enough.
Observability observability_of_plan(const ObservabilityPlan& plan, const Progress& progress = {});

}  // namespace risley::estimation
