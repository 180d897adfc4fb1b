// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/sensors/preset.hpp"
#include "risley/simulation/truth_file.hpp"

#include "command.hpp"
#include "parameter_text.hpp"
#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct SimulateOptions {
  std::string output, sensor = "mid-40", quantize = "yes", beam_origin = "yes", rotor = "constant",
                      scene, station;
  double duration_s = 1.0;
  std::optional<double> rate_hz, noise_angle_deg, noise_range_m;
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

simulation::SimulationSettings settings_from(const SimulateOptions& options,
                                             const CommonOptions& common) {
  check_positive(options.duration_s, "--duration-s", "s");
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
  settings.duration = options.duration_s;
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
  settings.seed = common.seed;
  settings.threads = common.threads;
  return settings;
}

/// The true parameters and the rotation angles at the start.
std::vector<NamedValue> true_values(const simulation::SimulationResult& result) {
  std::vector<NamedValue> values = sensor_values(result.truth);
  for (std::size_t i = 0; i < result.start_angles.size(); ++i) {
    values.push_back({fmt::format("rotation_angle_{}_deg", prism_letter(static_cast<int>(i))),
                      degrees_from_radians(result.start_angles[i]), "deg"});
  }
  return values;
}

void print_result(const SimulateOptions& options, const simulation::SimulationResult& result) {
  say("{}: {} observations, {} without a return\n", options.output, grouped(result.observations),
      grouped(result.no_return));
  say("truth: {}, {}\n\n", simulation::truth_preset_path(options.output),
      simulation::truth_columns_path(options.output));
  Table table({"parameter", "truth", "unit"});
  for (const NamedValue& value : true_values(result)) {
    table.add({value.name, fmt::format("{:.8g}", value.value), value.unit});
  }
  table.print();
}

}  // namespace

Run declare_simulate(CLI::App& verb) {
  const auto options = std::make_shared<SimulateOptions>();
  SimulateOptions& o = *options;
  verb.add_option("-o,--output", o.output, "Recording to write; its ending chooses the format")
      ->required();
  verb.add_option("--sensor", o.sensor, "Preset by name, or a preset or calibration file")
      ->capture_default_str();
  verb.add_option("--duration-s", o.duration_s, "Length of the recording")->capture_default_str();
  verb.add_option("--rate-hz", o.rate_hz, "Shots per second (default: the sensor's)");
  verb.add_option("--noise-angle-deg", o.noise_angle_deg,
                  "1 sigma of azimuth and zenith (default: the sensor's)");
  verb.add_option("--noise-range-m", o.noise_range_m, "1 sigma of ranges (default: the sensor's)");
  verb.add_option("--quantize", o.quantize, "Round to the sensor's resolution")
      ->check(CLI::IsMember({"yes", "no"}))
      ->capture_default_str();
  verb.add_option("--beam-origin", o.beam_origin,
                  "Start beams where they leave the last prism; 'no': at the sensor's origin")
      ->check(CLI::IsMember({"yes", "no"}))
      ->capture_default_str();
  verb.add_option("--rotor", o.rotor, "How the rotors run")
      ->check(CLI::IsMember(simulation::rotor_kind_names()))
      ->capture_default_str();
  verb.add_option("--set", o.assignments, "NAME=VALUE of the true sensor (repeatable)")
      ->type_name("NAME=VALUE")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--reported", o.reported,
                  "What the sensor believes where it differs from the truth (repeatable); "
                  "'nominal' sets every error parameter to 0")
      ->type_name("NAME=VALUE|nominal")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--scene", o.scene, "Planes around the sensor (YAML); without it no ranges");
  verb.add_option("--station", o.station, "Station of the scene to stand on");
  verb.add_option("--start-angles-deg", o.start_angles_deg,
                  "Rotation angles at the start, A,B (default: random from the seed)")
      ->delimiter(',');
  return [options](const CommonOptions& common) {
    require_apart(common, {options->output, simulation::truth_preset_path(options->output),
                           simulation::truth_columns_path(options->output)});
    simulation::SimulationSettings settings = settings_from(*options, common);
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
      print_result(*options, result);
      return kDone;
    }
    Json truth = Json::object();
    for (const NamedValue& value : true_values(result)) truth[value.name] = value.value;
    print_json(common, {{"observations", result.observations},
                        {"no_return", result.no_return},
                        {"output", options->output},
                        {"truth_files",
                         {simulation::truth_preset_path(options->output),
                          simulation::truth_columns_path(options->output)}},
                        {"truth", truth}});
    return kDone;
  };
}

}  // namespace risley::app
