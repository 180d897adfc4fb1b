// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/evaluation.hpp"
#include "risley/io/text_file.hpp"
#include "risley/recordings/time_audit.hpp"
#include "risley/report/estimate_report.hpp"
#include "risley/report/number_text.hpp"
#include "risley/sensors/preset.hpp"

#include "command.hpp"
#include "estimation_input.hpp"
#include "observability_text.hpp"
#include "recording_text.hpp"
#include "result_folder.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using estimation::Estimate;
using estimation::Evaluation;

/// What the paper's filter can do in a time that one waits for.
constexpr const char* kFilterRate = "1000";

struct EstimateCommandOptions {
  std::string input, folder, method = "map", rate_hz, sensor, states = "knots", mirror = "auto",
                             process_noise = "auto", truth;
  std::optional<double> noise_angle_deg;
  std::vector<std::string> fixed, freed;
  ReadingWishes reading;

  estimation::Method chosen_method() const {
    return method == "ekf" ? estimation::Method::ekf : estimation::Method::map;
  }
  std::string rate() const {
    if (!rate_hz.empty()) return rate_hz;
    return chosen_method() == estimation::Method::ekf ? kFilterRate : "full";
  }
};

std::vector<estimation::RotorProcess> rotor_process(const std::string& text, int prisms) {
  if (text == "auto") return {};
  if (text == "none") {
    return std::vector<estimation::RotorProcess>(static_cast<std::size_t>(prisms),
                                                 estimation::kConstantAcceleration);
  }
  estimation::RotorProcess process = estimation::kPaperProcess;
  if (text != "paper") {
    process.acceleration =
        radians_from_degrees(positive_number(text, "--process-noise", "deg/s per sqrt(s)"));
  }
  return std::vector<estimation::RotorProcess>(static_cast<std::size_t>(prisms), process);
}

estimation::EstimateOptions estimate_options(const EstimateCommandOptions& options,
                                             const recordings::RecordingHeader& header) {
  estimation::EstimateOptions result = estimate_options(
      EstimationWishes{options.sensor, options.noise_angle_deg, options.fixed, options.freed},
      header);
  result.rotor_process = rotor_process(options.process_noise, result.sensor.prisms());
  if (options.mirror != "auto") result.mirrored = options.mirror == "yes";
  return result;
}

/// Truth files by the name of the YAML one; the columns stand beside it.
Evaluation evaluate_with(const std::string& truth_path, const Estimate& estimate) {
  const std::filesystem::path preset(truth_path);
  if (preset.extension() != ".yaml") {
    throw InvalidArgument(fmt::format("--truth = {}, expected OUT.truth.yaml", truth_path));
  }
  const sensors::Sensor sensor = sensors::load_sensor(truth_path);
  // One row per state: the truth of a full-rate recording is larger than the recording.
  std::vector<std::int64_t> times = estimate.states.time_ns;
  std::sort(times.begin(), times.end());
  const recordings::TruthColumns columns = recordings::load_truth(
      std::filesystem::path(preset).replace_extension(".nc").string(), times);
  return estimation::evaluate(estimate, sensor, columns);
}

Json moments_json(const estimation::Moments& moments) {
  return {{"mean", degrees_from_radians(moments.mean)},
          {"std", degrees_from_radians(moments.std)},
          {"rms", degrees_from_radians(moments.rms)},
          {"skewness", moments.skewness},
          {"kurtosis", moments.kurtosis}};
}

Json evaluation_json(const Evaluation& evaluation, int prisms) {
  Json parameters = Json::object();
  for (const estimation::TruthComparison& one : evaluation.parameters) {
    parameters[one.name] = {{"true", in_file_unit(one.name, one.truth, prisms)},
                            {"error", in_file_unit(one.name, one.error, prisms)},
                            {"error_over_sigma", one.error_over_sigma}};
  }
  const auto by_prism = [](const std::vector<double>& values, double scale) {
    Json object = Json::object();
    for (std::size_t i = 0; i < values.size(); ++i) {
      object[std::string(1, prism_letter(static_cast<int>(i)))] = scale * values[i];
    }
    return object;
  };
  return {
      {"parameters", parameters},
      {"rotation_angle_rmse_deg", by_prism(evaluation.rotation_angle_rmse, kDegreesPerRadian)},
      {"rotation_angle_rmse_over_sigma", by_prism(evaluation.rotation_angle_rmse_over_sigma, 1.0)},
      {"angular_velocity_rmse_deg_per_s",
       by_prism(evaluation.angular_velocity_rmse, kDegreesPerRadian)},
      {"angular_velocity_rmse_over_sigma",
       by_prism(evaluation.angular_velocity_rmse_over_sigma, 1.0)},
      {"nees_parameters", evaluation.nees_parameters},
      {"nees_rotation_angles", evaluation.nees_rotation_angles}};
}

Json start_json(const estimation::Start& start) {
  Json angles = Json::object(), speeds = Json::object();
  for (std::size_t i = 0; i < start.rotation_angle.size(); ++i) {
    const std::string letter(1, prism_letter(static_cast<int>(i)));
    angles[letter] = degrees_from_radians(start.rotation_angle[i]);
    speeds[letter] = degrees_from_radians(start.angular_velocity[i]);
  }
  return {{"time_ns", start.time_ns},
          {"rotation_angle_deg", angles},
          {"angular_velocity_deg_per_s", speeds},
          {"residual_rms_deg", degrees_from_radians(start.residual_rms)}};
}

/// An angle and its sigma, rad, in degrees.
Json value_json(double value, double sigma) {
  return {{"value", degrees_from_radians(value)}, {"sigma", degrees_from_radians(sigma)}};
}

/// How the recording's frame is turned; zeros without sigma where it is the sensor's.
Json frame_json(const Estimate& e) {
  const estimation::FrameEstimate frame = e.frame.value_or(estimation::FrameEstimate{});
  return {{"yaw_deg", value_json(frame.turn.yaw, std::sqrt(frame.covariance(0, 0)))},
          {"pitch_deg", value_json(frame.turn.pitch, std::sqrt(frame.covariance(1, 1)))},
          {"estimated", e.frame.has_value()}};
}

/// Parameters of the prisms that the estimation did not touch.
Json fixed_json(const Estimate& estimate) {
  std::vector<int> free_places;
  for (const estimation::FreeParameter& free : estimate.free) {
    free_places.insert(free_places.end(), free.places.begin(), free.places.end());
  }
  Json object = Json::object();
  for (const ParameterInfo& info : parameter_list(estimate.sensor.prisms())) {
    if (info.kind != ParameterKind::train || info.places.size() > 1) continue;
    if (std::find(free_places.begin(), free_places.end(), info.places.front()) !=
        free_places.end()) {
      continue;
    }
    object[info.name] = estimate.sensor.get(info.name) / info.si_per_unit;
  }
  return object;
}

/// Everything one run of the verb found.
struct Outcome {
  Estimate estimate;
  std::optional<Evaluation> evaluation;
  std::vector<std::string> warnings;  ///< of the recording
  double read_s = 0, solve_s = 0, total_s = 0;
};

Json outcome_json(const Outcome& outcome) {
  const Estimate& e = outcome.estimate;
  const int prisms = e.sensor.prisms();
  Json parameters = Json::object();
  for (const estimation::EstimatedValue& value : e.values) {
    parameters[value.name] = {{"value", in_file_unit(value.name, value.value, prisms)},
                              {"sigma", in_file_unit(value.name, value.sigma, prisms)}};
  }
  Json rotors = Json::array(), jerks = Json::array(), unobservable = Json::array();
  for (const estimation::RotorProcess& process : e.rotor_process) {
    rotors.push_back(degrees_from_radians(process.acceleration));
    jerks.push_back(degrees_from_radians(process.jerk));
  }
  Json uneven = Json::object();
  for (std::size_t k = 0; k < e.residuals_over_angle.size(); ++k) {
    uneven[std::string(1, prism_letter(static_cast<int>(k)))] =
        e.residuals_over_angle[k].chi2_per_bin;
  }
  for (const estimation::WeakDirection& weak : e.unobservable) {
    unobservable.push_back(weak_direction_json(weak));
  }
  std::vector<std::string> warnings = outcome.warnings;
  warnings.insert(warnings.end(), e.warnings.begin(), e.warnings.end());
  Json object = {
      {"converged", e.converged},
      {"reason", e.reason},
      {"method", e.method == estimation::Method::map ? "map" : "ekf"},
      {"observations_used", e.series.size() - (e.map ? e.map->unused_shots : 0)},
      {"outliers", e.outliers},
      {"combination", nullptr},
      {"mirrored", e.mirrored},
      {"parameters", parameters},
      {"fixed", fixed_json(e)},
      {"residuals",
       {{"azimuth_deg", moments_json(e.azimuth_residuals)},
        {"zenith_deg", moments_json(e.zenith_residuals)},
        {"expected_rms_deg", degrees_from_radians(e.expected_residual)}}},
      {"noise",
       {{"azimuth_deg", value_json(e.noise.value.azimuth, e.noise.sigma.azimuth)},
        {"zenith_deg", value_json(e.noise.value.zenith, e.noise.sigma.zenith)},
        {"held", e.noise_held}}},
      {"frame", frame_json(e)},
      {"coordinates", to_string(e.coordinates)},
      {"process_noise_deg_per_s_per_sqrt_s", rotors},
      {"process_jerk_deg_per_s2_per_sqrt_s", jerks},
      {"unobservable", unobservable},
      {"residuals_over_angle_chi2_per_bin", uneven},
      {"start", start_json(e.start)},
      {"warnings", warnings},
      {"seconds",
       {{"read", outcome.read_s}, {"solve", outcome.solve_s}, {"total", outcome.total_s}}}};
  if (e.map) {
    object["iterations"] = e.map->iterations;
    object["residuals"]["autocorrelation"] =
        e.map->autocorrelation.rho.empty() ? 0.0 : e.map->autocorrelation.rho.front();
    object["residuals"]["autocorrelation_factor"] = e.map->autocorrelation.factor;
    object["residuals"]["unit_variance"] = e.map->unit_variance;
    object["residuals"]["variance_factor"] = e.map->variance_factor;
  }
  if (e.sensor.combination) object["combination"] = static_cast<int>(*e.sensor.combination);
  if (outcome.evaluation) object["truth"] = evaluation_json(*outcome.evaluation, prisms);
  return object;
}

void print_noise(const Estimate& e) {
  const auto angle = [&](double value, double sigma) {
    if (e.noise_held) return fmt::format("{:.3g}", degrees_from_radians(value));
    const report::NumberText text =
        report::number_text(degrees_from_radians(value), degrees_from_radians(sigma));
    return fmt::format("{} +- {}", text.value, text.sigma);
  };
  fmt::print(
      "\nnoise before rounding, {}: azimuth {} deg, zenith {} deg; a healthy unit: {:.3g} "
      "deg\n",
      e.noise_held ? "held" : "found", angle(e.noise.value.azimuth, e.noise.sigma.azimuth),
      angle(e.noise.value.zenith, e.noise.sigma.zenith), degrees_from_radians(e.usual_noise));
}

void print_outcome(const Outcome& outcome) {
  const Estimate& e = outcome.estimate;
  const int prisms = e.sensor.prisms();
  fmt::print("{}\n", e.converged ? "converged" : "NOT CONVERGED: " + e.reason);
  fmt::print("{} shots used, {} of them outliers{}; read {:.2f} s, solved {:.2f} s\n\n",
             grouped(e.series.size()), grouped(e.outliers),
             (e.sensor.combination
                  ? fmt::format(", speed combination {}", static_cast<int>(*e.sensor.combination))
                  : std::string()) +
                 (e.mirrored ? ", mirrored" : ""),
             outcome.read_s, outcome.solve_s);
  std::vector<std::string> head = {"parameter", "value", "+- sigma", "unit"};
  if (outcome.evaluation) head.insert(head.end(), {"truth", "error", "error/sigma"});
  Table table(head);
  for (const estimation::EstimatedValue& value : e.values) {
    const double sigma = in_file_unit(value.name, value.sigma, prisms);
    const report::NumberText text =
        report::number_text(in_file_unit(value.name, value.value, prisms), sigma);
    std::vector<std::string> row = {value.name, text.value, text.sigma,
                                    find_parameter(value.name, prisms).unit};
    if (outcome.evaluation) {
      for (const estimation::TruthComparison& one : outcome.evaluation->parameters) {
        if (one.name != value.name) continue;
        row.push_back(report::text_to_place_of(in_file_unit(one.name, one.truth, prisms), sigma));
        row.push_back(report::text_to_place_of(in_file_unit(one.name, one.error, prisms), sigma));
        row.push_back(fmt::format("{:.2f}", one.error_over_sigma));
      }
    }
    table.add(row);
  }
  table.print();
  fmt::print("\n");
  Table residuals({"residual", "mean deg", "std deg", "rms deg", "skewness", "excess kurtosis"});
  const auto add = [&residuals](const char* name, const estimation::Moments& m) {
    residuals.add({name, fmt::format("{:.6f}", degrees_from_radians(m.mean)),
                   fmt::format("{:.6f}", degrees_from_radians(m.std)),
                   fmt::format("{:.6f}", degrees_from_radians(m.rms)),
                   fmt::format("{:.3f}", m.skewness), fmt::format("{:.3f}", m.kurtosis)});
  };
  add("azimuth", e.azimuth_residuals);
  add("zenith", e.zenith_residuals);
  residuals.print();
  print_noise(e);
  if (e.map) {
    fmt::print(
        "\nresiduals: {:.3f} times the stated variance, autocorrelation factor {:.3f}; variances "
        "of "
        "single shots multiplied by {:.3f}\n",
        e.map->unit_variance, e.map->autocorrelation.factor, e.map->variance_factor);
  }
  if (outcome.evaluation) {
    fmt::print("\nrotation angle rmse:");
    for (std::size_t i = 0; i < outcome.evaluation->rotation_angle_rmse.size(); ++i) {
      fmt::print(" {} {:.5f} deg", prism_letter(static_cast<int>(i)),
                 degrees_from_radians(outcome.evaluation->rotation_angle_rmse[i]));
    }
    fmt::print(
        "\nNEES per degree of freedom (1 is honest): parameters {:.3g}, rotation angles {:.3g}\n",
        outcome.evaluation->nees_parameters, outcome.evaluation->nees_rotation_angles);
  }
}

/// calibration.yaml, states.nc, report.json and report.html. An estimate that did not converge is
/// no calibration: there is none then, not even an older one of the same name.
void write_folder(const EstimateCommandOptions& options, const CommonOptions& common,
                  const RecordingInput& input, const sensors::Sensor& nominal,
                  const Outcome& outcome) {
  namespace fs = std::filesystem;
  const auto provenance = provenance_of(common, {options.input});
  const auto path = [&](const char* name) { return (fs::path(options.folder) / name).string(); };
  if (outcome.estimate.converged) {
    sensors::Sensor calibrated = outcome.estimate.sensor;
    calibrated.provenance = provenance;
    calibrated.serial = input.reader->header().devices.front().serial;
    io::write_text_file(path("calibration.yaml"), sensors::preset_text(calibrated));
  } else {
    remove_calibration(options.folder);
  }
  if (options.states != "none") {
    write_states_of(outcome.estimate, options.states, path("states.nc"), provenance);
  }
  write_report_of(report::estimate_report(
                      {outcome.estimate, nominal, outcome.evaluation, input.selector.head(),
                       reported_recording(options.input, input), provenance, outcome.warnings}),
                  options.folder);
}

/// Wrong wishes are told before an hour of reading.
void check_options(const EstimateCommandOptions& options) {
  if (options.states == "all" && options.chosen_method() == estimation::Method::ekf &&
      options.rate() != "full") {
    throw InvalidArgument(
        "--states all needs --rate-hz full: the filter has states at the shots it uses only");
  }
  if (!options.folder.empty()) make_result_folder(options.folder);
}

ExitStatus run_estimate(const EstimateCommandOptions& options, const CommonOptions& common) {
  const double started = now();
  check_options(options);
  std::optional<double> rate;
  if (options.rate() != "full") rate = positive_number(options.rate(), "--rate-hz", "Hz");
  RecordingInput input = read_recording(options.input, options.reading, options.sensor,
                                        {.rate = rate, .ranges = true, .rows = false}, common);
  estimation::EstimateOptions settings = estimate_options(options, input.reader->header());
  settings.cartesian = input.whole_steps;
  const estimation::SelectionCounts& counts = input.selector.counts();
  spdlog::debug(
      "{} observations of format {}, {} without a direction, {} out of order; {} shots used "
      "with sensor {}",
      counts.rows, input.reader->header().format, counts.invalid, counts.out_of_order,
      input.selector.series().size(), settings.sensor.name);
  Outcome outcome;
  outcome.warnings = input.warnings;
  outcome.read_s = input.seconds;
  const double solving = now();
  {
    ProgressBar bar("estimating", common);
    outcome.estimate = estimation::estimate(options.chosen_method(), input.selector.take_series(),
                                            input.selector.head(), settings, bar.callback());
  }
  outcome.solve_s = now() - solving;
  const estimation::Start& start = outcome.estimate.start;
  spdlog::debug("start: residuals of {:.3g} deg", degrees_from_radians(start.residual_rms));
  if (!options.truth.empty()) outcome.evaluation = evaluate_with(options.truth, outcome.estimate);
  if (!options.folder.empty()) {
    write_folder(options, common, input, settings.sensor, outcome);
  }
  outcome.total_s = now() - started;
  const Estimate& e = outcome.estimate;
  for (const std::string& warning : outcome.warnings) spdlog::warn(warning);
  for (const std::string& warning : e.warnings) spdlog::warn(warning);
  if (!e.converged) spdlog::error("not converged: {}", e.reason);
  if (common.json) {
    print_json(outcome_json(outcome));
  } else {
    print_outcome(outcome);
  }
  return e.converged ? kDone : kNumbersFailed;
}

}  // namespace

Run declare_estimate(CLI::App& verb) {
  const auto options = std::make_shared<EstimateCommandOptions>();
  EstimateCommandOptions& o = *options;
  verb.add_option("INPUT", o.input, "Recording of one sensor, of any known format")->required();
  verb.add_option("-o,--output", o.folder,
                  "Folder for calibration.yaml, states.nc, report.json and report.html");
  verb.add_option("--method", o.method,
                  "map: most probable trajectory of all shots at once; ekf: the paper's filter")
      ->check(CLI::IsMember({"map", "ekf"}))
      ->capture_default_str();
  verb.add_option(
      "--rate-hz", o.rate_hz,
      "Shots per second to use, or 'full' for all (default: full with map, 1000 with ekf)");
  verb.add_option(
      "--noise-angle-deg", o.noise_angle_deg,
      "Hold the noise of azimuth and zenith before rounding, 1 sigma, at this (default: "
      "found in the data; ekf: the sensor's)");
  verb.add_option("--sensor", o.sensor,
                  "Preset by name, or a preset or calibration file (default: from the recording)");
  add_reading_options(verb, o.reading);
  add_parameter_choice(verb, o.fixed, o.freed);
  verb.add_option(
          "--states", o.states,
          "Which rotor states to write: at one shot every 2 ms (ekf: at the shots used), at "
          "all shots, none")
      ->check(CLI::IsMember({"knots", "all", "none"}))
      ->capture_default_str();
  verb.add_option("--mirror", o.mirror,
                  "Whether the elevation in the file has the opposite sign; auto finds out")
      ->check(CLI::IsMember({"auto", "yes", "no"}))
      ->capture_default_str();
  verb.add_option("--process-noise", o.process_noise,
                  "How rotors may move: auto (random walks of speed and, with map, acceleration, "
                  "by maximum "
                  "likelihood), none (constant acceleration), paper (900), or a random walk of the "
                  "speed in deg/s per sqrt(s)")
      ->capture_default_str();
  verb.add_option("--truth", o.truth, "OUT.truth.yaml of a simulation, to judge the estimate by");
  return [options](const CommonOptions& common) {
    try {
      return run_estimate(*options, common);
    } catch (const EstimationError&) {
      remove_calibration(options->folder);
      throw;
    }
  };
}

}  // namespace risley::app
