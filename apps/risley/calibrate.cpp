// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/setting.hpp"
#include "risley/jobs/calibrate_flight.hpp"
#include "risley/jobs/calibrate_recordings.hpp"
#include "risley/jobs/inputs.hpp"
#include "risley/jobs/plan_calibration.hpp"
#include "risley/jobs/plan_flight.hpp"

#include "calibration_text.hpp"
#include "command.hpp"
#include "flight_text.hpp"
#include "many_files.hpp"
#include "parameter_choice.hpp"
#include "plan_flight.hpp"
#include "platform_options.hpp"
#include "reading_options.hpp"
#include "result_folder.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

using calibration::CalibrationCode;
using jobs::CalibratedRecordings;

struct CalibrateCommandOptions {
  std::vector<std::string> station_names, truths;
  jobs::ManyInputsOptions many;  ///< with the recordings and the folder of results
  jobs::PlatformFiles platform;
  std::string method = "adjustment", rate_hz = "full", sensor, planes, control, stations,
              beam_origin = "yes", walls = "uneven", states = "knots", mirror = "auto", plan, scene,
              page;
  std::optional<double> noise_angle_deg, noise_range_m, prior_sigma_deg, tolerance_deg;
  std::optional<double> range_offset_sigma_m, patch_thickness_m, knot_spacing_s, cell_size_m;
  double duration_s = 10.0, empty_circle_m = cloud::PointDistributionOptions{}.empty_circle;
  bool force = false, no_report = false, same_walls = false;
  ParameterWishes parameters;
  ReadingWishes reading;
};

/// Options common to all kinds of calibrations; `Job` is the options of one.
template <class Job>
void take_common(const CalibrateCommandOptions& options, Job& job) {
  if (options.range_offset_sigma_m) job.range_offset_sigma = *options.range_offset_sigma_m;
  if (options.prior_sigma_deg) job.prior_sigma = radians_from_degrees(*options.prior_sigma_deg);
  job.rate = rate_from(options.rate_hz);
  job.sensor = options.sensor;
  job.fixed = held_parameters(options.parameters.fixed);
  job.additional = options.parameters.freed;
  job.range_noise = options.noise_range_m;
}

/// Options common to flown and planned flights.
template <class Job>
void take_grid(const CalibrateCommandOptions& options, Job& job) {
  if (options.knot_spacing_s) job.knot_spacing = *options.knot_spacing_s;
  if (options.cell_size_m) job.cell_size = *options.cell_size_m;
}

/// Options common to recordings of walls and of a flight.
template <class Job>
void take_recordings(const CalibrateCommandOptions& options, const CommonOptions& common,
                     Job& job) {
  take_common(options, job);
  job.recordings.assign(options.many.names.begin(), options.many.names.end());
  job.reading = read_options(options.reading);
  job.angle_noise = noise_angle(options.noise_angle_deg);
  if (options.mirror != "auto") job.mirrored = options.mirror == "yes";
  job.seed = common.seed;
  if (options.tolerance_deg) job.tolerance = radians_from_degrees(*options.tolerance_deg);
  job.truths = options.truths;
  job.details = !options.many.output.empty() && !options.no_report;
  job.force = options.force;
}

jobs::CalibrateRecordingsOptions job_of(const CalibrateCommandOptions& options,
                                        const CommonOptions& common) {
  jobs::CalibrateRecordingsOptions job;
  take_recordings(options, common, job);
  job.beam_origin = options.beam_origin == "yes";
  if (options.patch_thickness_m) job.patch_thickness = *options.patch_thickness_m;
  job.flat_walls = options.walls == "flat";
  if (options.same_walls) job.same_walls = calibration::SameWalls::yes;
  if (options.method == "paper") job.method = calibration::CalibrationMethod::paper;
  if (!options.planes.empty()) job.planes = scenes::load_scene(options.planes);
  job.stations =
      jobs::stations_of(options.stations, options.station_names, options.many.names.size());
  job.files = result_files(options.many.output, options.states, common);
  if (job.details) {
    job.texts = [](const CalibratedRecordings& outcome) {
      return report_texts(report::report_of(outcome));
    };
  }
  return job;
}

const char* why_not_written(CalibrationCode code) {
  switch (code) {
    case CalibrationCode::as_believed:
      return "the sensor's own parameters are as good";
    case CalibrationCode::not_better:
      return "it is not better";
    default:
      return "it cannot be trusted";
  }
}

/// Runs a calibration, on walls or in flight, and prints the result.
template <class Calibrate, class Print>
ExitStatus run_job(const CalibrateCommandOptions& options, const CommonOptions& common,
                   const Calibrate& calibrate, const Print& print) {
  auto outcome = [&] {
    ProgressBar bar("calibrating", common);
    return calibrate(bar.progress());
  }();
  const auto& c = outcome.calibration;
  log_warnings(outcome.warnings);
  log_warnings(c.warnings);
  if (!c.converged) log_failure(c.reason, common);
  if (c.converged && !outcome.calibration_written && !options.many.output.empty()) {
    spdlog::warn("calibration.yaml was not written, because {}: --force writes it",
                 why_not_written(c.verdict.code));
  }
  if (common.json) {
    print_json(common, json::of(outcome), outcome.provenance);
  } else {
    print(outcome);
  }
  return c.converged ? kDone : kNumbersFailed;
}

ExitStatus calibrate_each(CalibrateCommandOptions& options, const CLI::App& verb,
                          const CommonOptions& common) {
  options.many.into_folder = are_several(options.many);
  CalibrateCommandOptions one = options;
  one.many.names.resize(1);
  const jobs::InputWork work = json::calibrate_each(job_of(one, common), log_words);
  const jobs::InputPlan plan = jobs::plan_inputs(options.many, work, cancellable());
  const auto one_alone = [&](bool given, const char* option) {
    if (!given || plan.jobs.size() == 1) return;
    throw InvalidArgument(
        fmt::format("{} is for one recording, and there are {}: with --table or --resume each is "
                    "calibrated separately",
                    option, plan.jobs.size()));
  };
  one_alone(!options.truths.empty(), "--truth");
  one_alone(!options.stations.empty(), "--stations");
  return run_inputs(plan, work, options.many, verb, common);
}

jobs::CalibrateFlightOptions flight_job_of(const CalibrateCommandOptions& options,
                                           const CommonOptions& common) {
  jobs::CalibrateFlightOptions job;
  take_recordings(options, common, job);
  job.platform = options.platform;
  job.control = options.control;
  take_grid(options, job);
  require_folder_apart(common, options.many.output, {"mount.yaml", "trajectory.csv"});
  job.files = result_files(options.many.output, "none", common);
  if (job.details) {
    job.texts = [](const jobs::CalibratedFlight& outcome) {
      return report_texts(report::report_of(outcome));
    };
  }
  return job;
}

ExitStatus run_plan(const CalibrateCommandOptions& options, const CommonOptions& common) {
  if (!options.many.names.empty()) throw InvalidArgument("--plan takes no recordings");
  if (!options.many.table.empty() || options.many.resume || options.no_report) {
    throw InvalidArgument("--table, --resume and --no-report go with recordings, not with --plan");
  }
  if (jobs::is_flight_plan(options.plan)) {
    jobs::PlanFlightOptions job;
    take_common(options, job);
    take_grid(options, job);
    require_positive(kSetting.empty_circle, options.empty_circle_m);
    job.distribution.empty_circle = options.empty_circle_m;
    job.seed = common.seed;
    return run_flight_plan(job, options.plan, options.platform, options.scene, options.page,
                           common);
  }
  if (moves(options.platform) || !options.scene.empty() || !options.page.empty() ||
      options.knot_spacing_s || options.cell_size_m) {
    throw InvalidArgument(fmt::format(
        "{} is a scene of walls: --mount, --trajectory-errors, --scene, --report, --knot-spacing-s "
        "and --cell-size-m go with a flight, which has strips",
        options.plan));
  }
  jobs::PlanCalibrationOptions job;
  job.flat_walls = options.walls == "flat";
  take_common(options, job);
  job.beam_origin = options.beam_origin == "yes";
  job.scene = scenes::load_scene(options.plan);
  job.duration = options.duration_s;
  jobs::PlannedCalibration planned;
  {
    ProgressBar bar("planning", common);
    planned = jobs::plan_calibration(job, bar.progress());
  }
  if (common.json) {
    print_json(common, json::of(planned));
  } else {
    print_forecast(planned.forecast, planned.shape);
  }
  return kDone;
}

}  // namespace

Run declare_calibrate(CLI::App& verb) {
  const auto options = std::make_shared<CalibrateCommandOptions>();
  CalibrateCommandOptions& o = *options;
  add_many_options(verb, o.many,
                   "Recordings of one sensor with ranges to plane walls, or from a flight, for one "
                   "calibration; with --table one each");
  verb.get_option("--table")->description(
      "Calibrate each recording separately, and write a table with one row for each; the ending "
      "chooses the format: .csv or .nc (NetCDF)");
  verb.get_option("--resume")
      ->description(
          "Calibrate each recording separately, but skip those whose results are complete and come "
          "from the same bytes, options and version");
  verb.add_option("-o,--output", o.many.output,
                  "Folder for calibration.yaml, states.nc (states_1.nc, ...), report.json and "
                  "report.html; with --table, a folder of such folders (default: none)");
  verb.add_flag("--no-report", o.no_report, "Do not write report.json and report.html");
  add_choice(verb, "--method", o.method, {"adjustment", "paper"},
             "adjustment: weighted, of all recordings together; paper: unweighted distances from "
             "planes fitted by SVD");
  verb.add_option(
      "--planes", o.planes,
      "Walls by name (YAML); the normal of a wall with sigma_deg is known (default: walls "
      "are found in the data)");
  verb.add_option(
      "--stations", o.stations,
      "Known rotations of the sensor (YAML): one station per recording, in the same order");
  verb.add_option(
          "--station", o.station_names,
          "Station of each recording, in the same order, if --stations lists more (repeatable)")
      ->type_name("NAME")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--plan", o.plan,
                  "Predict a calibration in this scene or flight (YAML) and, for a flight, how its "
                  "points would be distributed on the ground")
      ->excludes("--output", "--method", "--planes", "--stations", "--station", "--list");
  verb.add_option("--duration-s", o.duration_s, "Length of each planned recording, s")
      ->needs("--plan")
      ->capture_default_str();
  verb.add_option("--scene", o.scene,
                  "Terrain (YAML) below a planned flight (default: level ground)")
      ->needs("--plan");
  verb.add_option(
          "--empty-circle-m", o.empty_circle_m,
          "Diameter, m, of circles that the points of a planned flight should not leave empty")
      ->needs("--plan")
      ->capture_default_str();
  verb.add_option("--report", o.page, "Page (HTML) to write on the points of a planned flight")
      ->needs("--plan");
  add_platform_options(verb, o.platform);
  verb.get_option("--trajectory")
      ->excludes("--plan", "--method", "--planes", "--stations", "--table", "--resume");
  verb.add_option("--control", o.control,
                  "Known points and planes on the ground to tie a flight to (YAML)")
      ->needs("--trajectory");
  verb.add_option("--knot-spacing-s", o.knot_spacing_s,
                  "Flights: time between corrections of the trajectory, s; longer flights may get "
                  "a longer one (default: 0.25)");
  verb.add_option(
      "--cell-size-m", o.cell_size_m,
      "Flights: side of the squares of ground on which strips are compared, m (default: 2)");
  verb.add_option(
          "--rate-hz", o.rate_hz,
          "Shots per second to use or to plan with, Hz; 'full': all of them, 5000 in the plan of a "
          "flight")
      ->capture_default_str();
  verb.add_option("--noise-angle-deg", o.noise_angle_deg,
                  "1 sigma of azimuth and zenith before rounding, deg (default: the sensor's)");
  verb.add_option("--noise-range-m", o.noise_range_m,
                  "1 sigma of ranges before rounding, m (default: the sensor's)");
  verb.add_option("--sensor", o.sensor,
                  "Preset by name, or a preset or calibration file (default: from the recording)");
  add_reading_options(verb, o.reading);
  add_parameter_choice(verb, o.parameters);
  verb.add_option(
      "--prior-sigma-deg", o.prior_sigma_deg,
      "Prior: 1 sigma of every error angle about the sensor's own value, deg (default: no prior)");
  verb.add_option("--range-offset-sigma-m", o.range_offset_sigma_m,
                  "Prior: 1 sigma of the range offset about the sensor's stated value, m; 0 holds "
                  "it there (default: 0.05, for a flight 0.02)");
  add_choice(
      verb, "--walls", o.walls, {"uneven", "flat"},
      "'uneven': walls wave by millimetres, and ranges have errors near the sensor, on tilted and "
      "on dark surfaces; 'flat': exact planes and a constant error, as in the paper");
  verb.add_option("--patch-thickness-m", o.patch_thickness_m,
                  "1 sigma of the thickness of dark or light patches on their wall, m: 0 for "
                  "paint, which makes the intensity-dependent range error exact (default: 0.01)");
  verb.add_flag("--same-walls", o.same_walls,
                "The recordings show the same walls from poses that differ by a rotation, ideally "
                "a roll of 180 degrees on the spot, so that the walls' shape cancels (default: if "
                "their planes match in only one way)");
  verb.add_option("--tolerance-deg", o.tolerance_deg,
                  "RMS error of directions up to which a unit counts as sound, deg (default: the "
                  "manufacturer's specification in the preset)");
  add_choice(verb, "--beam-origin", o.beam_origin, {"yes", "no"},
             "Let beams start where they leave the last prism; 'no': at the sensor's origin");
  add_choice(verb, "--states", o.states, {"knots", "all", "none"},
             "Rotor states to write: 'knots': at one shot every 2 ms; 'all': at all shots; 'none'");
  add_choice(
      verb, "--mirror", o.mirror, {"auto", "yes", "no"},
      "Whether the elevation in the files has the opposite sign; 'auto' decides from the data");
  verb.add_flag("--force", o.force,
                "Write calibration.yaml even if it does not improve on the sensor's own parameters")
      ->excludes("--plan");
  verb.add_option("--truth", o.truths,
                  "Truth of each simulated recording (OUT.truth.yaml) to compare the calibration "
                  "with (repeatable)")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  return [options, &verb](const CommonOptions& typed) {
    // `--truth A B` leaves B among the recordings.
    const auto truth = std::stable_partition(
        options->many.names.begin(), options->many.names.end(),
        [](const std::string& input) { return !input.ends_with(".truth.yaml"); });
    options->truths.insert(options->truths.end(), truth, options->many.names.end());
    options->many.names.erase(truth, options->many.names.end());
    if (!options->plan.empty()) return run_plan(*options, typed);
    if (!options->many.table.empty() || options->many.resume) {
      return calibrate_each(*options, verb, typed);
    }
    const CommonOptions common = with_recordings_found(options->many, typed);
    if ((options->knot_spacing_s || options->cell_size_m) && !moves(options->platform)) {
      throw InvalidArgument("--knot-spacing-s and --cell-size-m go with --trajectory or --plan");
    }
    if (options->many.names.empty())
      throw InvalidArgument("INPUT is missing: a recording, or --plan");
    if (moves(options->platform)) {
      return run_job(
          *options, common,
          [&](const Progress& progress) {
            return jobs::calibrate_flight(flight_job_of(*options, common), progress);
          },
          print_flight);
    }
    std::vector<std::string> states = {"states.nc"};
    for (std::size_t i = 1; i <= options->many.names.size(); ++i) {
      states.push_back(fmt::format("states_{}.nc", i));
    }
    require_folder_apart(common, options->many.output, states);
    return run_job(
        *options, common,
        [&](const Progress& progress) {
          return jobs::calibrate_recordings(job_of(*options, common), progress);
        },
        print_calibration);
  };
}

}  // namespace risley::app
