// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include "risley/core/error.hpp"
#include "risley/jobs/record_sensors.hpp"

#include "command.hpp"
#include "recording_text.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct RecordChoices {
  std::string output, interface, coordinates = "spherical", return_mode = "as-is", imu = "yes";
  bool list = false, passive = false;
  std::vector<std::string> serials;
  std::optional<double> duration_s;
  double find_s = 2.5;
  std::uint16_t data_port = 56001;
};

const std::map<std::string, wire::ReturnMode>& return_modes() {
  static const std::map<std::string, wire::ReturnMode> modes = {
      {"first", wire::ReturnMode::first},
      {"strongest", wire::ReturnMode::strongest},
      {"dual", wire::ReturnMode::dual},
      {"triple", wire::ReturnMode::triple}};
  return modes;
}

jobs::RecordOptions job_of(const RecordChoices& options) {
  if (options.duration_s) check_positive(*options.duration_s, "--duration-s", "s");
  jobs::RecordOptions job;
  job.interface = options.interface;
  job.serials = options.serials;
  job.find_time = options.find_s;
  job.passive = options.passive;
  job.data_port = options.data_port;
  job.duration = options.duration_s;
  job.spherical.reset();
  if (options.coordinates != "as-is") job.spherical = options.coordinates == "spherical";
  if (const auto mode = return_modes().find(options.return_mode); mode != return_modes().end()) {
    job.return_mode = mode->second;
  }
  job.imu = options.imu == "yes";
  job.output = options.output;
  return job;
}

void print_found(const std::vector<jobs::FoundSensor>& found) {
  Table table({"serial number", "sensor", "address"});
  for (const jobs::FoundSensor& sensor : found) {
    table.add({sensor.serial, recordings::device_type_name(sensor.device_type),
               to_string(sensor.address)});
  }
  table.print();
}

std::string cause_text(const jobs::RecordedGap& gap) {
  switch (gap.cause) {
    case recordings::livox::GapCause::clock:
      return "the sensor's clock jumped or began again";
    case recordings::livox::GapCause::session:
      return fmt::format("between two sessions, {} packets at most", grouped(gap.lost.value_or(0)));
    case recordings::livox::GapCause::loss:
      break;
  }
  return fmt::format("{} packets", grouped(gap.lost.value_or(0)));
}

/// What the clock of a sensor did, and what it said of itself; the first lines are enough.
void print_clock(const jobs::RecordedSensor& one) {
  constexpr std::size_t kMostLines = 20;
  for (std::size_t i = 0; i < std::min(one.clocks.size(), kMostLines); ++i) {
    const jobs::RecordedClock& clock = one.clocks[i];
    if (!clock.drift && one.clocks.size() == 1) continue;
    say("{}: clock of {} from {:.1f} to {:.1f} s{}\n", one.sensor.serial, to_string(clock.source),
        clock.begin, clock.end,
        clock.drift ? fmt::format(", {:+.2f} +- {:.2f} ppm beside this machine's", clock.drift->ppm,
                                  clock.drift->sigma_ppm)
                    : "");
  }
  for (std::size_t i = 0; i < std::min(one.status_changes.size(), kMostLines); ++i) {
    const jobs::RecordedStatus& change = one.status_changes[i];
    const auto words = recordings::livox::status_words(change.status);
    if (words.empty() && i == 0) continue;
    say("{}: from {:.1f} s on {}\n", one.sensor.serial, change.begin,
        words.empty() ? "healthy" : fmt::format("{}", fmt::join(words, ", ")));
  }
}

void print_recorded(const jobs::RecordedSensors& recorded) {
  say("{}: {:.1f} s, {} bytes\n\n", recorded.output, recorded.duration, grouped(recorded.bytes));
  Table table({"sensor", "observations", "packets", "lost", "dropped by the kernel", "rejected"});
  for (const jobs::RecordedSensor& one : recorded.sensors) {
    table.add({one.sensor.serial, grouped(one.counts.rows), grouped(one.counts.packets),
               grouped(one.counts.lost), grouped(one.kernel_drops), grouped(one.rejected)});
  }
  table.print();
  for (const jobs::RecordedSensor& one : recorded.sensors) {
    for (const jobs::RecordedGap& gap : one.gaps) {
      say("{}: no {} from {:.1f} to {:.1f} s, {}\n", one.sensor.serial,
          gap.imu ? "inertial samples" : "points", gap.begin, gap.end, cause_text(gap));
    }
    print_clock(one);
  }
}

}  // namespace

Run declare_record(CLI::App& verb) {
  const auto options = std::make_shared<RecordChoices>();
  RecordChoices& o = *options;
  verb.add_option(
      "-o,--output", o.output,
      "Recording to write (.lvx, .nc); until the end it is an LVX file called FILE.unfinished");
  verb.add_option("--interface", o.interface,
                  "IPv4 address of this machine where the sensors are (default: the only one)")
      ->type_name("ADDRESS");
  auto* list = verb.add_flag("--list", o.list, "Only show which sensors are there");
  verb.add_flag("--passive", o.passive,
                "Only listen: record what sensors send to this address anyway, and send nothing")
      ->excludes(list);
  verb.add_option("--data-port", o.data_port, "Port of the data that --passive listens to")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  verb.add_option("--serial", o.serials,
                  "Serial number (broadcast code) of a sensor to record (repeatable; default: all)")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--find-s", o.find_s, "How long sensors are looked for, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  verb.add_option("--duration-s", o.duration_s,
                  "Length of the recording, s (default: until Ctrl-C or SIGTERM)")
      ->excludes(list);
  verb.add_option("--coordinates", o.coordinates, "What the sensors are to send")
      ->check(CLI::IsMember({"spherical", "cartesian", "as-is"}))
      ->capture_default_str();
  verb.add_option("--return-mode", o.return_mode, "Returns of a shot that the sensors are to send")
      ->check(CLI::IsMember({"first", "strongest", "dual", "triple", "as-is"}))
      ->capture_default_str();
  verb.add_option("--imu", o.imu, "Inertial samples of Avia, Horizon and Tele-15")
      ->check(CLI::IsMember({"yes", "no"}))
      ->capture_default_str();
  return [options](const CommonOptions& common) {
    const jobs::RecordOptions job = job_of(*options);
    if (options->list) {
      if (!options->output.empty()) throw InvalidArgument("--list writes no file: leave out -o");
      ProgressBar bar("looking for sensors", common);
      const auto found = jobs::find_sensors(job, bar.progress());
      if (common.json) {
        print_json(common, json::of(found));
      } else {
        print_found(found);
      }
      return kDone;
    }
    if (options->output.empty()) throw InvalidArgument("--output is required, or --list");
    jobs::RecordedSensors recorded;
    {
      ProgressBar bar("recording", common);
      recorded = jobs::record_sensors(
          job,
          [](const std::string& words, bool is_wrong) {
            spdlog::log(is_wrong ? spdlog::level::warn : spdlog::level::debug, words);
          },
          bar.progress());
    }
    if (common.json) {
      print_json(common, json::of(recorded));
    } else {
      print_recorded(recorded);
    }
    return kDone;
  };
}

}  // namespace risley::app
