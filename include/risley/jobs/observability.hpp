// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/core/warning.hpp"
#include "risley/estimation/observability.hpp"
#include "risley/jobs/sensor_choice.hpp"
#include "risley/recordings/reader.hpp"

namespace risley::jobs {

/// The recording to judge, planned or real. SI units.
struct ObservabilityOptions {
  recordings::Source recording;       ///< empty: a plan is judged
  recordings::ReadOptions reading;    ///< of the recording
  GivenSensor sensor;                 ///< as given_sensor(); a plan takes kUsualSensor
  double duration = 30;               ///< of the plan, s
  std::optional<double> rate;         ///< shots per second; of a plan the sensor's, otherwise all
  std::optional<double> angle_noise;  ///< before rounding, rad; of a plan the sensor's
  bool rounding = true;               ///< a plan's angles are rounded to the sensor's resolution
  HeldParameters fixed;
  std::vector<std::string> additional;  ///< further parameters to free
};

/// What it can determine.
struct JudgedObservability {
  estimation::Observability observability;
  TrainShape shape;
  std::vector<std::string> words;  ///< the same in sentences
  std::vector<Warning> warnings;
  bool converged = true;  ///< the estimate of a recording
  std::string reason;     ///< why not
};

/// Judges how well a recording determines every parameter. Stages: reading, estimating.
/// @throws EstimationError, InvalidArgument, FileError, Cancelled
JudgedObservability judge_observability(const ObservabilityOptions& options,
                                        const Progress& progress = {});

}  // namespace risley::jobs
