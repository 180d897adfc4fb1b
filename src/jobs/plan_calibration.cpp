// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/plan_calibration.hpp"

#include "risley/core/setting.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/sensors/preset.hpp"

#include "jobs/checks.hpp"

namespace risley::jobs {

PlannedCalibration plan_calibration(const PlanCalibrationOptions& options,
                                    const Progress& progress) {
  require_positive(kSetting.duration, options.duration);
  if (options.rate) require_positive(kSetting.rate, *options.rate);
  if (options.range_noise) require_positive(kSetting.noise_range, *options.range_noise);
  if (options.prior_sigma) require_positive(kSetting.prior_sigma, *options.prior_sigma);
  require_not_negative(kSetting.range_offset_sigma, options.range_offset_sigma);
  calibration::CalibrationPlan plan;
  plan.scene = options.scene;
  plan.sensor = load_result(options.sensor.empty() ? GivenSensor(kUsualSensor) : options.sensor);
  plan.fixed = hold(options.fixed, plan.sensor);
  plan.additional = options.additional;
  plan.duration = options.duration;
  plan.rate = options.rate;
  plan.range_noise = options.range_noise;
  plan.prior_sigma = options.prior_sigma;
  plan.range_offset_sigma = options.range_offset_sigma;
  if (options.flat_walls) plan.shape = {};
  plan.beam_origin = options.beam_origin;
  return {plan.sensor.name, plan.sensor.shape(), calibration::forecast(plan, progress)};
}

}  // namespace risley::jobs
