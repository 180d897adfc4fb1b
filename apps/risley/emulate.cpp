// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/text.hpp"
#include "risley/jobs/emulate_sensor.hpp"

#include "command.hpp"
#include "parameter_choice.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct EmulateChoices {
  std::string interface, serial, recording, sensor = "mid-40", scene, station, rotor = "constant";
  SimulatedValues values;
  double speed = 1;
  std::optional<double> duration_s;
  double loss = 0, duplication = 0, disorder = 0, delay_ms = 0, wrong_checksums = 0,
         restart_takes_s = 2;
  int farthest = 10;
  std::optional<double> heartbeat_dies_s, restart_s, bend_s;
  std::vector<std::string> bend;
  std::string time_source = "power-on";
  double time_source_from_s = 0, clock_drift_ppm = 0, clock_jump_by_ms = 250;
  std::optional<double> clock_jump_s;
};

jobs::EmulateOptions job_of(const EmulateChoices& options, const CommonOptions& common) {
  jobs::EmulateOptions job;
  job.interface = options.interface;
  job.serial = options.serial;
  job.recording = options.recording;
  job.speed = options.speed;
  job.duration = options.duration_s;
  job.simulation.sensor = options.sensor;
  job.simulation.scene = options.scene;
  job.simulation.station = options.station;
  job.simulation.rotor = simulation::rotor_kind_from(options.rotor);
  take_simulated_values(options.values, job.simulation);
  job.simulation.seed = common.seed;
  job.simulation.threads = common.threads;
  using recordings::TimeReference;
  job.clock.source = options.time_source == "ptp"   ? TimeReference::ptp
                     : options.time_source == "pps" ? TimeReference::pps
                                                    : TimeReference::power_on;
  job.clock.source_from = options.time_source_from_s;
  job.clock.drift_ppm = options.clock_drift_ppm;
  job.clock.jump = options.clock_jump_s;
  job.clock.jump_by = 1e-3 * options.clock_jump_by_ms;
  jobs::EmulatedFaults& faults = job.faults;
  faults.loss = options.loss;
  faults.duplication = options.duplication;
  faults.disorder = options.disorder;
  faults.farthest = options.farthest;
  faults.delay = 1e-3 * options.delay_ms;
  faults.wrong_checksums = options.wrong_checksums;
  faults.heartbeat_dies = options.heartbeat_dies_s;
  faults.restart = options.restart_s;
  faults.restart_time = options.restart_takes_s;
  faults.bend = parameter_values(options.bend);
  faults.bend_time = options.bend_s;
  return job;
}

void print_emulated(const jobs::EmulatedSensor& truth) {
  say("{} at {}: {:.1f} s\n\n", truth.serial, to_string(truth.address), truth.duration);
  Table table({"observations", "packets", "lost", "twice", "overtaken", "sessions"});
  table.add({grouped(truth.rows), grouped(truth.packets), grouped(truth.lost),
             grouped(truth.duplicates), grouped(truth.reordered), grouped(truth.sessions)});
  table.print();
  if (truth.lost_at_ends > 0) {
    say("{} more packets were dropped at the beginning or end, where their loss cannot be "
        "detected\n",
        grouped(truth.lost_at_ends));
  }
}

void declare_clock(CLI::App& verb, EmulateChoices& o) {
  const std::string group = "Clock of the sensor";
  add_choice(verb, "--time", o.time_source, {"power-on", "ptp", "pps"},
             "Origin of the sensor's times")
      ->group(group);
  verb.add_option("--time-from-s", o.time_source_from_s,
                  "When that origin takes effect, s after the first start; times count from "
                  "power-on before")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--clock-drift-ppm", o.clock_drift_ppm,
                  "How much faster the sensor's clock runs than this machine's, ppm")
      ->check(CLI::Range(-10000.0, 10000.0))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--clock-jump-s", o.clock_jump_s,
                  "When the clock jumps once, s after the first start")
      ->group(group);
  verb.add_option("--clock-jump-by-ms", o.clock_jump_by_ms, "Size of the jump, ms")
      ->check(CLI::Range(-3.6e6, 3.6e6))
      ->capture_default_str()
      ->group(group);
}

void declare_faults(CLI::App& verb, EmulateChoices& o) {
  const std::string group = "Faults";
  const auto share = [&](const char* name, double& value, const char* description) {
    verb.add_option(name, value, description)
        ->check(CLI::Range(0.0, 1.0))
        ->capture_default_str()
        ->group(group);
  };
  share("--loss", o.loss, "Share of packets that are lost");
  share("--duplication", o.duplication, "Share of packets that are sent twice");
  share("--disorder", o.disorder, "Share of packets that are delayed behind later ones");
  verb.add_option("--disorder-packets", o.farthest, "Most packets that overtake one")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str()
      ->group(group);
  verb.add_option("--delay-ms", o.delay_ms, "Delay of all data, ms")
      ->check(CLI::Range(0.0, 60000.0))
      ->capture_default_str()
      ->group(group);
  share("--wrong-checksums", o.wrong_checksums,
        "Share of replies and broadcasts with wrong checksums");
  verb.add_option("--heartbeat-dies-s", o.heartbeat_dies_s,
                  "When the sensor stops answering heartbeats, s after the first start")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  verb.add_option("--restart-s", o.restart_s,
                  "When the sensor restarts, with its clock at zero, s after the first start")
      ->check(CLI::NonNegativeNumber)
      ->group(group);
  verb.add_option("--restart-takes-s", o.restart_takes_s, "Duration of a restart, s")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str()
      ->group(group);
  auto* bend = verb.add_option("--bend", o.bend,
                               "Change a parameter of the true sensor at --bend-s, in the unit "
                               "that its name ends with (repeatable)");
  bend->type_name("NAME=CHANGE")->expected(1)->allow_extra_args(false)->take_all()->group(group);
  auto* bend_s =
      verb.add_option("--bend-s", o.bend_s, "When --bend takes effect, s after the first start");
  bend_s->check(CLI::NonNegativeNumber)->needs(bend)->group(group);
  bend->needs(bend_s);
}

}  // namespace

Run declare_emulate(CLI::App& verb) {
  const auto options = std::make_shared<EmulateChoices>();
  EmulateChoices& o = *options;
  verb.add_option("--interface", o.interface,
                  "IPv4 address of this machine for the sensor to use, such as 127.0.0.5")
      ->type_name("ADDRESS")
      ->required();
  verb.add_option("--serial", o.serial,
                  "Serial number (broadcast code) of the sensor (default: from its optics)");
  verb.add_option("--sensor", o.sensor, "Preset by name, or a preset or calibration file")
      ->capture_default_str();
  auto* scene = verb.add_option("--scene", o.scene,
                                "Planes or terrain (YAML) around the sensor (default: a room)");
  verb.add_option("--recording", o.recording,
                  "Recording of one sensor to send, gaps included, in a loop")
      ->excludes(scene);
  verb.add_option("--station", o.station,
                  "Station of the scene to stand on (default: the scene's origin)");
  verb.add_option("--rotor", o.rotor, "How the rotors' speeds vary")
      ->check(CLI::IsMember(simulation::rotor_kind_names()))
      ->capture_default_str();
  add_simulated_values(verb, o.values);
  verb.add_option("--speed", o.speed, "How many times faster than real time the sensor runs")
      ->check(CLI::Range(0.01, 100.0))
      ->capture_default_str();
  verb.add_option("--duration-s", o.duration_s,
                  "Time to run, s (default: until Ctrl-C or SIGTERM)");
  declare_clock(verb, o);
  declare_faults(verb, o);
  return [options](const CommonOptions& common) {
    end_in_own_time();
    const jobs::EmulatedSensor truth = jobs::emulate_sensor(
        job_of(*options, common), [](const std::string& words) { spdlog::debug(words); },
        cancellable());
    if (common.json) {
      print_json(common, json::of(truth));
    } else {
      print_emulated(truth);
    }
    return kDone;
  };
}

}  // namespace risley::app
