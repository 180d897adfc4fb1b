// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/live_bags.hpp"
#include "risley/jobs/record_sensors.hpp"
#include "risley/report/watch_page.hpp"
#include "risley/wire/event_server.hpp"

#include "command.hpp"
#include "message_options.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

constexpr const char* kOwnBeginning = "own";

struct RecordChoices {
  std::string output, interface, optics, watch, coordinates = "spherical", return_mode = "as-is",
                                                imu = "yes";
  bool list = false, passive = false;
  std::vector<std::string> serials;
  std::string publish;
  jobs::LivePointsOptions points;
  std::string calibration;
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
  job.watch_optics = !options.optics.empty() || !options.watch.empty();
  if (options.optics != kOwnBeginning) job.optics_reference = options.optics;
  if (!options.publish.empty()) {
    job.publish = options.points;
    job.publish->calibration = options.calibration;
  }
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
      return "the sensor's clock jumped or restarted";
    case recordings::livox::GapCause::session:
      return fmt::format("between two sessions, {} packets at most", grouped(gap.lost.value_or(0)));
    case recordings::livox::GapCause::loss:
      break;
  }
  return fmt::format("{} packets", grouped(gap.lost.value_or(0)));
}

/// Clock events and reports of a sensor; the first lines are enough.
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
  for (std::size_t i = 0; i < std::min(one.reports.size(), kMostLines); ++i) {
    const wire::SensorReport& report = one.reports[i].report;
    auto words = wire::trouble_words(report);
    constexpr std::uint8_t kPtp = 1, kGps = 2;
    if (report.sync == kPtp) words.insert(words.begin(), "time from PTP");
    if (report.sync == kGps) words.insert(words.begin(), "time from GPS");
    if (report.work_state) {
      words.insert(words.begin(), wire::work_state_words(*report.work_state));
    }
    say("{}: from {:.1f} s on {}\n", one.sensor.serial, one.reports[i].begin,
        fmt::join(words, ", "));
  }
  if (one.coldest) {
    say("{}: {:.1f} to {:.1f} deg C\n", one.sensor.serial, *one.coldest, *one.warmest);
  }
}

/// The page of the recording, as --watch has it.
std::unique_ptr<wire::EventServer> serve_page(const RecordChoices& options,
                                              const CommonOptions& common) {
  if (options.watch.empty()) return nullptr;
  const auto text = [](const char* path, const char* type, std::string_view body) {
    return wire::ServedText{path, fmt::format("{}; charset=utf-8", type), std::string(body)};
  };
  auto server = std::make_unique<wire::EventServer>(
      wire::listening_endpoint(options.watch),
      std::vector<wire::ServedText>{text("/", "text/html", report::watch_page()),
                                    text("/watch.js", "text/javascript", report::watch_script()),
                                    text("/watch.css", "text/css", report::watch_style())});
  if (!common.quiet) {
    fmt::print(stderr, "watch it at http://{}/\n", to_string(server->local()));
    std::fflush(stderr);
  }
  return server;
}

/// Viewers or nodes that receive points while the recording runs.
std::unique_ptr<jobs::LiveBag> publish_points(const RecordChoices& options,
                                              const CommonOptions& common) {
  if (options.publish.empty()) return nullptr;
  auto points = jobs::open_live_bag(options.publish);
  if (!common.quiet) {
    fmt::print(stderr, "points at {}\n", points->place());
    std::fflush(stderr);
  }
  return points;
}

/// An event of the page: one line, even if texts from the network contain line breaks.
std::string event_of(const jobs::LiveRecording& live) {
  return json::of(live).dump(-1, ' ', true, json::Json::error_handler_t::replace);
}

/// State of the optics in a few words.
std::string optics_words(const jobs::OpticsHealth& health) {
  const estimation::RunningState& state = health.state;
  if (!health.words.empty()) return "not watched";
  if (state.alarmed) return "OPTICS CHANGED";
  if (state.unfit_in_a_row > 0) return "not described by the optics";
  using Phase = estimation::RunningState::Phase;
  if (state.phase == Phase::waiting) return "optics: waiting for shots";
  if (state.phase == Phase::beginning) return "optics: getting to know them";
  return state.alarm ? "optics: changed before" : "optics: no change seen";
}

/// The state of the recording in one line on stderr, if shows_progress(); the destructor clears it.
class StatusLine {
 public:
  explicit StatusLine(const CommonOptions& common) : visible_(shows_progress(common)) {}
  ~StatusLine() { clear(); }
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  void show(const jobs::LiveRecording& live) {
    if (!visible_) return;
    std::string text = fmt::format("{:.1f} s", live.duration);
    for (const jobs::LiveSensorState& one : live.sensors) {
      text += fmt::format(" | {}: {} packets, {} lost", one.sensor.serial,
                          grouped(one.counts.packets), grouped(one.counts.lost));
      if (one.silent) text += ", SILENT";
      if (!one.optics) continue;
      text += ", " + optics_words(*one.optics);
      for (std::size_t k = 0; k < one.optics->state.speeds.size(); ++k) {
        text += fmt::format("{}{:.0f}", k == 0 ? ", rotors " : " ",
                            degrees_from_radians(one.optics->state.speeds[k].value));
      }
      if (!one.optics->state.speeds.empty()) text += " deg/s";
    }
    winsize size{};
    const bool known = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
    text.resize(std::min<std::size_t>(text.size(), known ? size.ws_col - 1U : 79U));
    fmt::print(stderr, "\r\033[K{}", text);
    std::fflush(stderr);
    shown_ = true;
  }
  /// Before something else is said.
  void clear() {
    if (std::exchange(shown_, false)) std::fputs("\r\033[K", stderr);
  }

 private:
  bool visible_, shown_ = false;
};

void print_published(const std::string& serial, const jobs::PublishedPoints& points) {
  if (!points.words.empty()) say("{}: no points were published: {}\n", serial, points.words);
  say("{}: {} points in {} frames published, with {}", serial, grouped(points.points),
      grouped(points.frames), points.calibration.empty() ? "no preset" : points.calibration);
  if (points.latency) {
    say("; 99 % of the frames within {:.0f} ms of their first packet, all within {:.0f} ms",
        1e3 * *points.latency, 1e3 * *points.longest_latency);
  }
  say("\n");
  if (points.missing_packets > 0) {
    say("{}: {} packets came too late or too fast for it, but are in the file\n", serial,
        grouped(points.missing_packets));
  }
}

void print_recorded(const jobs::RecordedSensors& recorded) {
  for (const auto& file : recorded.files) {
    say("{}: {:.1f} s, {} bytes\n", file.path, recorded.duration, grouped(file.bytes));
  }
  say("\n");
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
  for (const jobs::RecordedSensor& one : recorded.sensors) {
    if (one.published) print_published(one.sensor.serial, *one.published);
  }
  if (recorded.viewers) {
    say("{} viewers, {} frames sent, {} dropped for slow viewers\n",
        grouped(recorded.viewers->connections), grouped(recorded.viewers->sent_messages),
        grouped(recorded.viewers->dropped_messages));
  }
  for (const jobs::RecordedSensor& one : recorded.sensors) {
    if (!one.optics) continue;
    const jobs::OpticsHealth& health = *one.optics;
    using Phase = estimation::RunningState::Phase;
    std::string words = "no change of the optics detected";
    if (!health.words.empty()) {
      words = "optics not watched: " + health.words;
    } else if (health.state.alarm) {
      words = "ALARM: " + jobs::alarm_words(health);
    } else if (health.state.phase != Phase::watching) {
      words = "optics not compared: " + (health.state.reason.empty()
                                             ? std::string("the recording is too short")
                                             : health.state.reason);
    }
    say("{}: {}\n", one.sensor.serial, words);
    if (health.dropped_packets > 0) {
      say("{}: the watch was too slow for {} packets, which are still in the file\n",
          one.sensor.serial, grouped(health.dropped_packets));
    }
  }
}

}  // namespace

Run declare_record(CLI::App& verb) {
  const auto options = std::make_shared<RecordChoices>();
  RecordChoices& o = *options;
  verb.add_option(
      "-o,--output", o.output,
      "Recording to write (.lvx, .lvx2, .nc); until the end it is an LVX file called "
      "FILE.unfinished. "
      "Sensors of the second generation are written to the .lvx2 of this name, others to the .lvx");
  verb.add_option("--interface", o.interface,
                  "IPv4 address of this machine on the sensors' network (default: the only one)")
      ->type_name("ADDRESS");
  auto* list = verb.add_flag("--list", o.list, "Only list the sensors that are found");
  verb.add_flag("--passive", o.passive,
                "Only listen: send nothing, and record the packets that arrive at this address")
      ->excludes(list);
  verb.add_option("--data-port", o.data_port, "Data port on which --passive listens")
      ->check(CLI::Range(1, 65535))
      ->capture_default_str();
  verb.add_option("--serial", o.serials,
                  "Serial number (broadcast code) of a sensor to record (repeatable; default: all)")
      ->expected(1)
      ->allow_extra_args(false)
      ->take_all();
  verb.add_option("--find-s", o.find_s, "Time to search for sensors, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  verb.add_option("--duration-s", o.duration_s,
                  "Length of the recording, s (default: until Ctrl-C or SIGTERM)")
      ->excludes(list);
  add_choice(verb, "--coordinates", o.coordinates, {"spherical", "cartesian", "as-is"},
             "Coordinates to request from the sensors; those of the second generation send "
             "Cartesian coordinates unless as-is");
  add_choice(verb, "--return-mode", o.return_mode,
             {"first", "strongest", "dual", "triple", "as-is"},
             "Returns per shot to request from the sensors");
  verb.add_option("--optics", o.optics,
                  "Raise an alarm when the optics change: 'own' compares with the first seconds, a "
                  "preset or calibration also with that")
      ->type_name("own|NAME|FILE")
      ->excludes(list);
  verb.add_option("--watch", o.watch,
                  "Serve a page that shows the recording and its optics while it runs, at this "
                  "port of 127.0.0.1 or at an address and port of this machine")
      ->type_name("[ADDRESS:]PORT")
      ->excludes(list);
  auto* publish =
      verb.add_option("--publish", o.publish,
                      "Send points with covariance during the recording: to Foxglove-compatible "
                      "viewers at this port of 127.0.0.1 or at an address and port of this "
                      "machine, or to ROS 2 in this DDS domain (default: ROS_DOMAIN_ID or 0)")
          ->type_name("foxglove:[ADDRESS:]PORT|dds[:DOMAIN]")
          ->excludes(list);
  verb.add_option("--calibration", o.calibration,
                  "Calibration of the points that are published (default: the preset of the "
                  "sensor's type, with directions as the sensor reports them)")
      ->needs(publish);
  add_topic_options(verb, o.points.messages, o.points.messages.topic, "that are published");
  add_choice(verb, "--imu", o.imu, {"yes", "no"}, "Inertial samples, from sensors that have them");
  return [options](const CommonOptions& common) {
    end_in_own_time();
    jobs::RecordOptions job = job_of(*options);
    if (options->list) {
      if (!options->output.empty()) throw InvalidArgument("--list writes no file: omit -o");
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
      const auto page = serve_page(*options, common);
      const auto points = publish_points(*options, common);
      if (points) job.publish->bag = points.get();
      StatusLine line(common);
      recorded = jobs::record_sensors(
          job,
          [&line](const std::string& words, bool is_wrong) {
            line.clear();
            spdlog::log(is_wrong ? spdlog::level::warn : spdlog::level::debug, words);
          },
          cancellable(),
          [&](const jobs::LiveRecording& live) {
            line.show(live);
            if (page) page->send(event_of(live));
          });
      if (points) {
        points->close();
        recorded.viewers = points->viewers();
      }
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
