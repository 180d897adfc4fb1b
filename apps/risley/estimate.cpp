// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/estimate_recording.hpp"

#include "command.hpp"
#include "many_files.hpp"
#include "parameter_choice.hpp"
#include "reading_options.hpp"
#include "result_folder.hpp"
#include "table.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

using estimation::Estimate;
using jobs::EstimatedRecording;

struct EstimateCommandOptions {
  std::string input, method = "map", rate_hz, sensor, states = "knots", mirror = "auto",
                     process_noise = "auto", truth;
  jobs::ManyInputsOptions many;  ///< its output is the folder
  bool no_report = false, noise_model = false;
  std::optional<double> noise_angle_deg;
  ParameterWishes parameters;
  ReadingWishes reading;
};

std::optional<estimation::RotorProcess> rotor_process(const std::string& text) {
  if (text == "auto") return std::nullopt;
  if (text == "none") return estimation::kConstantAcceleration;
  estimation::RotorProcess process = estimation::kPaperProcess;
  if (text != "paper") {
    process.acceleration = radians_from_degrees(number_from(text, flag_of(kSetting.process_noise)));
    require_positive(kSetting.process_noise, process.acceleration);
  }
  return process;
}

jobs::EstimateRecordingOptions job_of(const EstimateCommandOptions& options,
                                      const CommonOptions& common) {
  jobs::EstimateRecordingOptions job;
  job.recording = options.input;
  job.reading = read_options(options.reading);
  job.sensor = options.sensor;
  job.method = options.method == "ekf" ? estimation::Method::ekf : estimation::Method::map;
  job.rate = options.rate_hz.empty() ? jobs::usual_rate(job.method) : rate_from(options.rate_hz);
  job.angle_noise = noise_angle(options.noise_angle_deg);
  job.fixed = held_parameters(options.parameters.fixed);
  job.additional = options.parameters.freed;
  job.rotor_process = rotor_process(options.process_noise);
  if (options.mirror != "auto") job.mirrored = options.mirror == "yes";
  job.truth = options.truth;
  job.noise_model = options.noise_model;
  job.details = !options.many.output.empty() && !options.no_report;
  job.files = result_files(options.many.output, options.states, common);
  if (job.details) {
    job.texts = [](const EstimatedRecording& outcome) {
      return report_texts(report::report_of(outcome));
    };
  }
  return job;
}

void print_noise(const Estimate& e) {
  const auto angle = [&](double value, double sigma) {
    if (e.noise_held) return fmt::format("{:.3g}", degrees_from_radians(value));
    const NumberText text = number_text(degrees_from_radians(value), degrees_from_radians(sigma));
    return fmt::format("{} +- {}", text.value, text.sigma);
  };
  say("\nnoise before rounding, {}: azimuth {} deg, zenith {} deg; a healthy unit: {:.3g} "
      "deg\n",
      e.noise_held ? "held" : "found", angle(e.noise.value.azimuth, e.noise.sigma.azimuth),
      angle(e.noise.value.zenith, e.noise.sigma.zenith), degrees_from_radians(e.usual_noise));
}

void print_noise_model(const estimation::NoiseModel& model) {
  const double direction_deg = degrees_from_radians(model.direction);
  say("\nnoise model, 1 sigma of single points: range {:.3g} m ({}), direction {:.3g} deg along "
      "either axis across the beam (azimuth {:.3g}, zenith {:.3g} deg), {:.3g} m2 at {:.0f} m\n",
      model.range, model.range_source, direction_deg, degrees_from_radians(model.azimuth),
      degrees_from_radians(model.zenith), model.point_variance(), model.range_distance);
  const auto known = [](const std::optional<double>& value, double scale, const char* unit,
                        const std::string& source) {
    return value ? fmt::format("{:.3g} {} ({})", scale * *value, unit, source)
                 : std::string("not known");
  };
  say("shared by all points, which does not average out: direction {}, range {}\n",
      known(model.shared_direction, degrees_from_radians(1), "deg", model.shared_direction_source),
      known(model.shared_range, 1, "m", model.shared_range_source));
  Table table({"program", "setting", "value", "unit"});
  table.add({"VoxelMap", "noise_model/ranging_cov", fmt::format("{:.3g}", model.range), "m"});
  table.add({"VoxelMap", "noise_model/angle_cov", fmt::format("{:.3g}", direction_deg), "deg"});
  table.add({"FAST-LIVO2", "lio/dept_err", fmt::format("{:.3g}", model.range), "m"});
  table.add({"FAST-LIVO2", "lio/beam_err", fmt::format("{:.3g}", direction_deg), "deg"});
  table.add(
      {"Point-LIO", "mapping/lidar_meas_cov", fmt::format("{:.3g}", model.point_variance()), "m2"});
  table.add({"FAST-LIO", "LASER_POINT_COV", fmt::format("{:.3g}", model.point_variance()), "m2"});
  table.print();
}

void print_outcome(const EstimatedRecording& outcome) {
  const Estimate& e = outcome.estimate;
  const TrainShape shape = e.sensor.shape();
  say("{}\n", e.converged ? "converged" : "NOT CONVERGED");
  print_verdict(e.verdict);
  say("sensor {}: {}\n", outcome.choice.sensor.name, outcome.choice.words);
  say("{} shots used, {} of them outliers{}; read {:.2f} s, solved {:.2f} s\n\n",
      grouped(e.series.size()), grouped(e.outliers),
      (e.sensor.combination ? fmt::format(", speed combination {}", *e.sensor.combination)
                            : std::string()) +
          (e.mirrored ? ", mirrored" : ""),
      outcome.reading_time, outcome.solving_time);
  const bool any_held = std::any_of(e.values.begin(), e.values.end(), [](const auto& value) {
    return value.sigma > value.sigma_given_held;
  });
  std::vector<std::string> head = {"parameter", "value", "+- sigma", "unit"};
  if (any_held) head.insert(head.begin() + 3, "given held");
  if (outcome.evaluation) head.insert(head.end(), {"truth", "error", "error/sigma"});
  Table table(head);
  for (const estimation::EstimatedValue& value : e.values) {
    const double sigma = in_file_unit(value.name, value.sigma_given_held, shape);
    const double found = in_file_unit(value.name, value.value, shape);
    const NumberText text = number_text(found, sigma);
    std::vector<std::string> row = {
        value.name, text.value,
        number_text(found, in_file_unit(value.name, value.sigma, shape)).sigma};
    if (any_held) row.push_back(text.sigma);
    row.push_back(find_parameter(value.name, shape).unit);
    if (outcome.evaluation) {
      for (const estimation::TruthComparison& one : outcome.evaluation->parameters) {
        if (one.name != value.name) continue;
        row.push_back(text_to_place_of(in_file_unit(one.name, one.truth, shape), sigma));
        row.push_back(text_to_place_of(in_file_unit(one.name, one.error, shape), sigma));
        row.push_back(fmt::format("{:.2f}", one.error_over_sigma));
      }
    }
    table.add(row);
  }
  table.print();
  say("\n");
  Table residuals({"residual", "mean deg", "std deg", "rms deg",
                   fmt::format("at {:.0f} m, mm", kStatedDistance)});
  const auto add = [&residuals](const char* name, const estimation::Moments& m) {
    residuals.add({name, fmt::format("{:.6f}", degrees_from_radians(m.mean)),
                   fmt::format("{:.6f}", degrees_from_radians(m.std)),
                   fmt::format("{:.6f}", degrees_from_radians(m.rms)),
                   fmt::format("{:.2f}", 1e3 * offset_at(m.rms))});
  };
  add("azimuth", e.azimuth_moments);
  add("zenith", e.zenith_moments);
  residuals.print();
  print_noise(e);
  say("\nresiduals: {:.3f} times the stated variance, autocorrelation factor {:.3f}; variances of "
      "single shots multiplied by {:.3f}\n",
      e.unit_variance, e.autocorrelation.factor, e.variance_factor);
  if (outcome.noise_model) print_noise_model(*outcome.noise_model);
  if (outcome.evaluation) {
    say("\nrotation angle rmse:");
    for (std::size_t i = 0; i < outcome.evaluation->rotation_angle_rmse.size(); ++i) {
      say(" {} {:.5f} deg", prism_capital(static_cast<int>(i)),
          degrees_from_radians(outcome.evaluation->rotation_angle_rmse[i]));
    }
    say("\nNEES per degree of freedom (1 is honest): parameters {:.3g}, rotation angles {:.3g}\n",
        outcome.evaluation->nees_parameters, outcome.evaluation->nees_rotation_angles);
  }
}

ExitStatus run_estimate(const EstimateCommandOptions& options, const CommonOptions& common) {
  require_folder_apart(common, options.many.output, {"states.nc"});
  EstimatedRecording outcome;
  {
    ProgressBar bar("estimating", common);
    outcome = jobs::estimate_recording(job_of(options, common), bar.progress());
  }
  const Estimate& e = outcome.estimate;
  spdlog::debug(
      "{} observations of format {}, {} without a direction, {} out of order; {} shots used "
      "with sensor {}; start: residuals of {:.3g} deg",
      outcome.counts.rows, outcome.recording.header.format, outcome.counts.invalid,
      outcome.counts.out_of_order, e.series.size(), outcome.nominal.name,
      degrees_from_radians(e.start.residual_rms));
  log_warnings(outcome.warnings);
  log_warnings(e.warnings);
  if (!e.converged) log_failure(e.reason, common);
  if (common.json) {
    print_json(common, json::of(outcome), outcome.provenance);
  } else {
    print_outcome(outcome);
  }
  return e.converged ? kDone : kNumbersFailed;
}

}  // namespace

Run declare_estimate(CLI::App& verb) {
  const auto options = std::make_shared<EstimateCommandOptions>();
  EstimateCommandOptions& o = *options;
  add_many_options(verb, o.many, "Recordings, each of one sensor, of any known format");
  verb.add_option("-o,--output", o.many.output,
                  "Folder for calibration.yaml, states.nc, report.json and report.html; for "
                  "several inputs, one subfolder each (default: none)");
  verb.add_flag("--no-report", o.no_report, "Do not write report.json and report.html");
  add_choice(
      verb, "--method", o.method, {"map", "ekf"},
      "map: the most probable motion of the rotors, from all shots at once; ekf: the paper's "
      "filter");
  verb.add_option(
      "--rate-hz", o.rate_hz,
      "Shots per second to use, Hz, or 'full' for all (default: full with map, 1000 with ekf)");
  verb.add_option("--noise-angle-deg", o.noise_angle_deg,
                  "1 sigma of azimuth and zenith before rounding, deg, held at this (default: "
                  "estimated from the data; with ekf the sensor's)");
  verb.add_option("--sensor", o.sensor,
                  "Preset by name, or a preset or calibration file (default: from the recording)");
  add_reading_options(verb, o.reading);
  add_parameter_choice(verb, o.parameters);
  add_choice(
      verb, "--states", o.states, {"knots", "all", "none"},
      "Rotor states to write: 'knots': at one shot every 2 ms (ekf: at the shots used); 'all': "
      "at all shots; 'none'");
  add_choice(
      verb, "--mirror", o.mirror, {"auto", "yes", "no"},
      "Whether the elevation in the file has the opposite sign; 'auto' decides from the data");
  verb.add_option("--process-noise", o.process_noise,
                  "Process noise of the rotors' speed, deg/s per sqrt(s): a number; 'paper' (900); "
                  "'none' (constant acceleration); or 'auto' (random walks of the speed and, with "
                  "map, of the acceleration, found by maximum likelihood)")
      ->capture_default_str();
  verb.add_flag("--noise-model", o.noise_model,
                "Print the errors of points, under the names used in lidar odometry, and the part "
                "common to all points");
  verb.add_option("--truth", o.truth,
                  "Truth of a simulated recording (OUT.truth.yaml) to compare the estimate with");
  return [options, &verb](const CommonOptions& common) {
    options->many.into_folder = are_several(options->many);
    const jobs::InputWork work = json::estimate_each(job_of(*options, common), log_words);
    const jobs::InputPlan plan = jobs::plan_inputs(options->many, work, cancellable());
    if (!options->truth.empty() && plan.jobs.size() > 1) {
      throw InvalidArgument(
          fmt::format("--truth is for one recording, and there are {}", plan.jobs.size()));
    }
    if (plan.many) return run_inputs(plan, work, options->many, verb, common);
    options->input = plan.jobs.front().input;
    return run_estimate(*options, common);
  };
}

}  // namespace risley::app
