// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/simulation_settings.hpp"
#include "risley/simulation/truth_file.hpp"
#include "risley/trajectories/trajectory_file.hpp"

#include "command.hpp"
#include "message_options.hpp"
#include "parameter_choice.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct SimulateOptions {
  std::string output, sensor = "mid-40", quantize = "yes", beam_origin = "yes", rotor = "constant",
                      scene, station, trajectory, topic, flight, mount, trajectory_errors,
                      trajectory_format = "csv";
  std::optional<double> duration_s, start_s, clock_drift_ppm, rate_hz, noise_angle_deg,
      noise_range_m;
  SimulatedValues values;
  std::vector<double> start_angles_deg;
  MessageWishes messages;
};

jobs::SimulationOptions job_of(const SimulateOptions& options, const CommonOptions& common) {
  jobs::SimulationOptions job;
  job.sensor = options.sensor;
  take_simulated_values(options.values, job);
  job.duration = options.duration_s;
  job.rate = options.rate_hz;
  if (options.noise_angle_deg) job.angle_noise = radians_from_degrees(*options.noise_angle_deg);
  job.range_noise = options.noise_range_m;
  // Packets of the second generation hold coordinates, which LVX 2 itself rounds to 1 mm.
  job.quantize = options.quantize == "yes" && !lower_case(options.output).ends_with(".lvx2");
  job.beam_origin = options.beam_origin == "yes";
  job.rotor = simulation::rotor_kind_from(options.rotor);
  for (const double angle_deg : options.start_angles_deg) {
    job.start_angles.push_back(radians_from_degrees(angle_deg));
  }
  job.scene = options.scene;
  job.station = options.station;
  job.trajectory = options.trajectory;
  job.topic = options.topic;
  job.flight = options.flight;
  job.mount = options.mount;
  job.trajectory_errors = options.trajectory_errors;
  job.trajectory_ending = "." + options.trajectory_format;
  job.start = options.start_s;
  if (options.clock_drift_ppm) job.clock_drift = 1e-6 * *options.clock_drift_ppm;
  job.seed = common.seed;
  job.threads = common.threads;
  return job;
}

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }

void print_result(const simulation::SimulationResult& result, bool with_errors) {
  const std::string& output = result.files.front();
  say("{}: {} observations, {} without a return\n", output, grouped(result.observations),
      grouped(result.no_return));
  say("truth: {}, {}\n", result.truth_files[0], result.truth_files[1]);
  if (!result.trajectory.empty()) {
    say("       {}, {}\n", result.truth_files[2], result.truth_files[3]);
    say("trajectory {}: {}\n", with_errors ? "with errors" : "without errors", result.trajectory);
    for (const std::string& what : result.left_out) say("{}: {}\n", result.trajectory, what);
    if (!result.strips.empty()) {
      say("strips: {}\n", simulation::strips_path(output));
      Table table({"strip", "begin", "end", "unit"});
      for (const trajectories::StripTimes& strip : result.strips) {
        table.add({strip.name, fmt::format("{:.3f}", seconds(strip.begin_ns)),
                   fmt::format("{:.3f}", seconds(strip.end_ns)), "s"});
      }
      table.print();
    }
  }
  say("\n");
  Table table({"parameter", "truth", "unit"});
  for (const sensors::NamedValue& value : simulation::true_values(result)) {
    table.add({value.name, fmt::format("{:.8g}", value.value), value.unit});
  }
  table.print();
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
  add_choice(verb, "--quantize", o.quantize, {"yes", "no"},
             "Round angles and ranges to the sensor's resolution");
  add_choice(verb, "--beam-origin", o.beam_origin, {"yes", "no"},
             "Let beams start where they leave the last prism; 'no': at the sensor's origin");
  verb.add_option("--rotor", o.rotor, "How the rotors' speeds vary")
      ->check(CLI::IsMember(simulation::rotor_kind_names()))
      ->capture_default_str();
  add_simulated_values(verb, o.values);
  verb.add_option("--scene", o.scene,
                  "Planes or terrain (YAML) to measure ranges to (default: none, and no ranges)");
  verb.add_option("--station", o.station,
                  "Station of the scene to stand on (default: the scene's origin)");
  auto* trajectory =
      verb.add_option("--trajectory", o.trajectory,
                      "True trajectory along which the sensor moves (default: it stands still)");
  verb.add_option("--trajectory-topic", o.topic, "Topic of the poses, if a ROS bag has several")
      ->type_name("NAME")
      ->needs(trajectory);
  verb.add_option("--flight", o.flight, "Flight plan (YAML) to make the true trajectory from")
      ->excludes(trajectory);
  verb.add_option("--mount", o.mount, "True mount of the moving sensor (YAML)");
  verb.add_option(
      "--trajectory-errors", o.trajectory_errors,
      "Errors (YAML) of the trajectory file written beside the recording (default: none)");
  verb.add_option("--trajectory-format", o.trajectory_format, "Format of that trajectory file")
      ->check(CLI::IsMember(trajectory_formats()))
      ->capture_default_str();
  verb.add_option("--start-s", o.start_s,
                  "Start of the recording, s after the trajectory's first record (default: 0)");
  verb.add_option(
      "--clock-drift-ppm", o.clock_drift_ppm,
      "How much faster the trajectory's clock runs than the sensor's, ppm (default: 0)");
  verb.add_option(
          "--start-angles-deg", o.start_angles_deg,
          "Rotation angles of the prisms at the start, deg, as A,B or A,B,C (default: random)")
      ->delimiter(',');
  add_message_options(verb, o.messages, "custom");
  return [options](const CommonOptions& common) {
    simulation::SimulationSettings settings = jobs::simulation_settings(job_of(*options, common));
    settings.writing.messages = message_options(options->messages);
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
    if (common.json) {
      print_json(common, json::of(result));
    } else {
      print_result(result, settings.platform && settings.platform->errors);
    }
    return kDone;
  };
}

}  // namespace risley::app
