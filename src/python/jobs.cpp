// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>

#include "risley/core/error.hpp"
#include "risley/core/require.hpp"
#include "risley/core/setting.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/campaign.hpp"
#include "risley/jobs/cloud_of_recording.hpp"
#include "risley/jobs/cloud_of_stations.hpp"
#include "risley/jobs/compare_clouds.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/compare_units.hpp"
#include "risley/jobs/identify_recording.hpp"
#include "risley/jobs/inspect_recording.hpp"
#include "risley/jobs/inspect_trajectory.hpp"
#include "risley/jobs/observability.hpp"
#include "risley/jobs/pattern_details.hpp"
#include "risley/jobs/plan_calibration.hpp"
#include "risley/jobs/plan_flight.hpp"
#include "risley/jobs/simulation_settings.hpp"
#include "risley/jobs/write_pattern.hpp"
#include "risley/json/many_results.hpp"
#include "risley/report/report_file.hpp"
#include "risley/simulation/truth_file.hpp"

#include "python/arrays.hpp"
#include "python/call.hpp"
#include "python/json.hpp"
#include "python/names.hpp"
#include "python/options.hpp"
#include "python/results.hpp"
#include "python/rotors.hpp"

namespace risley::python {
namespace {

using jobs::CalibratedFlight;
using jobs::CalibratedRecordings;
using jobs::EstimatedRecording;
using jobs::NamedText;

template <class Found>
const auto& solution_of(const Found& found) {
  if constexpr (requires { found.estimate; }) {
    return found.estimate;
  } else if constexpr (requires { found.forecast; }) {
    return found.forecast;
  } else {
    return found.calibration;
  }
}

py::list list_of(const std::vector<double>& numbers) { return py::cast(numbers); }
py::list list_of(const Eigen::MatrixXd& matrix) {
  py::list rows;
  for (const auto& row : matrix.rowwise()) {
    rows.append(std::vector<double>(row.begin(), row.end()));
  }
  return rows;
}

/// An array; if numpy is not installed, a list.
template <auto column>
py::object numbers_of(const ValueTable& table) {
  try {
    return array_of(table.*column);
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_ImportError)) throw;
    return list_of(table.*column);
  }
}

/// Columns with the covariance, which JSON does not have.
template <class Found>
ValueTable table_with_covariance(const Found& found) {
  const auto& solution = solution_of(found);
  ValueTable table = table_of(json::of(found));
  table.covariance = solution.covariance;
  if constexpr (requires { solution.free; }) {
    for (const auto& free : solution.free) table.covariance_names.push_back(si_name(free.name));
  } else {
    table.covariance_names = table.names;
  }
  return table;
}

/// The page of a result and its numbers, as written by `-o DIR` of the command.
template <class Found>
std::vector<NamedText> texts_of(const Found& found) {
  const report::Report report = report::report_of(found);
  return {{"report.json", report::report_text(report)},
          {"report.html", report::report_page(report)}};
}

/// A page's details of an estimate take time; calibrations always have them.
template <class Found>
void make_details(Found& found, const py::object& on_progress) {
  if constexpr (std::is_same_v<Found, EstimatedRecording>) {
    if (found.details) return;
    std::optional<jobs::EstimateDetails> details;
    run_job(on_progress, 0, [&](const Progress& progress) {
      details = jobs::estimate_details(found.estimate, found.nominal, found.head, found.evaluation,
                                       progress.stage("judging"));
    });
    found.details = std::move(details);
  }
}

/// Common members of all results: the Python interface builds its objects from these.
template <class Found>
py::class_<Found, std::shared_ptr<Found>> bind_found(py::module_& module, const char* name) {
  py::class_<Found, std::shared_ptr<Found>> type(module, name);
  type.def_property_readonly("sensor",
                             [](const Found& found) { return solution_of(found).sensor; });
  type.def_property_readonly("table", &table_with_covariance<Found>);
  type.def_property_readonly("html", [](const Found& found) { return html_of(json::of(found)); });
  type.def_property_readonly("text", [](const Found& found) { return text_of(json::of(found)); });
  type.def("to_dict", [](const Found& found) { return dict_of(json::of(found)); });
  type.def(
      "report_text",
      [](Found& found, const py::object& on_progress) {
        make_details(found, on_progress);
        return unlocked([&] { return report::report_text(report::report_of(found)); });
      },
      py::arg("on_progress"));
  return type;
}

void write_page(const std::string& report, const std::string& path) {
  unlocked([&] {
    io::write_text_file(path,
                        report::report_page(report::parse_report(report, "a result of Python")));
  });
}

/// Runs a job and returns its result to Python.
template <class Job>
auto found_by(const py::object& on_progress, int threads, const Job& job) {
  using Found = std::invoke_result_t<const Job&, const Progress&>;
  auto found = std::make_shared<Found>();
  run_job(on_progress, threads, [&](const Progress& progress) { *found = job(progress); });
  return found;
}
/// The same as a dictionary.
template <class Job>
py::object answer_of(const py::object& on_progress, int threads, const Job& job) {
  return dict_of(json::of(*found_by(on_progress, threads, job)));
}

/// 'auto', 'paper', 'none', or the random walk of the speeds, (rad/s) / sqrt(s).
std::optional<estimation::RotorProcess> rotor_process(const Options& options) {
  estimation::RotorProcess process = estimation::kPaperProcess;
  if (options.is<py::str>("process_noise")) {
    const std::size_t word = options.choice("process_noise", {"auto", "paper", "none"});
    if (word == 0) return std::nullopt;
    return word == 1 ? process : estimation::kConstantAcceleration;
  }
  if (!options.has("process_noise")) return std::nullopt;
  options.take("process_noise", process.acceleration);
  require_positive(kSetting.process_noise, process.acceleration);
  return process;
}

jobs::EstimateRecordingOptions estimate_options(const Options& options) {
  jobs::EstimateRecordingOptions job;
  job.recording = recording_source(options, "recording");
  job.reading = read_options(options);
  options.take("sensor", job.sensor);
  constexpr std::array kMethods = {estimation::Method::map, estimation::Method::ekf};
  job.method = kMethods.at(options.choice("method", {"map", "ekf"}));
  job.rate = jobs::usual_rate(job.method);
  take_rate(options, job.rate);
  options.take("noise_angle", job.angle_noise);
  job.fixed = held_parameters(options);
  job.additional = parameter_names(options, "free");
  job.rotor_process = rotor_process(options);
  options.take("noise_model", job.noise_model);
  options.take("mirror", job.mirrored);
  options.take("truth", job.truth);
  job.files = result_files(options, "estimate");
  job.details = !job.files.folder.empty();
  job.texts = [](const EstimatedRecording& found) { return texts_of(found); };
  return job;
}

std::shared_ptr<EstimatedRecording> estimate(const py::dict& values, int threads,
                                             const py::object& on_progress) {
  return found_by(on_progress, threads,
                  [job = estimate_options(Options(values))](const Progress& progress) {
                    return jobs::estimate_recording(job, progress);
                  });
}

/// What calibrations and plans share.
template <class Job>
void take_model(const Options& options, Job& job) {
  options.take("sensor", job.sensor);
  job.fixed = held_parameters(options);
  job.additional = parameter_names(options, "free");
  take_rate(options, job.rate);
  options.take("noise_range", job.range_noise);
  options.take("prior_sigma", job.prior_sigma);
  options.take("range_offset_sigma", job.range_offset_sigma);
}

/// Common options of calibrations on walls and in flight.
template <class Job>
void take_recordings(const Options& options, Job& job) {
  take_model(options, job);
  job.recordings = recording_sources(options, "recordings");
  job.reading = read_options(options);
  options.take("noise_angle", job.angle_noise);
  options.take("mirror", job.mirrored);
  options.take("seed", job.seed);
  options.take("truth", job.truths);
  options.take("tolerance", job.tolerance);
  options.take("force", job.force);
  job.files = result_files(options, "calibrate");
  job.details = true;
}

/// Squares of ground and knots of a flight.
template <class Job>
void take_grid(const Options& options, Job& job) {
  options.take("knot_spacing", job.knot_spacing);
  options.take("cell_size", job.cell_size);
}

jobs::CalibrateRecordingsOptions calibrate_options(const Options& options) {
  jobs::CalibrateRecordingsOptions job;
  take_recordings(options, job);
  constexpr std::array kMethods = {calibration::CalibrationMethod::adjustment,
                                   calibration::CalibrationMethod::paper};
  job.method = kMethods.at(options.choice("method", {"adjustment", "paper"}));
  options.take("beam_origin", job.beam_origin);
  job.flat_walls = options.choice("walls", {"uneven", "flat"}) == 1;
  options.take("patch_thickness", job.patch_thickness);
  if (std::optional<bool> same; options.take("same_walls", same), same) {
    job.same_walls = *same ? calibration::SameWalls::yes : calibration::SameWalls::no;
  }
  std::string planes, stations;
  std::vector<std::string> station_names;
  options.take("planes", planes);
  options.take("stations", stations);
  options.take("station", station_names);
  if (!planes.empty()) job.planes = scenes::load_scene(planes);
  job.stations = jobs::stations_of(stations, station_names, job.recordings.size());
  job.texts = [](const CalibratedRecordings& found) { return texts_of(found); };
  return job;
}

std::shared_ptr<CalibratedRecordings> calibrate(const py::dict& values, int threads,
                                                const py::object& on_progress) {
  return found_by(on_progress, threads,
                  [job = calibrate_options(Options(values))](const Progress& progress) {
                    return jobs::calibrate_recordings(job, progress);
                  });
}

std::shared_ptr<CalibratedFlight> calibrate_flight(const py::dict& values, int threads,
                                                   const py::object& on_progress) {
  const Options options(values);
  jobs::CalibrateFlightOptions job;
  take_recordings(options, job);
  take_grid(options, job);
  job.platform = platform_files(options);
  options.take("control", job.control);
  job.texts = [](const CalibratedFlight& found) { return texts_of(found); };
  return found_by(on_progress, threads,
                  [&](const Progress& progress) { return jobs::calibrate_flight(job, progress); });
}

std::shared_ptr<jobs::PlannedCalibration> plan(const py::dict& values,
                                               const py::object& on_progress) {
  const Options options(values);
  jobs::PlanCalibrationOptions job;
  take_model(options, job);
  std::string scene;
  options.take("plan", scene);
  job.scene = scenes::load_scene(scene);
  options.take("duration", job.duration);
  job.flat_walls = options.choice("walls", {"uneven", "flat"}) == 1;
  options.take("beam_origin", job.beam_origin);
  return found_by(on_progress, 0,
                  [&](const Progress& progress) { return jobs::plan_calibration(job, progress); });
}

std::shared_ptr<jobs::PlannedFlightResult> plan_flight(const py::dict& values,
                                                       const py::object& on_progress) {
  const Options options(values);
  jobs::PlanFlightOptions job;
  take_model(options, job);
  take_grid(options, job);
  options.take("empty_circle", job.distribution.empty_circle);
  require_positive(kSetting.empty_circle, job.distribution.empty_circle);
  options.take("seed", job.seed);
  jobs::FlightPlanFiles files;
  options.take("plan", files.plan);
  options.take("mount", files.mount);
  options.take("trajectory_errors", files.errors);
  options.take("scene", files.scene);
  jobs::load_flight_plan(files, job);
  return found_by(on_progress, 0,
                  [&](const Progress& progress) { return jobs::plan_flight(job, progress); });
}

/// Bindings of a plan.
template <class Planned>
void bind_planned(py::module_& module, const char* name) {
  py::class_<Planned, std::shared_ptr<Planned>>(module, name)
      .def_property_readonly("table", &table_with_covariance<Planned>)
      .def("to_dict", [](const Planned& planned) { return dict_of(json::of(planned)); });
}

py::object cloud(const py::dict& values, int threads, const py::object& on_progress) {
  return answer_of(on_progress, threads,
                   [job = cloud_options(Options(values))](const Progress& progress) {
                     return jobs::cloud_of_recording(job, progress);
                   });
}

py::object cloud_of_stations(const py::dict& values, int threads, const py::object& on_progress) {
  const Options options(values);
  jobs::CloudOfStationsOptions job;
  options.take("station", job.stations);
  const jobs::CloudOfRecordingOptions one = cloud_options(options);
  job.recordings = recording_sources(options, "recordings");
  job.reading = one.reading;
  job.calibration = one.calibration;
  job.crs = one.platform.crs;
  job.datum = one.platform.datum;
  job.output = one.output;
  job.cloud = one.cloud;
  return answer_of(on_progress, threads, [&](const Progress& progress) {
    return jobs::cloud_of_stations(job, progress);
  });
}

py::object simulate(const py::dict& values, int threads, const py::object& on_progress) {
  const Options options(values);
  jobs::SimulationOptions job = simulation_options(options, threads);
  std::string output;
  options.take("output", output);
  options.take("duration", job.duration);
  options.take("rate", job.rate);
  options.take("trajectory", job.trajectory);
  options.take("trajectory_topic", job.topic);
  options.take("flight", job.flight);
  options.take("mount", job.mount);
  options.take("trajectory_errors", job.trajectory_errors);
  if (options.has("trajectory_format")) {
    options.take("trajectory_format", job.trajectory_ending);
    job.trajectory_ending.insert(0, ".");
  }
  options.take("start", job.start);
  options.take("clock_drift", job.clock_drift);
  bags::LidarTopicOptions messages;
  take_messages(options, messages);
  return answer_of(on_progress, threads, [&](const Progress& progress) {
    simulation::SimulationSettings settings = jobs::simulation_settings(job);
    settings.writing.messages = messages;
    return simulation::simulate_to_file(settings, output, provenance_of("simulate"), progress);
  });
}

py::object identify(const py::dict& values, int threads, const py::object& on_progress) {
  const Options options(values);
  jobs::IdentifyRecordingOptions job;
  job.recording = recording_source(options, "recording");
  job.reading = read_options(options);
  options.take("most_prisms", job.identify.most_prisms);
  options.take("fastest", job.identify.fastest);
  require_above("fastest", job.identify.fastest, 0, "rad/s");
  options.take("output", job.output);
  options.take("force", job.undecided);
  job.provenance = provenance_of("identify");
  const auto found = found_by(on_progress, threads, [&](const Progress& progress) {
    return jobs::identify_recording(job, progress);
  });
  return py::make_tuple(found->sensor.sensor, dict_of(json::of(*found)));
}

sensors::ScanPatternOptions scan_options(const Options& options) {
  sensors::ScanPatternOptions scan;
  options.take("rate", scan.shot_rate);
  options.take("every", scan.every);
  options.take("start_angles", scan.rotation_angle);
  if (options.has("firing")) {
    scan.firing = options.choice("firing", {"in-turn", "together"}) == 0
                      ? sensors::Firing::in_turn
                      : sensors::Firing::together;
  }
  return scan;
}

py::object pattern(const py::dict& values, int threads, const py::object& on_progress) {
  const Options options(values);
  jobs::WritePatternOptions job;
  options.take("sensor", job.sensor);
  options.take("format", job.format);
  options.take("output", job.output);
  options.take("duration", job.duration);
  require_positive(kSetting.duration, job.duration);
  job.scan = scan_options(options);
  return answer_of(on_progress, threads,
                   [&](const Progress& progress) { return jobs::write_pattern(job, progress); });
}

/// Directions of a scan [rows, 3] in the requested precision.
template <class Number>
py::array directions(const sensors::Sensor& sensor, const jobs::PatternRows& rows,
                     const sensors::ScanPatternOptions& scan, int threads,
                     const py::object& on_progress) {
  py::array_t<Number> array({static_cast<py::ssize_t>(rows.count), py::ssize_t{3}});
  const std::span<Number> out(array.mutable_data(), 3 * rows.count);
  run_job(on_progress, threads, [&](const Progress& progress) {
    jobs::pattern_directions(sensor, rows.first, out, scan, progress);
  });
  return array;
}

struct Scan {
  sensors::Sensor sensor;
  sensors::ScanPatternOptions options;
  jobs::PatternRows rows;

  explicit Scan(const Options& given) : options(scan_options(given)) {
    jobs::GivenSensor chosen;
    double start = 0, duration = 1;
    given.take("sensor", chosen);
    given.take("start", start);
    given.take("duration", duration);
    sensor = unlocked([&] { return jobs::load_result(chosen); });
    rows = jobs::pattern_rows(sensor, start, duration, options);
  }
};

py::array pattern_directions(const py::dict& values, int threads, const py::object& on_progress) {
  const Options options(values);
  const Scan scan(options);
  return options.choice("dtype", {"float64", "float32"}) == 0
             ? directions<double>(scan.sensor, scan.rows, scan.options, threads, on_progress)
             : directions<float>(scan.sensor, scan.rows, scan.options, threads, on_progress);
}

/// Times, s, and emitters of the same rows.
py::tuple pattern_times(const py::dict& values) {
  const Scan scan{Options(values)};
  sensors::ScanPattern found = unlocked([&] {
    return sensors::scan_times(scan.sensor, scan.rows.first, scan.rows.count, scan.options);
  });
  return py::make_tuple(array_of(std::move(found.time)), array_of(std::move(found.emitter)));
}

py::object coverage(const py::dict& values, int threads, const py::object& on_progress) {
  const Options options(values);
  jobs::GivenSensor sensor;
  options.take("sensor", sensor);
  sensors::CoverageOptions settings;
  options.take("after", settings.after);
  options.take("cell", settings.cell);
  const sensors::ScanPatternOptions scan = scan_options(options);
  const auto found = found_by(on_progress, threads, [&](const Progress& progress) {
    return jobs::pattern_details(sensor, scan, settings, progress);
  });
  return dict_of(json::of(found->coverage));
}

py::object observability(const py::dict& values, int threads, const py::object& on_progress) {
  const Options options(values);
  jobs::ObservabilityOptions job;
  job.recording = recording_source(options, "recording");
  job.reading = read_options(options);
  options.take("sensor", job.sensor);
  options.take("duration", job.duration);
  take_rate(options, job.rate);
  options.take("noise_angle", job.angle_noise);
  options.take("rounding", job.rounding);
  job.fixed = held_parameters(options);
  job.additional = parameter_names(options, "free");
  return answer_of(on_progress, threads, [&](const Progress& progress) {
    return jobs::judge_observability(job, progress);
  });
}

py::object compare(const py::dict& values, const py::object& on_progress) {
  const Options options(values);
  jobs::CompareUnitsOptions job;
  options.take("results", job.results);
  std::vector<std::string> names;
  for (const jobs::GivenSensor& result : job.results) names.push_back(result.name());
  if (jobs::are_clouds(names)) {
    jobs::CompareCloudsOptions clouds{names[0], names[1], {}};
    options.take("cell_size", clouds.change.cell);
    options.take("reach", clouds.change.reach);
    options.take("false_alarm", clouds.change.false_alarm);
    return answer_of(on_progress, 0, [&](const Progress& progress) {
      return jobs::compare_clouds(clouds, progress);
    });
  }
  options.take("false_alarm", job.false_alarm);
  options.take("anywhere", job.anywhere);
  options.take("unlike", job.unlike);
  return answer_of(on_progress, 0,
                   [&](const Progress& progress) { return jobs::compare_units(job, progress); });
}

py::object campaign(const py::dict& values, int threads, const py::object& on_progress) {
  const Options options(values);
  std::string path, table;
  options.take("plan", path);
  options.take("table", table);
  jobs::CampaignOptions job{"", "risley " RISLEY_VERSION};
  options.take("output", job.folder);
  bool merge = false;
  options.take("merge", merge);
  std::uint64_t seed = 0;
  options.take("seed", seed);
  if (options.has("chunk")) {
    jobs::ChunkNumber which;
    options.take("chunk", which.number);
    options.take("chunks", which.count);
    return answer_of(on_progress, threads, [&](const Progress& progress) {
      return jobs::run_chunk(jobs::load_campaign_plan(path, seed), which, job, progress);
    });
  }
  return answer_of(on_progress, threads, [&](const Progress& progress) {
    const jobs::CampaignPlan plan = jobs::load_campaign_plan(path, seed);
    return merge ? jobs::merge_chunks(plan, table, job, progress)
                 : jobs::run_campaign(plan, table, job, progress);
  });
}

json::InspectEachOptions inspect_options(const Options& options) {
  json::InspectEachOptions job;
  job.reading = read_options(options);
  options.take("accuracy", job.accuracy);
  options.take("trajectory_topic", job.topic);
  return job;
}

py::object info(const py::dict& values, const py::object& on_progress) {
  const Options options(values);
  const recordings::Source input = recording_source(options, "recording");
  json::InspectEachOptions job = inspect_options(options);
  json::Json found;
  run_job(on_progress, 0, [&](const Progress& progress) {
    const jobs::InspectTrajectoryOptions poses{input.name(), job.accuracy, job.topic};
    found = !input.recording() && jobs::is_trajectory(poses, job.reading, progress)
                ? json::of(jobs::inspect_trajectory(poses, progress))
                : json::of(jobs::inspect_recording({input, job.reading, {}, {}}, progress));
  });
  return dict_of(found);
}

/// How a job of the command is run for each of many inputs.
jobs::InputWork work_of(const std::string& verb, const Options& options) {
  const auto untold = [](const std::string&, bool) {};  // results have their warnings
  if (verb == "estimate") return json::estimate_each(estimate_options(options), untold);
  if (verb == "calibrate") return json::calibrate_each(calibrate_options(options), untold);
  if (verb == "cloud") return json::cloud_each(cloud_options(options), {}, untold);
  if (verb == "info") return json::inspect_each(inspect_options(options), untold);
  json::ConvertEachOptions convert{inspect_options(options), {}, {}};
  options.take("format", convert.format);
  return json::convert_each(convert, untold);
}

/// Settings as text, to compare with those of earlier results.
std::vector<std::pair<std::string, std::vector<std::string>>> settings_of(const py::dict& values) {
  std::vector<std::pair<std::string, std::vector<std::string>>> settings;
  for (const auto& [name, value] : values) {
    if (py::str(name).equal(py::str("output"))) continue;
    const bool in_memory = py::hasattr(value, "to_text");  // its repr omits the content
    settings.push_back({py::str(name), {py::str(in_memory ? value.attr("to_text")() : value)}});
  }
  return settings;
}

/// @param many  inputs, list, table, resume
py::object run_many(const std::string& verb, const py::dict& values, const py::dict& many,
                    int threads, const py::object& on_progress) {
  const Options options(many);
  jobs::ManyInputsOptions wanted;
  options.take("inputs", wanted.names);
  options.take("list", wanted.list);
  options.take("table", wanted.table);
  options.take("resume", wanted.resume);
  Options(values).take("output", wanted.output);
  wanted.into_folder = true;
  const jobs::InputWork work = work_of(verb, Options(values));
  const auto settings = settings_of(values);
  json::Json answer;
  run_job(on_progress, threads, [&](const Progress& progress) {
    const jobs::InputPlan plan = jobs::plan_inputs(wanted, work, progress.silent());
    jobs::InputRun run(
        plan, work,
        jobs::work_text(fmt::format("risley.{} {}", verb, RISLEY_VERSION), settings, progress),
        wanted);
    const bool whole = run.run(progress.stage(work.label));
    if (!wanted.table.empty())
      json::write_table(wanted.table, run, provenance_of(work.verb.c_str()));
    if (!whole) throw Cancelled();
    answer = json::counts_of(run, work);
    answer["results"] = json::Json::array();
    run.for_each([&](const jobs::InputJob& job, const jobs::InputResult& result) {
      answer["results"].push_back(json::one_of_several(job, result));
    });
    answer["rows"] = json::rows_of(run, RISLEY_VERSION);
  });
  return dict_of(answer);
}

}  // namespace

void bind_jobs(py::module_& module) {
  py::class_<ValueTable>(module, "ValueTable")
      .def_readonly("names", &ValueTable::names)
      .def_readonly("units", &ValueTable::units)
      .def_property_readonly("values", &numbers_of<&ValueTable::values>)
      .def_property_readonly("sigmas", &numbers_of<&ValueTable::sigmas>)
      .def_property_readonly("sigmas_given_held", &numbers_of<&ValueTable::sigmas_given_held>)
      .def_readonly("covariance_names", &ValueTable::covariance_names)
      .def_property_readonly("covariance", &numbers_of<&ValueTable::covariance>);
  bind_found<EstimatedRecording>(module, "EstimatedRecording")
      .def_property_readonly("residuals",
                             [](const EstimatedRecording& found) {
                               estimation::ShotResiduals residuals =
                                   residuals_of_shots(found.estimate);
                               return py::make_tuple(array_of(std::move(residuals.azimuth)),
                                                     array_of(std::move(residuals.zenith)));
                             })
      .def_property_readonly("motion", [](const EstimatedRecording& found) {
        return unlocked([&] { return motion_of(found.estimate); });
      });
  bind_found<CalibratedRecordings>(module, "CalibratedRecordings");
  bind_found<CalibratedFlight>(module, "CalibratedFlight")
      .def_property_readonly("mount",
                             [](const CalibratedFlight& found) { return found.calibration.mount; })
      .def_property_readonly("trajectory", [](const CalibratedFlight& found) {
        return std::make_shared<trajectories::Trajectory>(found.calibration.trajectory);
      });
  bind_planned<jobs::PlannedCalibration>(module, "PlannedCalibration");
  bind_planned<jobs::PlannedFlightResult>(module, "PlannedFlight");
  module.def("write_page", &write_page, py::arg("report"), py::arg("path"));
  const auto options = py::arg("options");
  const auto threads = py::arg("threads");
  const auto on_progress = py::arg("on_progress");
  module.def("estimate", &estimate, options, threads, on_progress);
  module.def("calibrate", &calibrate, options, threads, on_progress);
  module.def("calibrate_flight", &calibrate_flight, options, threads, on_progress);
  module.def("plan", &plan, options, on_progress);
  module.def("plan_flight", &plan_flight, options, on_progress);
  module.def("cloud", &cloud, options, threads, on_progress);
  module.def("cloud_of_stations", &cloud_of_stations, options, threads, on_progress);
  module.def("simulate", &simulate, options, threads, on_progress);
  module.def("identify", &identify, options, threads, on_progress);
  module.def("pattern", &pattern, options, threads, on_progress);
  module.def("pattern_directions", &pattern_directions, options, threads, on_progress);
  module.def("pattern_times", &pattern_times, options);
  module.def("coverage", &coverage, options, threads, on_progress);
  module.def("observability", &observability, options, threads, on_progress);
  module.def("compare", &compare, options, on_progress);
  module.def("campaign", &campaign, options, threads, on_progress);
  module.def("info", &info, options, on_progress);
  module.def("run_many", &run_many, py::arg("verb"), options, py::arg("many"), threads,
             on_progress);
  module.def(
      "is_flight_plan",
      [](const std::string& path) { return unlocked([&] { return jobs::is_flight_plan(path); }); },
      py::arg("path"));
}

}  // namespace risley::python
