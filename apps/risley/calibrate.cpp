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
#include "risley/core/error.hpp"
#include "risley/core/output_file.hpp"
#include "risley/recordings/truth.hpp"
#include "risley/report/calibration_page.hpp"
#include "risley/report/number_text.hpp"
#include "risley/report/states_file.hpp"
#include "risley/sensors/preset.hpp"

#include "command.hpp"
#include "estimation_input.hpp"
#include "observability_text.hpp"
#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using calibration::Calibration;
using calibration::CalibrationForecast;
using calibration::DirectionErrors;
using calibration::FormalDatum;
using calibration::RangedRecording;

struct CalibrateCommandOptions {
  std::vector<std::string> inputs, fixed, freed, station_names, truths;
  std::string folder, method = "adjustment", rate_hz = "full", sensor, planes, stations,
                      beam_origin = "yes", states = "knots", mirror = "auto", plan;
  std::optional<double> noise_angle_deg, noise_range_m, prior_sigma_deg;
  double range_offset_sigma_m = 0.05, duration_s = 10.0;
};

constexpr double kFarBelow = 0.4;  // of the expected residual
constexpr double kLeastAngleNoise = radians_from_degrees(1e-7);

/// Errors of the beams' directions before and after, of all recordings together.
struct TruthErrors {
  DirectionErrors before, after;
  sensors::Sensor sensor;
};

/// Everything one run of the verb found.
struct Outcome {
  Calibration calibration;
  sensors::Sensor nominal;
  std::optional<TruthErrors> truth;
  std::vector<std::string> warnings;  ///< of the recordings
  std::uint64_t observations = 0;
  double read_s = 0, angles_s = 0, solve_s = 0, total_s = 0;
};

double deg(double radians) { return degrees_from_radians(radians); }

double in_file_unit(const std::string& name, double value, int prisms) {
  return value / find_parameter(name, prisms).si_per_unit;
}

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

calibration::CalibrationOptions calibration_options(const CalibrateCommandOptions& options,
                                                    const CommonOptions& common) {
  calibration::CalibrationOptions result;
  if (options.method == "paper") result.method = calibration::CalibrationMethod::paper;
  if (options.noise_range_m) check_positive(*options.noise_range_m, "--noise-range-m", "m");
  result.range_noise = options.noise_range_m;
  if (options.method == "paper" &&
      (!options.planes.empty() || !options.stations.empty() || options.prior_sigma_deg)) {
    throw InvalidArgument(
        "--method paper knows no --planes, --stations and --prior-sigma-deg: its walls are all it "
        "has");
  }
  if (options.prior_sigma_deg) {
    check_positive(*options.prior_sigma_deg, "--prior-sigma-deg", "deg");
    result.prior_sigma = radians_from_degrees(*options.prior_sigma_deg);
  }
  check_not_negative(options.range_offset_sigma_m, "--range-offset-sigma-m", "m");
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

void write_state_file(const CalibrateCommandOptions& options, const CommonOptions& common,
                      const estimation::Estimate& estimate, std::size_t recording) {
  report::StatesContent content;
  content.prisms = estimate.sensor.prisms();
  content.rows = options.states == "all" ? estimate.series.size() : estimate.states.size();
  content.block = [&](estimation::ShotRange rows) {
    return options.states == "all" ? estimation::states_of_shots(estimate, rows)
                                   : estimation::rows_of(estimate.states, rows);
  };
  content.residuals_over_angle = estimate.residuals_over_angle;
  report::write_states(
      (std::filesystem::path(options.folder) / states_name(options, recording)).string(), content,
      provenance_of(common, {options.inputs[recording]}));
}

/// Reads one recording and finds its rotation angles.
RangedRecording read_and_estimate(const CalibrateCommandOptions& options,
                                  const CommonOptions& common, std::size_t number,
                                  Outcome& outcome) {
  const std::string& path = options.inputs[number];
  estimation::SelectionOptions selection;
  selection.ranges = true;
  if (options.rate_hz != "full") {
    selection.rate = positive_number(options.rate_hz, "--rate-hz", "Hz");
  }
  RecordingInput input = read_recording(path, selection, common);
  outcome.read_s += input.seconds;
  outcome.observations += input.audit.observations;
  if (!input.reader->header().has_range) {
    throw EstimationError(
        fmt::format("{} holds no ranges: there is nothing to calibrate on", path));
  }
  estimation::EstimateOptions settings = estimate_options(
      EstimationWishes{options.sensor, options.noise_angle_deg, {}, {}}, input.reader->header());
  if (options.mirror != "auto") settings.mirrored = options.mirror == "yes";
  if (number == 0) outcome.nominal = settings.sensor;
  for (const std::string& text : warning_texts(input.reader->warnings())) {
    outcome.warnings.push_back(fmt::format("{}: {}", path, text));
  }
  const double started = now();
  ProgressBar bar(fmt::format("rotation angles {}/{}", number + 1, options.inputs.size()), common);
  const auto run = [&](estimation::AngleSeries series) {
    try {
      return estimation::estimate(estimation::Method::map, std::move(series), input.selector.head(),
                                  settings, bar.callback());
    } catch (const EstimationError& error) {
      throw EstimationError(fmt::format("{}: {}", path, error.what()));
    }
  };
  estimation::Estimate estimate = run(input.selector.take_series());
  // A noise that was not stated and turns out far smaller than the preset's is taken as found: only
  // the rotation angles are wanted here, and they come out better.
  const double residual = std::hypot(estimate.azimuth_residuals.rms, estimate.zenith_residuals.rms);
  if (!options.noise_angle_deg && residual < kFarBelow * estimate.expected_residual) {
    settings.angle_noise = std::max(residual / std::sqrt(2.0), kLeastAngleNoise);
    if (estimate.mirrored) mirror(estimate.series);
    estimate = run(std::move(estimate.series));
  }
  for (const std::string& text : estimate.warnings) {
    outcome.warnings.push_back(fmt::format("{}: {}", path, text));
  }
  RangedRecording recording =
      calibration::ranged_recording(estimate, path, input.reader->header().devices.front().serial);
  if (!options.folder.empty() && options.states != "none") {
    write_state_file(options, common, estimate, number);
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

TruthErrors evaluate_with(const CalibrateCommandOptions& options,
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
  return {calibration::direction_errors(beams.before, beams.truth),
          calibration::direction_errors(beams.after, beams.truth),
          sensors::load_sensor(options.truths.front())};
}

Json errors_json(const DirectionErrors& e) {
  return {{"azimuth_rmse_deg", deg(e.azimuth_rmse)},
          {"zenith_rmse_deg", deg(e.zenith_rmse)},
          {"azimuth_bias_deg", deg(e.azimuth_bias)},
          {"zenith_bias_deg", deg(e.zenith_bias)},
          {"total_deg", deg(e.total)},
          {"gauge_deg", deg(e.gauge)},
          {"shape_deg", deg(e.shape)}};
}

Json datum_json(calibration::DatumKind kind, const FormalDatum& datum) {
  return {{"kind", calibration::to_string(kind)},      {"sigma_roll_deg", deg(datum.sigma_roll)},
          {"sigma_pitch_deg", deg(datum.sigma_pitch)}, {"sigma_yaw_deg", deg(datum.sigma_yaw)},
          {"sigma_gauge_deg", deg(datum.gauge)},       {"sigma_shape_deg", deg(datum.shape)},
          {"sigma_total_deg", deg(datum.total)}};
}

Json vector_json(const Vector3<double>& v) { return {v.x, v.y, v.z}; }

Json unobservable_json(const std::vector<estimation::WeakDirection>& directions) {
  Json list = Json::array();
  for (const auto& direction : directions) list.push_back(weak_direction_json(direction));
  return list;
}

/// NaN has no place in JSON.
Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json outcome_json(const CalibrateCommandOptions& options, const Outcome& outcome) {
  const Calibration& c = outcome.calibration;
  const int prisms = c.sensor.prisms();
  Json parameters = Json::object(), planes = Json::array(), steps = Json::array(),
       tests = Json::array(), profiles = Json::object();
  for (std::size_t j = 0; j < c.free.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    parameters[c.free[j].name] = {
        {"value", in_file_unit(c.free[j].name, c.parameters[at], prisms)},
        {"sigma",
         finite_or_null(in_file_unit(c.free[j].name, std::sqrt(c.covariance(at, at)), prisms))}};
  }
  for (const calibration::CalibratedPlane& plane : c.planes) {
    planes.push_back({{"name", plane.name},
                      {"recording", options.inputs[plane.recording]},
                      {"normal", vector_json(plane.normal)},
                      {"offset_m", plane.distance},
                      {"points", plane.points},
                      {"outliers", plane.outliers},
                      {"rms_m", plane.rms},
                      {"before_rms_m", plane.rms_before},
                      {"range_sigma_m", plane.range_sigma}});
  }
  for (const calibration::SurfaceStep& step : c.steps) {
    steps.push_back({{"recording", options.inputs[step.recording]},
                     {"plane", c.planes[step.plane].name},
                     {"height_m", step.height},
                     {"azimuth_deg", deg(step.azimuth)},
                     {"zenith_deg", deg(step.zenith)},
                     {"size_deg", deg(step.size)},
                     {"points", step.points}});
  }
  for (const calibration::PriorTest& test : c.prior_tests) {
    tests.push_back({{"name", test.name},
                     {"kind", test.station ? "station" : "plane"},
                     {"misfit_deg", deg(test.misfit)},
                     {"chi2", test.chi2},
                     {"degrees_of_freedom", test.degrees_of_freedom},
                     {"critical", test.critical}});
  }
  for (const calibration::ThicknessProfile& profile : c.profiles) {
    Json rows = Json::array();
    for (std::size_t i = 0; i < profile.count.size(); ++i) {
      if (profile.count[i] == 0) continue;
      rows.push_back({{"from_deg", deg(profile.from[i])},
                      {"to_deg", deg(profile.to[i])},
                      {"points", profile.count[i]},
                      {"before_rms_m", profile.rms_before[i]},
                      {"after_rms_m", profile.rms_after[i]}});
    }
    profiles[profile.variable] = rows;
  }
  std::vector<std::string> warnings = outcome.warnings;
  warnings.insert(warnings.end(), c.warnings.begin(), c.warnings.end());
  Json object = {{"converged", c.converged},
                 {"reason", c.reason},
                 {"method", options.method},
                 {"iterations", c.iterations},
                 {"observations", outcome.observations},
                 {"points", c.points},
                 {"parameters", parameters},
                 {"range_offset_m", {{"value", c.range_offset}, {"sigma", c.range_offset_sigma}}},
                 {"planes", planes},
                 {"steps", steps},
                 {"datum", datum_json(c.datum_kind, c.datum)},
                 {"prior_tests", tests},
                 {"unobservable", unobservable_json(c.unobservable)},
                 {"before", {{"plane_rms_m", c.rms_before}}},
                 {"after", {{"plane_rms_m", c.rms_after}}},
                 {"sigma0", c.sigma0},
                 {"unevenness", c.unevenness},
                 {"variance_factor", c.variance_factor},
                 {"thickness", profiles},
                 {"warnings", warnings},
                 {"seconds",
                  {{"read", outcome.read_s},
                   {"rotation_angles", outcome.angles_s},
                   {"solve", outcome.solve_s},
                   {"total", outcome.total_s}}}};
  if (outcome.truth) {
    object["truth"] = {{"before", errors_json(outcome.truth->before)},
                       {"after", errors_json(outcome.truth->after)}};
  }
  return object;
}

void print_datum(calibration::DatumKind kind, const FormalDatum& datum) {
  fmt::print(
      "datum: {}; 1 sigma of roll {:.2g}, pitch {:.2g}, yaw {:.2g} deg; of the beams against each "
      "other {:.2g} deg\n",
      calibration::to_string(kind), deg(datum.sigma_roll), deg(datum.sigma_pitch),
      deg(datum.sigma_yaw), deg(datum.shape));
}

void print_outcome(const CalibrateCommandOptions& options, const Outcome& outcome) {
  const Calibration& c = outcome.calibration;
  const int prisms = c.sensor.prisms();
  fmt::print("{}\n", c.converged ? "converged" : "NOT CONVERGED: " + c.reason);
  fmt::print(
      "{} points on {} planes, {:.2f} mm thick before, {:.2f} mm after; read {:.2f} s, rotation "
      "angles {:.2f} s, solved {:.2f} s\n\n",
      grouped(c.points), c.planes.size(), 1e3 * c.rms_before, 1e3 * c.rms_after, outcome.read_s,
      outcome.angles_s, outcome.solve_s);
  std::vector<std::string> head = {"parameter", "value", "+- sigma", "unit", "before"};
  if (outcome.truth) head.insert(head.end(), {"truth", "error/sigma"});
  Table table(head);
  for (std::size_t j = 0; j < c.free.size(); ++j) {
    const std::string& name = c.free[j].name;
    const auto at = static_cast<Eigen::Index>(j);
    const double sigma = in_file_unit(name, std::sqrt(c.covariance(at, at)), prisms);
    const double value = in_file_unit(name, c.parameters[at], prisms);
    const report::NumberText text = report::number_text(value, sigma);
    std::vector<std::string> row = {
        name, text.value, text.sigma, find_parameter(name, prisms).unit,
        report::text_to_place_of(in_file_unit(name, c.believed.get(name), prisms), sigma)};
    if (outcome.truth) {
      const double truth = in_file_unit(name, outcome.truth->sensor.get(name), prisms);
      row.push_back(report::text_to_place_of(truth, sigma));
      row.push_back(fmt::format("{:.2f}", (value - truth) / sigma));
    }
    table.add(row);
  }
  if (c.range_offset_sigma > 0) {
    const report::NumberText text =
        report::number_text(1e3 * c.range_offset, 1e3 * c.range_offset_sigma);
    table.add({"range offset", text.value, text.sigma, "mm", "0"});
  }
  table.print();
  fmt::print("\n");
  Table planes({"plane", "recording", "distance m", "points", "outliers", "before mm", "after mm"});
  for (const calibration::CalibratedPlane& plane : c.planes) {
    planes.add(
        {plane.name, std::filesystem::path(options.inputs[plane.recording]).filename().string(),
         fmt::format("{:.3f}", plane.distance), grouped(plane.points), grouped(plane.outliers),
         fmt::format("{:.2f}", 1e3 * plane.rms_before), fmt::format("{:.2f}", 1e3 * plane.rms)});
  }
  planes.print();
  fmt::print("\n");
  print_datum(c.datum_kind, c.datum);
  for (const calibration::PriorTest& test : c.prior_tests) {
    if (test.degrees_of_freedom == 0) {
      fmt::print("{} {}: not tested by these data\n", test.station ? "station" : "plane",
                 test.name);
      continue;
    }
    fmt::print("{} {}: misfit {:.3g} deg, chi2 {:.3g}, limit {:.3g}\n",
               test.station ? "station" : "plane", test.name, deg(test.misfit), test.chi2,
               test.critical);
  }
  if (outcome.truth) {
    fmt::print("\n");
    Table errors(
        {"error, deg", "azimuth rmse", "zenith rmse", "total", "shared rotation", "shape"});
    const auto add = [&errors](const char* name, const DirectionErrors& e) {
      errors.add({name, fmt::format("{:.5f}", deg(e.azimuth_rmse)),
                  fmt::format("{:.5f}", deg(e.zenith_rmse)), fmt::format("{:.5f}", deg(e.total)),
                  fmt::format("{:.5f}", deg(e.gauge)), fmt::format("{:.5f}", deg(e.shape))});
    };
    add("before", outcome.truth->before);
    add("after", outcome.truth->after);
    errors.print();
  }
}

/// calibration.yaml and report.html; what did not converge is no calibration.
void write_folder(const CalibrateCommandOptions& options, const CommonOptions& common,
                  const Outcome& outcome) {
  namespace fs = std::filesystem;
  const Calibration& c = outcome.calibration;
  std::vector<std::pair<std::string, std::string>> provenance =
      provenance_of(common, options.inputs);
  provenance.emplace_back("datum", calibration::to_string(c.datum_kind));
  if (c.range_offset_sigma > 0) {
    provenance.emplace_back("range_offset_m", fmt::format("{}", c.range_offset));
    provenance.emplace_back("range_offset_sigma_m", fmt::format("{}", c.range_offset_sigma));
  }
  const auto path = [&](const char* name) { return (fs::path(options.folder) / name).string(); };
  if (c.converged) {
    sensors::Sensor calibrated = c.sensor;
    calibrated.provenance = provenance;
    write_text_file(path("calibration.yaml"), sensors::preset_text(calibrated));
  } else {
    remove_calibration(options.folder);
  }
  std::vector<std::string> names;
  for (const std::string& input : options.inputs) {
    names.push_back(fs::path(input).filename().string());
  }
  std::optional<report::CalibrationPageInput::Truth> truth;
  if (outcome.truth) {
    truth = {outcome.truth->before, outcome.truth->after, outcome.truth->sensor};
  }
  write_text_file(path("report.html"),
                  report::calibration_page({c, outcome.nominal, truth, names, outcome.observations,
                                            provenance, outcome.warnings}));
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
  Outcome outcome;
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
    print_json(outcome_json(options, outcome));
  } else {
    print_outcome(options, outcome);
  }
  return c.converged ? kDone : kNumbersFailed;
}

Json forecast_json(const CalibrationForecast& f, int prisms) {
  Json parameters = Json::object(), walls = Json::array();
  for (std::size_t j = 0; j < f.free.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    parameters[f.free[j].name] = {
        {"sigma",
         finite_or_null(in_file_unit(f.free[j].name, std::sqrt(f.covariance(at, at)), prisms))}};
  }
  for (const calibration::PlannedWall& wall : f.walls) {
    walls.push_back({{"name", wall.name},
                     {"station", wall.station},
                     {"share", wall.share},
                     {"mean_incidence_deg", deg(wall.mean_incidence)},
                     {"mean_range_m", wall.mean_range}});
  }
  return {{"parameters", parameters},
          {"range_offset_m", {{"sigma", finite_or_null(f.range_offset_sigma)}}},
          {"datum", datum_json(f.datum_kind, f.datum)},
          {"unobservable", unobservable_json(f.unobservable)},
          {"walls", walls},
          {"observations", f.shots},
          {"advice", f.advice}};
}

void print_forecast(const CalibrationForecast& f, int prisms) {
  fmt::print("{:.3g} shots meet a wall\n\n", f.shots);
  Table walls({"wall", "station", "share %", "incidence deg", "range m"});
  for (const calibration::PlannedWall& wall : f.walls) {
    walls.add({wall.name, wall.station, fmt::format("{:.1f}", 100 * wall.share),
               fmt::format("{:.1f}", deg(wall.mean_incidence)),
               fmt::format("{:.1f}", wall.mean_range)});
  }
  walls.print();
  fmt::print("\n");
  Table table({"parameter", "sigma", "unit"});
  for (std::size_t j = 0; j < f.free.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const std::string& name = f.free[j].name;
    table.add({name,
               fmt::format("{:.2g}", in_file_unit(name, std::sqrt(f.covariance(at, at)), prisms)),
               find_parameter(name, prisms).unit});
  }
  table.print();
  fmt::print("\n");
  print_datum(f.datum_kind, f.datum);
  fmt::print("expected error of a direction: {:.2g} deg\n", deg(f.datum.total));
  for (const auto& weak : f.unobservable) {
    fmt::print("not told by these walls: {}\n", direction_text(weak));
  }
  for (const std::string& words : f.advice) fmt::print("advice: {}\n", words);
}

ExitStatus run_plan(const CalibrateCommandOptions& options, const CommonOptions& common) {
  if (!options.inputs.empty()) throw InvalidArgument("--plan takes no recordings");
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
  if (options.noise_range_m) check_positive(*options.noise_range_m, "--noise-range-m", "m");
  plan.range_noise = options.noise_range_m;
  if (options.prior_sigma_deg) {
    check_positive(*options.prior_sigma_deg, "--prior-sigma-deg", "deg");
    plan.prior_sigma = radians_from_degrees(*options.prior_sigma_deg);
  }
  check_not_negative(options.range_offset_sigma_m, "--range-offset-sigma-m", "m");
  plan.range_offset_sigma = options.range_offset_sigma_m;
  plan.beam_origin = options.beam_origin == "yes";
  const CalibrationForecast forecast = calibration::forecast(plan);
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
  verb.add_option("-o,--output", o.folder,
                  "Folder for calibration.yaml, states.nc (states_1.nc, ...) and report.html");
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
