// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
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
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/core/text.hpp"
#include "risley/jobs/pattern_details.hpp"
#include "risley/jobs/write_pattern.hpp"
#include "risley/report/pattern_page.hpp"

#include "command.hpp"
#include "result_folder.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct PatternOptions {
  std::string sensor = "mid-40-sequence", format, output, firing, report;
  double duration_s = 1.0;
  std::optional<double> rate_hz;
  std::uint64_t every = 1;
  std::vector<double> start_angles_deg;
  bool coverage = false;
  std::vector<double> integration_s = sensors::CoverageOptions{}.after;
  double cell_deg = degrees_from_radians(sensors::CoverageOptions{}.cell);
};

std::string format_list() {
  std::string text;
  for (const jobs::PatternFormat& format : jobs::pattern_formats()) {
    text += fmt::format("\n  {:<10} {}", format.name, format.description);
  }
  return text;
}

sensors::ScanPatternOptions scan_options(const PatternOptions& options) {
  sensors::ScanPatternOptions scan;
  scan.shot_rate = options.rate_hz;
  scan.every = options.every;
  scan.whole_groups = options.every > 1;
  if (!options.firing.empty()) {
    scan.firing =
        options.firing == "together" ? sensors::Firing::together : sensors::Firing::in_turn;
  }
  for (const double angle_deg : options.start_angles_deg) {
    scan.rotation_angle.push_back(radians_from_degrees(angle_deg));
  }
  return scan;
}

void print_coverage(const sensors::PatternCoverage& coverage) {
  const double half_angle = degrees_from_radians(coverage.field_half_angle);
  say("field of view {:.5g} square degrees {}\n", coverage.field_solid_angle / kSquareDegree,
      coverage.all_around
          ? fmt::format("all around, at elevations of {:.2f} to {:.2f} degree", 90 - half_angle,
                        90 - degrees_from_radians(coverage.field_inner_angle))
          : fmt::format("within {:.2f} degree of the axis", half_angle));
  Table table(
      {"after, s", "shots", "covered, %", "mean, 1/deg2", "least", "greatest", "largest gap, deg"});
  for (const sensors::CoverageAfter& one : coverage.after) {
    table.add({fmt::format("{:g}", one.time), grouped(one.shots),
               fmt::format("{:.1f}", 100 * one.covered),
               fmt::format("{:.4g}", one.mean_density * kSquareDegree),
               fmt::format("{:.4g}", one.least_density * kSquareDegree),
               fmt::format("{:.4g}", one.greatest_density * kSquareDegree),
               fmt::format("{:.3f}", degrees_from_radians(one.gap))});
  }
  table.print();
  for (const int percent : sensors::kToldShares) {
    const double time = coverage.time_to_cover(0.01 * percent);
    if (std::isfinite(time)) say("{} % covered after {:.3g} s\n", percent, time);
  }
  say("covered: cells of {:g} degree with a shot, among those that {:g} s reach; gap: diameter of "
      "the largest empty circle\n",
      degrees_from_radians(coverage.cell), coverage.field_after);
}

void print_written(const jobs::WrittenPattern& written, const std::string& output) {
  say("{}: {} shots of sensor {}\n", output, grouped(written.rows), written.sensor);
  if (written.blocked > 0) {
    say("{} of them do not get through the prisms{}\n", grouped(written.blocked),
        written.format == "livox-csv" || written.format == "npy" ? " and are NaN" : "");
  }
  if (written.helios) {
    say("deviation from the pattern: {:.3g} degree (root mean square; {}), {:.3g} at most, over {} "
        "shots; a shot at time t is at t {} {:.6g} s there\n",
        degrees_from_radians(written.helios->rms), offset_text(written.helios->rms),
        degrees_from_radians(written.helios->worst), grouped(written.helios->compared),
        written.helios->time_lag < 0 ? '-' : '+', std::abs(written.helios->time_lag));
  }
  for (const std::string& one : written.not_carried) say("not carried: {}\n", one);
}

ExitStatus run_pattern(const PatternOptions& options, const CommonOptions& common) {
  const bool to_stdout = options.output == "-";
  const bool looks = options.coverage || !options.report.empty();
  if (options.output.empty() && !looks) {
    throw InvalidArgument("nothing to do: give --output FILE, --coverage or --report PAGE");
  }
  if (!options.output.empty() && options.format.empty()) {
    throw InvalidArgument(fmt::format("--output {} needs --format", options.output));
  }
  if (to_stdout && common.json) {
    throw InvalidArgument("--json needs a file: with -o - the pattern itself goes to stdout");
  }
  if (to_stdout && options.coverage) {
    throw InvalidArgument("--coverage prints on stdout, where -o - puts the pattern itself");
  }
  require_positive(kSetting.duration, options.duration_s);
  require_apart(common, {options.output, options.report});
  const sensors::ScanPatternOptions scan = scan_options(options);
  Json json = Json::object();
  std::optional<jobs::WrittenPattern> written;
  if (!options.output.empty()) {
    const jobs::WritePatternOptions wanted{options.sensor, options.format, options.output,
                                           options.duration_s, scan};
    ProgressBar bar("writing", common);
    written = to_stdout ? jobs::write_pattern(wanted, std::cout, bar.progress())
                        : jobs::write_pattern(wanted, bar.progress());
  }
  std::optional<jobs::PatternDetails> details;
  if (looks) {
    sensors::CoverageOptions coverage;
    coverage.after = options.integration_s;
    coverage.cell = radians_from_degrees(options.cell_deg);
    ProgressBar bar("counting", common);
    details = jobs::pattern_details(options.sensor, scan, coverage, bar.progress());
  }
  if (!options.report.empty()) {
    write_page_file(options.report, report::pattern_page(*details, provenance_of(common)));
  }
  if (to_stdout) {
    std::cout.flush();
    if (!std::cout) throw FileError("stdout", {}, "cannot be written");
    return kDone;
  }
  if (common.json) {
    if (written) {
      json = json::of(*written);
    } else {
      json = {{"rows", details->coverage.after.back().shots}, {"sensor", details->sensor.name}};
    }
    if (details) json["coverage"] = json::of(details->coverage);
    if (!options.report.empty()) json["html"] = options.report;
    print_json(common, json);
    return kDone;
  }
  if (written) print_written(*written, options.output);
  if (options.coverage) print_coverage(details->coverage);
  if (!options.report.empty()) say("page: {}\n", options.report);
  return kDone;
}

}  // namespace

Run declare_pattern(CLI::App& verb) {
  const auto options = std::make_shared<PatternOptions>();
  PatternOptions& o = *options;
  verb.add_option("-o,--output", o.output, "File to write; - is standard output");
  std::set<std::string> names;
  for (const jobs::PatternFormat& format : jobs::pattern_formats()) names.insert(format.name);
  verb.add_option("--format", o.format, "What to write:" + format_list())
      ->check(CLI::IsMember(names));
  verb.add_option("--sensor", o.sensor, "Preset by name, or a preset or calibration file")
      ->capture_default_str();
  verb.add_option("--duration-s", o.duration_s, "Length of the scan, s")->capture_default_str();
  verb.add_option("--rate-hz", o.rate_hz, "Shots per second, Hz (default: the sensor's)");
  verb.add_option(
          "--every", o.every,
          "Keep only the last of every N shots; of a sensor with several emitters, which fire in "
          "turn, the last of every N rounds of all of them")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000}))
      ->capture_default_str();
  verb.add_option(
          "--firing", o.firing,
          "When the emitters fire, where a sensor has several: 'in-turn', as in real sensors, or "
          "'together', as in the manufacturer's sequences (default: the preset's)")
      ->check(CLI::IsMember({"in-turn", "together"}));
  verb.add_option(
          "--start-angles-deg", o.start_angles_deg,
          "Rotation angles of the prisms at time 0, deg, as A,B or A,B,C (default: the preset's)")
      ->delimiter(',');
  verb.add_flag(
      "--coverage", o.coverage,
      "Print how the scan fills the field of view: share of cells with a shot, density, gaps");
  verb.add_option("--integration-s", o.integration_s,
                  "Times at which --coverage is evaluated, s, as T,T,...")
      ->delimiter(',')
      ->capture_default_str();
  verb.add_option("--cell-deg", o.cell_deg, "Side of the cells of --coverage, deg")
      ->capture_default_str();
  verb.add_option("--report", o.report, "Page (HTML) to write that shows the pattern as it grows");
  return [options](const CommonOptions& common) { return run_pattern(*options, common); };
}

}  // namespace risley::app
