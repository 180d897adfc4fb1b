// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/jobs/write_pattern.hpp"

#include "command.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct PatternOptions {
  std::string sensor = "mid-40-sequence", format, output, firing;
  double duration_s = 1.0;
  std::optional<double> rate_hz;
  std::uint64_t every = 1;
  std::vector<double> start_angles_deg;
};

std::string format_list() {
  std::string text;
  for (const jobs::PatternFormat& format : jobs::pattern_formats()) {
    text += fmt::format("\n  {:<10} {}", format.name, format.description);
  }
  return text;
}

ExitStatus run_pattern(const PatternOptions& options, const CommonOptions& common) {
  check_positive(options.duration_s, "--duration-s", "s");
  jobs::WritePatternOptions wanted;
  wanted.sensor = options.sensor;
  wanted.format = options.format;
  wanted.output = options.output;
  wanted.duration = options.duration_s;
  wanted.scan.shot_rate = options.rate_hz;
  wanted.scan.every = options.every;
  if (!options.firing.empty()) {
    wanted.scan.firing =
        options.firing == "together" ? sensors::Firing::together : sensors::Firing::in_turn;
  }
  for (const double angle_deg : options.start_angles_deg) {
    wanted.scan.rotation_angle.push_back(radians_from_degrees(angle_deg));
  }
  const bool to_stdout = options.output == "-";
  if (to_stdout && common.json) {
    throw InvalidArgument("--json needs a file: with -o - the pattern itself goes to stdout");
  }
  jobs::WrittenPattern written;
  {
    ProgressBar bar("writing", common);
    written = to_stdout ? jobs::write_pattern(wanted, std::cout, bar.progress())
                        : jobs::write_pattern(wanted, bar.progress());
  }
  if (to_stdout) {
    std::cout.flush();
    if (!std::cout) throw FileError("stdout", {}, "cannot be written");
    return kDone;
  }
  if (common.json) {
    print_json(common, {{"rows", written.rows},
                        {"blocked", written.blocked},
                        {"sensor", written.sensor},
                        {"format", options.format},
                        {"firing", written.firing},
                        {"output", options.output}});
    return kDone;
  }
  fmt::print("{}: {} shots of sensor {}\n", options.output, grouped(written.rows), written.sensor);
  if (written.blocked > 0) {
    fmt::print("{} of them do not get through the prisms and are NaN\n", grouped(written.blocked));
  }
  return kDone;
}

}  // namespace

Run declare_pattern(CLI::App& verb) {
  const auto options = std::make_shared<PatternOptions>();
  PatternOptions& o = *options;
  verb.add_option("-o,--output", o.output, "File to write; - is standard output")->required();
  std::set<std::string> names;
  for (const jobs::PatternFormat& format : jobs::pattern_formats()) names.insert(format.name);
  verb.add_option("--format", o.format, "What to write:" + format_list())
      ->check(CLI::IsMember(names))
      ->required();
  verb.add_option("--sensor", o.sensor, "Preset by name, or a preset or calibration file")
      ->capture_default_str();
  verb.add_option("--duration-s", o.duration_s, "Length of the scan")->capture_default_str();
  verb.add_option("--rate-hz", o.rate_hz, "Shots per second (default: the sensor's)");
  verb.add_option("--every", o.every, "Keep the last of so many shots")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000}))
      ->capture_default_str();
  verb.add_option(
          "--firing", o.firing,
          "When the emitters of a sensor that has several fire: in-turn, as real sensors, or "
          "together, as in the maker's sequences (default: as the preset says)")
      ->check(CLI::IsMember({"in-turn", "together"}));
  verb.add_option("--start-angles-deg", o.start_angles_deg,
                  "Rotation angles of the prisms at time 0, A,B (default: the preset's)")
      ->delimiter(',');
  return [options](const CommonOptions& common) { return run_pattern(*options, common); };
}

}  // namespace risley::app
