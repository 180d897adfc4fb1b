// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/truth_file.hpp"
#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/mount.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "command.hpp"
#include "parameter_text.hpp"
#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct SimulateOptions {
  std::string output, sensor = "mid-40", quantize = "yes", beam_origin = "yes", rotor = "constant",
                      scene, station, trajectory, topic, flight, mount, trajectory_errors,
                      trajectory_format = "csv";
  std::optional<double> duration_s, start_s, clock_drift_ppm, rate_hz, noise_angle_deg,
      noise_range_m;
  std::vector<std::string> assignments, reported;
  std::vector<double> start_angles_deg;
};

void assign(sensors::Sensor& sensor, const std::string& text) {
  const auto [name, value] = parameter_assignment(text, sensor.shape());
  if (find_parameter(name, sensor.shape()).kind == ParameterKind::rotation_angle) {
    throw InvalidArgument(
        fmt::format("{}: the rotation angles at the start are set by --start-angles-deg", name));
  }
  sensor.set(name, value);
}

/// What moves the sensor, of a trajectory or a flight plan and a mount; nothing where it stands.
std::optional<simulation::Platform> platform_from(const SimulateOptions& options,
                                                  const simulation::SimulationSettings& settings) {
  const bool moves = !options.trajectory.empty() || !options.flight.empty();
  if (!moves) {
    const std::pair<bool, const char*> only_moving[] = {
        {!options.mount.empty(), "--mount"},
        {!options.trajectory_errors.empty(), "--trajectory-errors"},
        {options.clock_drift_ppm.has_value(), "--clock-drift-ppm"},
        {options.start_s.has_value(), "--start-s"},
    };
    for (const auto& [given, flag] : only_moving) {
      if (given) throw InvalidArgument(fmt::format("{} needs --trajectory or --flight", flag));
    }
    return std::nullopt;
  }
  if (options.mount.empty()) {
    throw InvalidArgument(
        "--mount is missing: how the sensor sits on what moves along the trajectory");
  }
  if (options.scene.empty()) {
    throw InvalidArgument(
        "--scene is missing: what the moving sensor meets, for example a "
        "terrain");
  }
  simulation::Platform platform;
  if (!options.flight.empty()) {
    const trajectories::FlightPlan plan = trajectories::load_flight_plan(options.flight);
    trajectories::Flight flight = trajectories::fly(plan);
    platform.trajectory = std::make_shared<trajectories::Trajectory>(std::move(flight.trajectory));
    platform.strips = std::move(flight.strips);
    const auto& terrain = settings.scene->terrain;
    if (!terrain || !terrain->parts().origin) platform.map_origin = plan.origin;
  } else {
    platform.trajectory = std::make_shared<trajectories::Trajectory>(
        trajectories::load_trajectory(options.trajectory, {}, options.topic));
  }
  platform.mount = trajectories::load_mount(options.mount);
  platform.clock_drift = 1e-6 * options.clock_drift_ppm.value_or(0.0);
  if (options.start_s) {
    check_not_negative(*options.start_s, "--start-s", "s");
    if (*options.start_s > 1e9) {
      throw InvalidArgument(fmt::format("--start-s = {:g} s, allowed 0 to 1e9", *options.start_s));
    }
    platform.begin_ns = platform.trajectory->time_ns.front() +
                        static_cast<std::int64_t>(std::llround(1e9 * *options.start_s));
  }
  if (!options.trajectory_errors.empty()) {
    platform.errors = trajectories::load_error_model(options.trajectory_errors);
  }
  platform.trajectory_ending = "." + options.trajectory_format;
  return platform;
}

simulation::SimulationSettings settings_from(const SimulateOptions& options,
                                             const CommonOptions& common) {
  if (options.duration_s) check_positive(*options.duration_s, "--duration-s", "s");
  if (options.rate_hz) check_positive(*options.rate_hz, "--rate-hz", "Hz");
  if (options.noise_angle_deg) {
    check_not_negative(*options.noise_angle_deg, "--noise-angle-deg", "deg");
  }
  if (options.noise_range_m) check_not_negative(*options.noise_range_m, "--noise-range-m", "m");
  simulation::SimulationSettings settings;
  settings.truth = sensors::load_sensor(options.sensor);
  for (const std::string& text : options.assignments) assign(settings.truth, text);
  if (options.beam_origin == "no") settings.truth.set_prism_geometry({});
  if (!options.reported.empty()) {
    settings.reported = settings.truth;
    for (const std::string& text : options.reported) {
      if (text == "nominal") {
        settings.reported->train = settings.reported->train.without_errors();
      } else {
        assign(*settings.reported, text);
      }
    }
  }
  settings.rate = options.rate_hz;
  if (options.noise_angle_deg) {
    settings.angle_noise = radians_from_degrees(*options.noise_angle_deg);
  }
  settings.range_noise = options.noise_range_m;
  settings.quantize = options.quantize == "yes";
  settings.rotor = simulation::rotor_kind_from(options.rotor);
  for (const double angle_deg : options.start_angles_deg) {
    settings.start_angles.push_back(radians_from_degrees(angle_deg));
  }
  if (!options.scene.empty()) settings.scene = scenes::load_scene(options.scene);
  settings.station = options.station;
  settings.platform = platform_from(options, settings);
  settings.duration = options.duration_s ? *options.duration_s
                      : settings.platform
                          ? std::max(1e-3, simulation::longest_duration(*settings.platform))
                          : 1.0;
  settings.seed = common.seed;
  settings.threads = common.threads;
  return settings;
}

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }

/// The true parameters and the rotation angles at the start.
std::vector<NamedValue> true_values(const simulation::SimulationResult& result) {
  std::vector<NamedValue> values = sensor_values(result.truth);
  for (std::size_t i = 0; i < result.start_angles.size(); ++i) {
    values.push_back({fmt::format("rotation_angle_{}_deg", prism_letter(static_cast<int>(i))),
                      degrees_from_radians(result.start_angles[i]), "deg"});
  }
  return values;
}

void print_result(const SimulateOptions& options, const simulation::SimulationSettings& settings,
                  const simulation::SimulationResult& result) {
  say("{}: {} observations, {} without a return\n", options.output, grouped(result.observations),
      grouped(result.no_return));
  say("truth: {}, {}\n", simulation::truth_preset_path(options.output),
      simulation::truth_columns_path(options.output));
  if (settings.platform) {
    const std::string trajectory =
        simulation::trajectory_path(options.output, settings.platform->trajectory_ending);
    say("       {}, {}\n", simulation::truth_trajectory_path(options.output),
        simulation::truth_mount_path(options.output));
    say("trajectory {}: {}\n", settings.platform->errors ? "with errors" : "without errors",
        trajectory);
    for (const std::string& what : result.left_out) say("{}: {}\n", trajectory, what);
    if (!settings.platform->strips.empty()) {
      say("strips: {}\n", simulation::strips_path(options.output));
      Table table({"strip", "begin", "end", "unit"});
      for (const trajectories::StripTimes& strip : settings.platform->strips) {
        table.add({strip.name, fmt::format("{:.3f}", seconds(strip.begin_ns)),
                   fmt::format("{:.3f}", seconds(strip.end_ns)), "s"});
      }
      table.print();
    }
  }
  say("\n");
  Table table({"parameter", "truth", "unit"});
  for (const NamedValue& value : true_values(result)) {
    table.add({value.name, fmt::format("{:.8g}", value.value), value.unit});
  }
  table.print();
}

void add_platform(Json& json, const simulation::Platform& platform,
                  const SimulateOptions& options) {
  json["truth_files"].push_back(simulation::truth_trajectory_path(options.output));
  json["truth_files"].push_back(simulation::truth_mount_path(options.output));
  json["trajectory"] = simulation::trajectory_path(options.output, platform.trajectory_ending);
  json["strips"] = Json::array();
  for (const trajectories::StripTimes& strip : platform.strips) {
    json["strips"].push_back({{"name", strip.name},
                              {"begin_s", seconds(strip.begin_ns)},
                              {"end_s", seconds(strip.end_ns)}});
  }
}

/// Endings of the formats of trajectories that can be written, without the dot.
std::vector<std::string> trajectory_formats() {
  std::vector<std::string> names;
  for (const auto& format : trajectories::writable_trajectories()) {
    names.push_back(format.ending.substr(1));
  }
  return names;
}

}  // namespace

Run declare_simulate(CLI::App& verb) {
  const auto options = std::make_shared<SimulateOptions>();
  SimulateOptions& o = *options;
  verb.add_option("-o,--output", o.output, "Recording to write; its ending chooses the format")
      ->required();
  verb.add_option("--sensor", o.sensor, "Preset by name, or a preset or calibration file")
      ->capture_default_str();
  verb.add_option("--duration-s", o.duration_s,
                  "Length of the recording, s (default: 1, or to the end of the trajectory)");
  verb.add_option("--rate-hz", o.rate_hz, "Shots per second, Hz (default: the sensor's)");
  verb.add_option("--noise-angle-deg", o.noise_angle_deg,
                  "1 sigma of azimuth and zenith before rounding, deg (default: the sensor's)");
  verb.add_option("--noise-range-m", o.noise_range_m,
                  "1 sigma of ranges before rounding, m (default: the sensor's)");
  verb.add_option("--quantize", o.quantize, "Round angles and ranges to the sensor's resolution")
      ->check(CLI::IsMember({"yes", "no"}))
      ->capture_default_str();
  verb.add_option("--beam-origin", o.beam_origin,
                  "Let beams start where they leave the last prism; 'no': at the sensor's origin")
      ->check(CLI::IsMember({"yes", "no"}))
      ->capture_default_str();
  verb.add_option("--rotor", o.rotor, "How the rotors' speeds vary")
      ->check(CLI::IsMember(simulation::rotor_kind_names()))
      ->capture_default_str();
  verb.add_option(
          "--set", o.assignments,
          "Set a parameter of the true sensor, in the unit that its name ends with (repeatable)")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option(
          "--reported", o.reported,
          "Set a parameter as the sensor believes it to be, where that differs from the "
          "truth (repeatable); 'nominal' sets every error parameter to 0 (default: the truth)")
      ->type_name("NAME=VALUE|nominal")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--scene", o.scene,
                  "Planes or terrain (YAML) to measure ranges to (default: none, and no ranges)");
  verb.add_option("--station", o.station,
                  "Station of the scene to stand on (default: the scene's origin)");
  auto* trajectory =
      verb.add_option("--trajectory", o.trajectory,
                      "True trajectory along which the sensor moves (default: it stands still)");
  verb.add_option("--trajectory-topic", o.topic, "Topic of the poses, where a ROS bag has several")
      ->type_name("NAME")
      ->needs(trajectory);
  verb.add_option("--flight", o.flight, "Flight plan (YAML) to make the true trajectory from")
      ->excludes(trajectory);
  verb.add_option("--mount", o.mount, "True mount of the moving sensor (YAML)");
  verb.add_option(
      "--trajectory-errors", o.trajectory_errors,
      "Errors (YAML) of the trajectory file that is written beside the recording (default: "
      "none)");
  verb.add_option("--trajectory-format", o.trajectory_format, "Format of that trajectory file")
      ->check(CLI::IsMember(trajectory_formats()))
      ->capture_default_str();
  verb.add_option("--start-s", o.start_s,
                  "Start of the recording, s after the trajectory's first record (default: 0)");
  verb.add_option("--clock-drift-ppm", o.clock_drift_ppm,
                  "How fast the trajectory's time gains on the sensor's clock, ppm (default: 0)");
  verb.add_option(
          "--start-angles-deg", o.start_angles_deg,
          "Rotation angles of the prisms at the start, deg, as A,B or A,B,C (default: random)")
      ->delimiter(',');
  return [options](const CommonOptions& common) {
    const simulation::SimulationSettings settings = settings_from(*options, common);
    require_apart(common, simulation::simulation_files(settings, options->output));
    spdlog::debug("{} s of sensor {}, seed {}", settings.duration, settings.truth.name,
                  settings.seed);
    simulation::SimulationResult result;
    {
      ProgressBar bar("simulating", common);
      result = simulation::simulate_to_file(
          settings, options->output, {{"command", common.command}, {"version", RISLEY_VERSION}},
          bar.progress());
    }
    if (!common.json) {
      print_result(*options, settings, result);
      return kDone;
    }
    Json truth = Json::object();
    for (const NamedValue& value : true_values(result)) truth[value.name] = value.value;
    Json json = {{"observations", result.observations},
                 {"no_return", result.no_return},
                 {"output", options->output},
                 {"truth_files",
                  {simulation::truth_preset_path(options->output),
                   simulation::truth_columns_path(options->output)}},
                 {"files", result.files},
                 {"truth", truth}};
    if (settings.platform) add_platform(json, *settings.platform, *options);
    print_json(common, json);
    return kDone;
  };
}

}  // namespace risley::app
