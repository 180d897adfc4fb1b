// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "risley/estimation/emitter_comparison.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/weak_directions.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// A planned or real recording.
struct ObservabilityPlan {
  sensors::Sensor sensor;
  double duration = 30;             ///< s
  double rate = 100000;             ///< shots per second
  double angle_noise = 0;           ///< 1 sigma of azimuth and zenith before rounding, rad
  double angle_resolution = 0;      ///< rounding step, rad; 0: none
  std::vector<FreeParameter> free;  ///< what the bounds are for
  /// Motion model [prisms]; empty uses kTypicalRotor.
  std::vector<RotorProcess> rotor_process;
};

/// Effect of one quantity on the observations, and their information on it. SI units.
struct QuantityObservability {
  std::string name;   ///< as in parameter_list()
  bool free = false;  ///< among the free ones; rotation angles and speeds always are
  /// Root mean square change of azimuth and zenith together per change of this parameter alone, rad
  /// per unit. A speed turns the prism about the middle of the recording.
  double sensitivity = 0;
  /// Cramer-Rao bound with the free quantities, and with this one too when it is not among them;
  /// infinite if no data of the kind determine it. Rotation angles and speeds: in the middle.
  double sigma = 0;
  /// Its correlations with those: the strongest, and others beyond 0.98, strongest first.
  std::vector<std::pair<std::string, double>> twins;
};

/// Section 2.3 of the paper for any sensor, plan and recording.
struct Observability {
  std::vector<QuantityObservability> quantities;  ///< all of the prisms, then angles, then speeds
  /// Correlation of everything in quantities with all of the prisms' parameters free, under their
  /// wide priors (1 degree, 0.01 of an index).
  std::vector<std::string> correlation_names;
  Eigen::MatrixXd correlation;
  /// With all of the prisms' parameters free: combinations that keep their prior sigma or more.
  std::vector<WeakDirection> unobservable;
  double shots = 0, duration = 0, rate = 0;
  EmitterComparison emitters;  ///< without bounds if fewer than two fire
};

/// Cramer-Rao bounds of a plan: the information of prisms that turn at the sensor's speeds under
/// the plan's motion model. Information grows with the number of shots, so large plans are
/// evaluated with fewer shots of higher weight, and beyond 2,000 s with less time.
/// @throws InvalidArgument for a plan without duration, rate or noise; Cancelled
Observability observability_of_plan(const ObservabilityPlan& plan, const Progress& progress = {});

/// The same for an estimated recording: its own shots, gaps, outliers and rotors.
/// @throws Cancelled
Observability observability_of_estimate(const Estimate& estimate, const Progress& progress = {});

/// Advice in sentences: which parameters to hold, what each is correlated with, and how long a
/// recording would have to be to determine them.
std::vector<std::string> observability_words(const Observability& observability, TrainShape shape);

}  // namespace risley::estimation
