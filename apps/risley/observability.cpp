// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/estimation/observability.hpp"

#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/sensors/preset.hpp"

#include "command.hpp"
#include "estimation_input.hpp"
#include "observability_text.hpp"
#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using estimation::Observability;

struct ObservabilityCommandOptions {
  std::string input, sensor;
  double duration_s = 30;
  std::string rate_hz;
  std::optional<double> noise_angle_deg;
  bool rounding = true;
  std::vector<std::string> fixed, freed;
  ReadingWishes reading;
};

Json observability_json(const Observability& o, const TrainShape& shape) {
  Json parameters = Json::object(), matrix = Json::array(), unobservable = Json::array();
  for (const auto& quantity : o.quantities) {
    const double unit = find_parameter(quantity.name, shape).si_per_unit;
    Json one = {{"sigma", nullptr},
                {"sensitivity", degrees_from_radians(quantity.sensitivity) * unit},
                {"free", quantity.free},
                {"most_correlated", quantity.twins.front().first},
                {"correlation", quantity.twins.front().second}};
    if (std::isfinite(quantity.sigma)) one["sigma"] = quantity.sigma / unit;
    parameters[quantity.name] = one;
  }
  for (Eigen::Index i = 0; i < o.correlation.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < o.correlation.cols(); ++j) row.push_back(o.correlation(i, j));
    matrix.push_back(row);
  }
  for (const auto& weak : o.unobservable) unobservable.push_back(weak_direction_json(weak));
  return {{"parameters", parameters},
          {"correlation", {{"names", o.correlation_names}, {"matrix", matrix}}},
          {"unobservable", unobservable},
          {"observations", o.shots},
          {"duration_s", o.duration},
          {"rate_hz", o.rate},
          {"words", estimation::observability_words(o, shape)}};
}

void print_observability(const Observability& o, const TrainShape& shape) {
  fmt::print("{:.4g} s at {:.6g} Hz, {} shots\n\n", o.duration, o.rate,
             grouped(static_cast<std::uint64_t>(std::llround(o.shots))));
  Table table({"quantity", "sigma", "unit", "deg per unit", "most correlated with", "rho"});
  for (const auto& quantity : o.quantities) {
    const ParameterInfo& info = find_parameter(quantity.name, shape);
    const std::string sigma = std::isfinite(quantity.sigma)
                                  ? fmt::format("{:.2g}", quantity.sigma / info.si_per_unit)
                                  : "never";
    table.add({quantity.name, quantity.free ? sigma : fmt::format("({})", sigma), info.unit,
               fmt::format("{:.3g}", degrees_from_radians(quantity.sensitivity) * info.si_per_unit),
               quantity.twins.front().first, fmt::format("{:.4f}", quantity.twins.front().second)});
  }
  table.print();
  fmt::print(
      "\nsigma: Cramer-Rao bound. In brackets: held fixed by default; the bound if it were "
      "freed.\n");
  for (const auto& weak : o.unobservable) {
    fmt::print("not told by such data: {}\n", direction_text(weak));
  }
  for (const std::string& words : estimation::observability_words(o, shape)) {
    fmt::print("{}.\n", words);
  }
}

Observability observe_plan(const ObservabilityCommandOptions& options,
                           const estimation::EstimateOptions& settings) {
  estimation::ObservabilityPlan plan;
  plan.sensor = settings.sensor;
  plan.duration = options.duration_s;
  plan.rate = options.rate_hz.empty() ? plan.sensor.shot_rate
                                      : positive_number(options.rate_hz, "--rate-hz", "Hz");
  plan.angle_noise = settings.angle_noise.value_or(plan.sensor.angle_noise);
  if (options.rounding) plan.angle_resolution = plan.sensor.angle_resolution;
  plan.free = estimation::chosen_parameters(settings);
  return estimation::observability_of_plan(plan);
}

ExitStatus run_observability(const ObservabilityCommandOptions& options,
                             const CommonOptions& common) {
  check_positive(options.duration_s, "--duration-s", "s");
  EstimationWishes wishes{options.sensor, options.noise_angle_deg, options.fixed, options.freed};
  Observability result;
  TrainShape shape;
  if (options.input.empty()) {
    if (wishes.sensor.empty()) wishes.sensor = "mid-40";
    const estimation::EstimateOptions settings = estimate_options(wishes, std::nullopt);
    shape = settings.sensor.shape();
    result = observe_plan(options, settings);
  } else {
    std::optional<double> rate;
    if (!options.rate_hz.empty() && options.rate_hz != "full") {
      rate = positive_number(options.rate_hz, "--rate-hz", "Hz");
    }
    RecordingInput input = read_recording(options.input, options.reading, wishes.sensor,
                                          {.rate = rate, .ranges = true, .rows = false}, common);
    for (const std::string& warning : input.warnings) spdlog::warn(warning);
    estimation::EstimateOptions settings = estimate_options(wishes, input.reader->header());
    settings.cartesian = input.whole_steps;
    shape = settings.sensor.shape();
    ProgressBar bar("estimating", common);
    const estimation::Estimate estimate =
        estimation::estimate(estimation::Method::map, input.selector.take_series(),
                             input.selector.head(), settings, bar.callback());
    for (const std::string& warning : estimate.warnings) spdlog::warn(warning);
    if (!estimate.converged) {
      spdlog::warn("the estimate did not converge: {}", estimate.reason);
    }
    result = estimation::observability_of_estimate(estimate);
  }
  if (common.json) {
    print_json(observability_json(result, shape));
  } else {
    print_observability(result, shape);
  }
  return kDone;
}

}  // namespace

Run declare_observability(CLI::App& verb) {
  const auto options = std::make_shared<ObservabilityCommandOptions>();
  ObservabilityCommandOptions& o = *options;
  verb.add_option("INPUT", o.input, "Recording to judge; without one, a plan is judged");
  verb.add_option(
      "--sensor", o.sensor,
      "Preset by name, or a preset or calibration file (default: from the recording, or "
      "mid-40)");
  verb.add_option("--duration-s", o.duration_s, "Length of the planned recording")
      ->capture_default_str();
  verb.add_option(
      "--rate-hz", o.rate_hz,
      "Shots per second of the plan (default: the sensor's), or to use of the recording");
  verb.add_option("--noise-angle-deg", o.noise_angle_deg,
                  "1 sigma of azimuth and zenith before rounding (default: the sensor's)");
  verb.add_flag("!--no-rounding", o.rounding,
                "Plan a recording whose angles are not rounded to the sensor's resolution");
  add_reading_options(verb, o.reading);
  add_parameter_choice(verb, o.fixed, o.freed);
  return [options](const CommonOptions& common) { return run_observability(*options, common); };
}

}  // namespace risley::app
