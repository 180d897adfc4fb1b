// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/observability.hpp"

#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/text.hpp"

#include "command.hpp"
#include "parameter_choice.hpp"
#include "reading_options.hpp"
#include "table.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

using jobs::JudgedObservability;

struct ObservabilityCommandOptions {
  std::string input, sensor;
  double duration_s = 30;
  std::string rate_hz;
  std::optional<double> noise_angle_deg;
  bool rounding = true;
  ParameterWishes parameters;
  ReadingWishes reading;
};

std::string sigma_text(double sigma, const ParameterInfo& info) {
  return std::isfinite(sigma) ? fmt::format("{:.2g}", sigma / info.si_per_unit) : "never";
}

void print_emitters(const estimation::EmitterComparison& emitters, TrainShape shape) {
  const int alone = emitters.alone + 1;
  Table table({"sigma of one prism's own", fmt::format("{} emitters", emitters.emitters),
               "directions known", fmt::format("emitter {} alone", alone), "unit"});
  for (const auto& bounds : emitters.bounds) {
    const ParameterInfo& info = find_parameter(bounds.name, shape);
    table.add({bounds.name, sigma_text(bounds.all, info), sigma_text(bounds.known, info),
               sigma_text(bounds.alone, info), info.unit});
  }
  fmt::print("\n");
  table.print();
  fmt::print(
      "\nalone: the same number of shots, all of emitter {}, with the free parameters of one "
      "emitter.\n",
      alone);
  for (const auto& weak : emitters.untold_alone) {
    fmt::print("not determined by emitter {} alone: {}\n", alone, direction_text(weak));
  }
  fmt::print("\n");
}

void print_observability(const JudgedObservability& judged) {
  const estimation::Observability& o = judged.observability;
  const TrainShape shape = judged.shape;
  say("{:.4g} s at {:.6g} Hz, {} shots\n\n", o.duration, o.rate,
      grouped(static_cast<std::uint64_t>(std::llround(o.shots))));
  Table table({"quantity", "sigma", "unit", "deg per unit", "most correlated with", "rho"});
  for (const auto& quantity : o.quantities) {
    const ParameterInfo& info = find_parameter(quantity.name, shape);
    const std::string sigma = sigma_text(quantity.sigma, info);
    table.add({quantity.name, quantity.free ? sigma : fmt::format("({})", sigma), info.unit,
               fmt::format("{:.3g}", degrees_from_radians(quantity.sensitivity) * info.si_per_unit),
               quantity.twins.front().first, fmt::format("{:.4f}", quantity.twins.front().second)});
  }
  table.print();
  say("\nsigma: Cramer-Rao bound. In brackets: held by default; the bound if it were freed.\n");
  if (!o.emitters.bounds.empty()) print_emitters(o.emitters, shape);
  for (const auto& weak : o.unobservable) {
    say("not determined by such data: {}\n", direction_text(weak));
  }
  for (const std::string& words : judged.words) {
    say("{}.\n", words);
  }
}

ExitStatus run_observability(const ObservabilityCommandOptions& options,
                             const CommonOptions& common) {
  jobs::ObservabilityOptions job;
  job.recording = options.input;
  job.reading = read_options(options.reading);
  job.sensor = options.sensor;
  job.duration = options.duration_s;
  if (!options.rate_hz.empty() && (options.input.empty() || options.rate_hz != "full")) {
    job.rate = rate_from(options.rate_hz);
  }
  job.angle_noise = noise_angle(options.noise_angle_deg);
  job.rounding = options.rounding;
  job.fixed = held_parameters(options.parameters.fixed);
  job.additional = options.parameters.freed;
  JudgedObservability judged;
  {
    ProgressBar bar("estimating", common);
    judged = jobs::judge_observability(job, bar.progress());
  }
  log_warnings(judged.warnings);
  if (!judged.converged) spdlog::warn("the estimate did not converge: {}", judged.reason);
  if (common.json) {
    print_json(common, json::of(judged));
  } else {
    print_observability(judged);
  }
  return kDone;
}

}  // namespace

Run declare_observability(CLI::App& verb) {
  const auto options = std::make_shared<ObservabilityCommandOptions>();
  ObservabilityCommandOptions& o = *options;
  verb.add_option("INPUT", o.input, "Recording to judge (default: a planned one)");
  verb.add_option(
      "--sensor", o.sensor,
      "Preset by name, or a preset or calibration file (default: from the recording, or "
      "mid-40)");
  verb.add_option("--duration-s", o.duration_s, "Length of the planned recording, s")
      ->capture_default_str();
  verb.add_option("--rate-hz", o.rate_hz,
                  "Shots per second, Hz, to plan with (default: the sensor's) or to use of the "
                  "recording; 'full': all of them");
  verb.add_option("--noise-angle-deg", o.noise_angle_deg,
                  "1 sigma of azimuth and zenith before rounding, deg (default: the sensor's)");
  verb.add_flag("!--no-rounding", o.rounding,
                "Plan with angles that are not rounded to the sensor's resolution");
  add_reading_options(verb, o.reading);
  add_parameter_choice(verb, o.parameters);
  return [options](const CommonOptions& common) { return run_observability(*options, common); };
}

}  // namespace risley::app
