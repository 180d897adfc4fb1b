// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/calibration/calibration_plan.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/report/calibration_report.hpp"
#include "risley/sensors/preset.hpp"

#include "calibration_text.hpp"
#include "command.hpp"
#include "estimation_input.hpp"
#include "recording_text.hpp"
#include "result_folder.hpp"

namespace risley::app {
namespace {

using calibration::Calibration;
using calibration::DirectionErrors;
using calibration::RangedRecording;

struct CalibrateCommandOptions {
  std::vector<std::string> inputs, fixed, freed, station_names, truths;
  std::string folder, method = "adjustment", rate_hz = "full", sensor, planes, stations,
                      beam_origin = "yes", states = "knots", mirror = "auto", plan;
  std::optional<double> noise_angle_deg, noise_range_m, prior_sigma_deg;
  double range_offset_sigma_m = 0.05, duration_s = 10.0;
  ReadingWishes reading;
};

/// The stations of the recordings, in their order.
std::vector<scenes::Station> stations_for(const CalibrateCommandOptions& options) {
  if (options.stations.empty()) {
    if (!options.station_names.empty()) throw InvalidArgument("--station needs --stations");
    return {};
  }
  const scenes::Scene scene = scenes::load_scene(options.stations);
  std::vector<scenes::Station> stations;
  for (const std::string& name : options.station_names) stations.push_back(scene.station(name));
  if (options.station_names.empty()) stations = scene.stations;
  if (stations.size() != options.inputs.size()) {
    throw InvalidArgument(fmt::format(
        "{} stations for {} recordings: {} has to list one for each, in their order, or --station "
        "names them",
        stations.size(), options.inputs.size(), options.stations));
  }
  return stations;
}

/// What recordings and plans share.
void check_numbers(const CalibrateCommandOptions& options) {
  if (options.noise_range_m) check_positive(*options.noise_range_m, "--noise-range-m", "m");
  check_not_negative(options.range_offset_sigma_m, "--range-offset-sigma-m", "m");
}

/// rad
std::optional<double> prior_sigma(const CalibrateCommandOptions& options) {
  if (!options.prior_sigma_deg) return std::nullopt;
  check_positive(*options.prior_sigma_deg, "--prior-sigma-deg", "deg");
  return radians_from_degrees(*options.prior_sigma_deg);
}

calibration::CalibrationOptions calibration_options(const CalibrateCommandOptions& options,
                                                    const CommonOptions& common) {
  check_numbers(options);
  calibration::CalibrationOptions result;
  if (options.method == "paper") result.method = calibration::CalibrationMethod::paper;
  result.range_noise = options.noise_range_m;
  if (options.method == "paper" &&
      (!options.planes.empty() || !options.stations.empty() || options.prior_sigma_deg)) {
    throw InvalidArgument(
        "--method paper knows no --planes, --stations and --prior-sigma-deg: its walls are all it "
        "has");
  }
  result.prior_sigma = prior_sigma(options);
  result.range_offset_sigma = options.range_offset_sigma_m;
  result.beam_origin = options.beam_origin == "yes";
  if (!options.planes.empty()) result.planes = scenes::load_scene(options.planes);
  result.stations = stations_for(options);
  result.additional = options.freed;
  result.seed = common.seed;
  return result;
}

/// "states.nc", or "states_2.nc" for the second of several recordings.
std::string states_name(const CalibrateCommandOptions& options, std::size_t recording) {
  return options.inputs.size() == 1 ? "states.nc" : fmt::format("states_{}.nc", recording + 1);
}

/// Reads one recording and finds its rotation angles.
RangedRecording read_and_estimate(const CalibrateCommandOptions& options,
                                  const CommonOptions& common, std::size_t number,
                                  CalibrationOutcome& outcome) {
  const std::string& path = options.inputs[number];
  estimation::SelectionOptions selection;
  selection.ranges = true;
  if (options.rate_hz != "full") {
    selection.rate = positive_number(options.rate_hz, "--rate-hz", "Hz");
  }
  RecordingInput input = read_recording(path, options.reading, options.sensor, selection, common);
  outcome.read_s += input.seconds;
  outcome.observations += input.audit.observations;
  outcome.reported.push_back(reported_recording(path, input));
  if (!input.reader->header().has_range) {
    throw EstimationError(
        fmt::format("{} holds no ranges: there is nothing to calibrate on", path));
  }
  estimation::EstimateOptions settings = estimate_options(
      EstimationWishes{options.sensor, options.noise_angle_deg, {}, {}}, input.reader->header());
  settings.cartesian = input.whole_steps;
  if (options.mirror != "auto") settings.mirrored = options.mirror == "yes";
  if (number == 0) outcome.nominal = settings.sensor;
  for (const std::string& text : input.warnings) {
    outcome.warnings.push_back(fmt::format("{}: {}", path, text));
  }
  const double started = now();
  ProgressBar bar(fmt::format("rotation angles {}/{}", number + 1, options.inputs.size()), common);
  const estimation::Estimate estimate = [&] {
    try {
      return estimation::estimate(estimation::Method::map, input.selector.take_series(),
                                  input.selector.head(), settings, bar.callback());
    } catch (const EstimationError& error) {
      throw EstimationError(fmt::format("{}: {}", path, error.what()));
    }
  }();
  for (const std::string& text : estimate.warnings) {
    outcome.warnings.push_back(fmt::format("{}: {}", path, text));
  }
  RangedRecording recording =
      calibration::ranged_recording(estimate, path, input.reader->header().devices.front().serial);
  if (!options.folder.empty() && options.states != "none") {
    write_states_of(estimate, options.states,
                    (std::filesystem::path(options.folder) / states_name(options, number)).string(),
                    provenance_of(common, {path}));
  }
  outcome.angles_s += now() - started;
  return recording;
}

/// Directions of some shots before and after, and where the beams really went.
struct ComparedBeams {
  std::vector<Vector3<double>> before, after, truth;
};

void compare(const RangedRecording& recording, const PrismTrain& calibrated,
             const std::vector<double>& shift, const std::string& truth_path, std::size_t most,
             ComparedBeams& beams) {
  const std::vector<std::size_t> rows = calibration::spread_rows(recording.shots.size(), most);
  std::vector<std::int64_t> times;
  times.reserve(rows.size());
  for (const std::size_t row : rows) times.push_back(recording.time_ns[row]);
  std::sort(times.begin(), times.end());
  const recordings::TruthColumns truth = recordings::load_truth(
      std::filesystem::path(truth_path).replace_extension(".nc").string(), times);
  for (const std::size_t row : rows) {
    const auto found =
        std::lower_bound(truth.time_ns.begin(), truth.time_ns.end(), recording.time_ns[row]);
    if (found == truth.time_ns.end() || *found != recording.time_ns[row]) continue;
    const auto at = static_cast<std::size_t>(found - truth.time_ns.begin());
    std::vector<double> angles;
    for (const auto& column : recording.shots.rotation_angle) angles.push_back(column[row]);
    beams.before.push_back(observe(recording.believed.train, angles).direction);
    for (std::size_t k = 0; k < angles.size(); ++k) angles[k] += shift[k];
    beams.after.push_back(observe(calibrated, angles).direction);
    beams.truth.push_back(direction_from_angles<double>({truth.azimuth[at], truth.zenith[at]}));
  }
}

report::CalibrationReportInput::Truth evaluate_with(const CalibrateCommandOptions& options,
                                                    const std::vector<RangedRecording>& recordings,
                                                    const Calibration& calibration) {
  if (options.truths.size() != recordings.size()) {
    throw InvalidArgument(fmt::format("{} truth files for {} recordings: --truth takes one each",
                                      options.truths.size(), recordings.size()));
  }
  ComparedBeams beams;
  constexpr std::size_t kMostBeams = 50000;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    if (std::filesystem::path(options.truths[r]).extension() != ".yaml") {
      throw InvalidArgument(
          fmt::format("--truth = {}, expected OUT.truth.yaml", options.truths[r]));
    }
    compare(recordings[r], calibration.sensor.train, calibration.angle_shift[r], options.truths[r],
            kMostBeams / recordings.size(), beams);
  }
  report::CalibrationReportInput::Truth errors;
  errors.before = calibration::direction_errors(beams.before, beams.truth);
  errors.after = calibration::direction_errors(beams.after, beams.truth);
  errors.sensor = sensors::load_sensor(options.truths.front());
  for (std::size_t i = 0; i < beams.truth.size(); ++i) {
    const SphericalAngles<double> truth = angles_from_direction(beams.truth[i]);
    const auto add = [&truth](const Vector3<double>& beam, std::vector<double>& azimuth,
                              std::vector<double>& zenith) {
      const SphericalAngles<double> computed = angles_from_direction(beam);
      azimuth.push_back(wrap_to_pi(computed.azimuth - truth.azimuth));
      zenith.push_back(computed.zenith - truth.zenith);
    };
    add(beams.before[i], errors.azimuth_before, errors.zenith_before);
    add(beams.after[i], errors.azimuth_after, errors.zenith_after);
  }
  return errors;
}

/// calibration.yaml, report.json and report.html; what did not converge is no calibration.
void write_folder(const CalibrateCommandOptions& options, const CommonOptions& common,
                  const CalibrationOutcome& outcome) {
  namespace fs = std::filesystem;
  const Calibration& c = outcome.calibration;
  report::Provenance provenance = provenance_of(common, options.inputs);
  provenance.emplace_back("datum", calibration::to_string(c.datum_kind));
  const auto path = [&](const char* name) { return (fs::path(options.folder) / name).string(); };
  if (c.converged) {
    sensors::Sensor calibrated = c.sensor;
    calibrated.provenance = provenance;
    io::write_text_file(path("calibration.yaml"), sensors::preset_text(calibrated));
  } else {
    remove_calibration(options.folder);
  }
  write_report_of(report::calibration_report({c, outcome.nominal, outcome.truth, outcome.reported,
                                              provenance, outcome.warnings}),
                  options.folder);
}

/// Each recording stands for observations of its own.
void check_inputs(const CalibrateCommandOptions& options) {
  for (std::size_t i = 0; i < options.inputs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      std::error_code ignored;
      if (std::filesystem::equivalent(options.inputs[i], options.inputs[j], ignored)) {
        throw InvalidArgument(fmt::format("{} is given twice", options.inputs[i]));
      }
    }
  }
}

ExitStatus run_calibration(const CalibrateCommandOptions& options, const CommonOptions& common) {
  const double started = now();
  if (!options.folder.empty()) make_result_folder(options.folder);
  calibration::CalibrationOptions settings = calibration_options(options, common);
  if (!options.truths.empty() && options.truths.size() != options.inputs.size()) {
    throw InvalidArgument(fmt::format("{} truth files for {} recordings: --truth takes one each",
                                      options.truths.size(), options.inputs.size()));
  }
  check_inputs(options);
  CalibrationOutcome outcome;
  outcome.recordings = options.inputs;
  std::vector<RangedRecording> recordings;
  for (std::size_t r = 0; r < options.inputs.size(); ++r) {
    recordings.push_back(read_and_estimate(options, common, r, outcome));
  }
  settings.sensor = outcome.nominal;
  for (const std::string& text : options.fixed) {
    if (text.find('=') == std::string::npos) {
      settings.fixed.emplace_back(text, std::nullopt);
    } else {
      settings.fixed.emplace_back(parameter_assignment(text, settings.sensor.prisms()));
    }
  }
  const double solving = now();
  {
    ProgressBar bar("calibrating", common);
    outcome.calibration = calibration::calibrate(recordings, settings, bar.callback());
  }
  outcome.solve_s = now() - solving;
  if (!options.truths.empty()) {
    outcome.truth = evaluate_with(options, recordings, outcome.calibration);
  }
  if (!options.folder.empty()) write_folder(options, common, outcome);
  outcome.total_s = now() - started;
  const Calibration& c = outcome.calibration;
  for (const std::string& warning : outcome.warnings) spdlog::warn(warning);
  for (const std::string& warning : c.warnings) spdlog::warn(warning);
  if (!c.converged) spdlog::error("not converged: {}", c.reason);
  if (common.json) {
    print_json(calibration_json(outcome));
  } else {
    print_calibration(outcome);
  }
  return c.converged ? kDone : kNumbersFailed;
}

ExitStatus run_plan(const CalibrateCommandOptions& options, const CommonOptions& common) {
  if (!options.inputs.empty()) throw InvalidArgument("--plan takes no recordings");
  check_numbers(options);
  calibration::CalibrationPlan plan;
  plan.scene = scenes::load_scene(options.plan);
  EstimationWishes wishes{options.sensor, std::nullopt, options.fixed, options.freed};
  if (wishes.sensor.empty()) wishes.sensor = "mid-40";
  const estimation::EstimateOptions chosen = estimate_options(wishes, std::nullopt);
  plan.sensor = chosen.sensor;
  plan.fixed = chosen.fixed;
  plan.additional = chosen.additional;
  check_positive(options.duration_s, "--duration-s", "s");
  plan.duration = options.duration_s;
  if (options.rate_hz != "full") plan.rate = positive_number(options.rate_hz, "--rate-hz", "Hz");
  plan.range_noise = options.noise_range_m;
  plan.prior_sigma = prior_sigma(options);
  plan.range_offset_sigma = options.range_offset_sigma_m;
  plan.beam_origin = options.beam_origin == "yes";
  const calibration::CalibrationForecast forecast = calibration::forecast(plan);
  if (common.json) {
    print_json(forecast_json(forecast, plan.sensor.prisms()));
  } else {
    print_forecast(forecast, plan.sensor.prisms());
  }
  return kDone;
}

}  // namespace

Run declare_calibrate(CLI::App& verb) {
  const auto options = std::make_shared<CalibrateCommandOptions>();
  CalibrateCommandOptions& o = *options;
  verb.add_option("INPUT", o.inputs, "Recordings of one sensor, with ranges to plane walls");
  verb.add_option(
      "-o,--output", o.folder,
      "Folder for calibration.yaml, states.nc (states_1.nc, ...), report.json and report.html");
  verb.add_option("--method", o.method,
                  "adjustment: all recordings together, weighted; paper: unweighted distances from "
                  "SVD planes")
      ->check(CLI::IsMember({"adjustment", "paper"}))
      ->capture_default_str();
  verb.add_option("--planes", o.planes,
                  "Walls by name (YAML); those with a sigma_deg have known normals");
  verb.add_option("--stations", o.stations,
                  "Known rotations of the sensor (YAML), one station per recording in their order");
  verb.add_option("--station", o.station_names,
                  "Station of each recording, in their order, where the file lists others too "
                  "(repeatable)")
      ->type_name("NAME")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--plan", o.plan,
                  "Scene (YAML) to plan for: says what a calibration there would reach")
      ->excludes("--output", "--method", "--planes", "--stations", "--station");
  verb.add_option("--duration-s", o.duration_s, "Length of each planned recording")
      ->needs("--plan")
      ->capture_default_str();
  verb.add_option("--rate-hz", o.rate_hz, "Shots per second to use, or of the plan; 'full' for all")
      ->capture_default_str();
  verb.add_option("--noise-angle-deg", o.noise_angle_deg,
                  "1 sigma of azimuth and zenith before rounding (default: the sensor's)");
  verb.add_option("--noise-range-m", o.noise_range_m,
                  "1 sigma of ranges before rounding (default: the sensor's)");
  verb.add_option("--sensor", o.sensor,
                  "Preset by name, or a preset or calibration file (default: from the recording)");
  add_reading_options(verb, o.reading);
  add_parameter_choice(verb, o.fixed, o.freed);
  verb.add_option("--prior-sigma-deg", o.prior_sigma_deg,
                  "1 sigma of every error angle about what the sensor believes (default: none)");
  verb.add_option("--range-offset-sigma-m", o.range_offset_sigma_m,
                  "Prior of the range offset about 0; 0 holds it there")
      ->capture_default_str();
  verb.add_option("--beam-origin", o.beam_origin,
                  "Start beams where they leave the last prism; 'no': at the sensor's origin")
      ->check(CLI::IsMember({"yes", "no"}))
      ->capture_default_str();
  verb.add_option("--states", o.states, "Which rotor states to write, see estimate")
      ->check(CLI::IsMember({"knots", "all", "none"}))
      ->capture_default_str();
  verb.add_option("--mirror", o.mirror,
                  "Whether the elevation in the files has the opposite sign; auto finds out")
      ->check(CLI::IsMember({"auto", "yes", "no"}))
      ->capture_default_str();
  verb.add_option("--truth", o.truths,
                  "OUT.truth.yaml of each recording's simulation, to judge the calibration by")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  return [options](const CommonOptions& common) {
    // `--truth A B` leaves B among the recordings.
    const auto truth = std::stable_partition(
        options->inputs.begin(), options->inputs.end(),
        [](const std::string& input) { return !input.ends_with(".truth.yaml"); });
    options->truths.insert(options->truths.end(), truth, options->inputs.end());
    options->inputs.erase(truth, options->inputs.end());
    if (!options->plan.empty()) return run_plan(*options, common);
    if (options->inputs.empty()) throw InvalidArgument("INPUT is missing: a recording, or --plan");
    try {
      return run_calibration(*options, common);
    } catch (const EstimationError&) {
      remove_calibration(options->folder);
      throw;
    }
  };
}

}  // namespace risley::app
