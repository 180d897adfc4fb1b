// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/observability.hpp"

#include <utility>

#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/recording_input.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/checks.hpp"

namespace risley::jobs {
namespace {

/// Common to both kinds.
estimation::EstimateOptions settings_of(const ObservabilityOptions& options,
                                        sensors::Sensor sensor) {
  estimation::EstimateOptions result;
  result.sensor = std::move(sensor);
  result.angle_noise = options.angle_noise;
  result.fixed = hold(options.fixed, result.sensor);
  result.additional = options.additional;
  return result;
}

estimation::Observability of_plan(const ObservabilityOptions& options,
                                  const estimation::EstimateOptions& settings,
                                  const Progress& progress) {
  estimation::ObservabilityPlan plan;
  plan.sensor = settings.sensor;
  plan.duration = options.duration;
  plan.rate = options.rate.value_or(plan.sensor.shot_rate);
  plan.angle_noise = settings.angle_noise.value_or(plan.sensor.angle_noise);
  if (options.rounding) plan.angle_resolution = plan.sensor.angle_resolution;
  plan.free = estimation::chosen_parameters(settings);
  return estimation::observability_of_plan(plan, progress);
}

}  // namespace

JudgedObservability judge_observability(const ObservabilityOptions& options,
                                        const Progress& progress) {
  require_positive(kSetting.duration, options.duration);
  if (options.rate) require_positive(kSetting.rate, *options.rate);
  if (options.angle_noise) require_positive(kSetting.noise_angle, *options.angle_noise);
  progress.check();
  JudgedObservability result;
  if (options.recording.empty()) {
    const estimation::EstimateOptions settings = settings_of(
        options, load_result(options.sensor.empty() ? GivenSensor(kUsualSensor) : options.sensor));
    result.shape = settings.sensor.shape();
    result.observability = of_plan(options, settings, progress.silent());
  } else {
    EstimationInput input =
        read_for_estimation({options.recording,
                             options.reading,
                             options.sensor,
                             {.rate = options.rate, .ranges = false, .rows = false}},
                            progress.stage("reading"));
    estimation::EstimateOptions settings = settings_of(options, input.choice.sensor);
    settings.cartesian = input.whole_steps;
    result.shape = settings.sensor.shape();
    const Progress estimating = progress.stage("estimating");
    const estimation::Estimate estimate =
        estimation::estimate(estimation::Method::map, std::move(input.series), input.head, settings,
                             estimating, std::move(input.found));
    result.warnings = std::move(input.warnings);
    append(result.warnings, estimate.warnings);
    result.converged = estimate.converged;
    result.reason = estimate.reason;
    result.observability = estimation::observability_of_estimate(estimate, progress.silent());
  }
  result.words = estimation::observability_words(result.observability, result.shape);
  return result;
}

}  // namespace risley::jobs
