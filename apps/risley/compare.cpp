// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <unordered_set>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/jobs/compare_units.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/report/units_page.hpp"

#include "command.hpp"
#include "result_folder.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct CompareOptions {
  jobs::CompareUnitsOptions job;
  std::string page;
};

NumberText degrees_text(double value, double sigma) {
  return number_text(degrees_from_radians(value), degrees_from_radians(sigma));
}

void print_pairs(const jobs::ComparedUnits& compared) {
  Table table({"from", "to", "one unit", "directions apart deg", "+- sigma", "shape deg",
               "+- sigma", "p", "answer"});
  for (const jobs::ComparedPair& pair : compared.pairs) {
    const jobs::ResultComparison& c = pair.comparison;
    const NumberText total = degrees_text(c.beams.errors.total, c.beams.total_sigma);
    const NumberText shape = degrees_text(c.beams.errors.shape, c.beams.shape_sigma);
    table.add({compared.results[pair.a], compared.results[pair.b], jobs::one_unit_words(c),
               total.value, total.sigma, shape.value, shape.sigma,
               c.change.degrees_of_freedom > 0 ? fmt::format("{:.2g}", c.change.p_value) : "-",
               jobs::answer_words(pair)});
  }
  table.print();
  say("\np: probability that differences of the parameters are as large as these, or larger, by "
      "chance; changed: p below {:.2g}, so that a series without any change is called changed "
      "with a probability of {:g} at most\n",
      compared.least_p_value, compared.false_alarm);
}

void print_fleet(const jobs::ComparedFleet& one, const jobs::ComparedUnits& compared) {
  say("\n{} units of {} against the middle of all of them, each by its last result\n",
      one.units.size(), compared.units[one.units.front()].sensor);
  Table table({"unit", "result", "directions apart deg", "+- sigma", "shape deg", "+- sigma",
               "furthest off in", "robust z", "p", "answer"});
  for (std::size_t i = 0; i < one.units.size(); ++i) {
    const jobs::ComparedUnit& unit = compared.units[one.units[i]];
    const jobs::FleetUnit& found = one.fleet.units[i];
    const NumberText total = degrees_text(found.beams.errors.total, found.beams.total_sigma);
    const NumberText shape = degrees_text(found.beams.errors.shape, found.beams.shape_sigma);
    table.add({unit.serial, compared.results[unit.results.back()], total.value, total.sigma,
               shape.value, shape.sigma, jobs::worst_words(found, one.fleet),
               found.tested ? fmt::format("{:.1f}", found.worst_z) : "-",
               found.tested ? fmt::format("{:.2g}", found.p_value) : "-",
               jobs::answer_words(found)});
  }
  table.print();
  say("\nrobust z: distance from the middle of the fleet in units of its spread and the sigma of "
      "the result; p: probability that chance puts any unit of the fleet so far off, at most\n");
}

/// Files that a table leads to are inputs, too.
void add_results_of_tables(const jobs::ComparedUnits& compared, CommonOptions& common) {
  const std::unordered_set<std::string> named(common.inputs.begin(), common.inputs.end());
  for (const std::string& result : compared.results) {
    const std::string file = jobs::calibration_in(result).value_or(result);
    std::error_code ignored;
    if (!named.contains(file) && std::filesystem::is_regular_file(file, ignored)) {
      common.inputs.push_back(file);
    }
  }
}

ExitStatus run_compare(const CompareOptions& options, const CommonOptions& common) {
  require_apart(common, {options.page});
  jobs::ComparedUnits compared;
  {
    ProgressBar bar("comparing", common);
    compared = jobs::compare_units(options.job, bar.progress());
  }
  CommonOptions told = common;
  add_results_of_tables(compared, told);
  require_apart(told, {options.page});
  if (!options.page.empty()) {
    write_page_file(options.page, report::units_page(compared, provenance_of(told)));
  }
  if (common.json) {
    Json json = json::of(compared);
    if (!options.page.empty()) json["html"] = options.page;
    print_json(told, json);
  } else {
    if (!compared.pairs.empty()) print_pairs(compared);
    for (const jobs::ComparedFleet& fleet : compared.fleets) print_fleet(fleet, compared);
    if (!options.page.empty()) say("page: {}\n", options.page);
  }
  ExitStatus status = kDone;
  for (const jobs::LeftOut& one : compared.left_out) {
    spdlog::log(one.failed ? spdlog::level::err : spdlog::level::warn, "{} is left out: {}",
                one.name, one.reason);
    if (one.failed) status = kBadFile;
  }
  return status;
}

}  // namespace

Run declare_compare(CLI::App& verb) {
  const auto options = std::make_shared<CompareOptions>();
  CompareOptions& o = *options;
  verb.add_option(
          "RESULT", o.job.results,
          "Folders that estimate -o or calibrate -o wrote, or calibration files, in order of "
          "time; also tables that these wrote with --table")
      ->required()
      ->expected(1, 1'000'000);
  verb.add_option("-o,--output", o.page, "Page (HTML) to write (default: none)");
  verb.add_flag(
      "--unlike", o.job.unlike,
      "Also compare calibrations (where beams truly go) with estimates (what the sensor believes)");
  verb.add_flag("--anywhere", o.job.anywhere,
                "Also open results outside the folder of the table that names them");
  verb.add_option(
          "--false-alarm", o.job.false_alarm,
          "Probability that chance is taken for a change, or a unit for an outlier, at most")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  return [options](const CommonOptions& common) { return run_compare(*options, common); };
}

}  // namespace risley::app
