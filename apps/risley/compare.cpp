// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <unordered_set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/jobs/compare_clouds.hpp"
#include "risley/jobs/compare_units.hpp"
#include "risley/jobs/result_files.hpp"
#include "risley/report/change_page.hpp"
#include "risley/report/units_page.hpp"
#include "risley/tables/table_file.hpp"

#include "command.hpp"
#include "result_folder.hpp"
#include "table.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

struct CompareOptions {
  jobs::CompareUnitsOptions job;
  cloud::ChangeOptions change;
  std::string page, table;
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
      "chance; changed: p below {:.2g}, so that an unchanged series is called changed with a "
      "probability of at most {:g}\n",
      compared.least_p_value, compared.false_alarm);
}

void print_fleet(const jobs::ComparedFleet& one, const jobs::ComparedUnits& compared) {
  say("\n{} units of {} against the median of all, each by its last result\n", one.units.size(),
      compared.units[one.units.front()].sensor);
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
  say("\nrobust z: distance from the median of the fleet in units of its spread and the sigma of "
      "the result; p: upper limit of the probability that chance puts any unit so far off\n");
}

/// Files listed in a table are inputs, too.
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

/// One row per cell.
void write_cells(const std::string& path, const jobs::ComparedClouds& compared,
                 const CommonOptions& told) {
  using enum tables::CellKind;
  std::vector<tables::TableColumn> columns;
  for (const char* axis : {"x", "y", "z"}) {
    columns.push_back({fmt::format("{}_m", axis), real, "m", "of the middle of the cell's points"});
  }
  for (const char* axis : {"x", "y", "z"}) {
    columns.push_back({fmt::format("normal_{}", axis), real, "1", "of the surface"});
  }
  columns.push_back({"distance_m", real, "m", "along the normal, from the first to the second"});
  columns.push_back({"sigma_m", real, "m", "of the distance where nothing changed"});
  columns.push_back({"significant", integer, "1", "1: beyond the level of detection"});
  columns.push_back({"points_a", integer, "1", "of the first cloud"});
  columns.push_back({"points_b", integer, "1", "of the second cloud"});
  tables::TableFile table(path, columns,
                          {{"title", "risley compare, one row per cell"},
                           {"command", told.command},
                           {"version", RISLEY_VERSION}});
  for (const cloud::SurfaceCell& cell : compared.change.cells) {
    table.add({cell.place.x(), cell.place.y(), cell.place.z(), cell.normal.x(), cell.normal.y(),
               cell.normal.z(), cell.distance, cell.sigma, std::int64_t{cell.significant},
               static_cast<std::int64_t>(cell.points_a), static_cast<std::int64_t>(cell.points_b)});
  }
  table.close();
}

ExitStatus run_compare_clouds(const std::vector<std::string>& names, const CompareOptions& options,
                              const CommonOptions& common) {
  CommonOptions told = common;
  told.inputs = names;
  require_apart(told, {options.page, options.table});
  if (!options.table.empty()) tables::TableFile::check_name(options.table);
  jobs::CompareCloudsOptions job{names[0], names[1], options.change};
  job.change.false_alarm = options.job.false_alarm;
  jobs::ComparedClouds compared;
  {
    ProgressBar bar("comparing", common);
    compared = jobs::compare_clouds(job, bar.progress());
  }
  if (!options.table.empty()) write_cells(options.table, compared, told);
  if (!options.page.empty()) {
    write_page_file(options.page, report::change_page(compared, provenance_of(told)));
  }
  log_warnings(compared.change.warnings);
  if (common.json) {
    Json json = json::of(compared);
    if (!options.table.empty()) json["table"] = options.table;
    if (!options.page.empty()) json["html"] = options.page;
    print_json(told, json);
    return kDone;
  }
  say("{}\n", report::change_words(compared));
  for (const auto& [name, file] :
       {std::pair{"table", options.table}, std::pair{"page", options.page}}) {
    if (!file.empty()) say("{}: {}\n", name, file);
  }
  return kDone;
}

ExitStatus run_compare(const CompareOptions& options, const CommonOptions& common) {
  std::vector<std::string> names;
  for (const jobs::GivenSensor& result : options.job.results) names.push_back(result.name());
  if (jobs::are_clouds(names)) return run_compare_clouds(names, options, common);
  if (!options.table.empty()) throw InvalidArgument("--table is for the cells of two clouds");
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
          "Folders written by estimate -o or calibrate -o, or calibration files, in order of time; "
          "also their tables (--table). Or two clouds (LAS) from cloud, the earlier one first")
      ->required()
      ->expected(1, 1'000'000);
  verb.add_option("-o,--output", o.page, "Page (HTML) to write (default: none)");
  verb.add_flag(
      "--unlike", o.job.unlike,
      "Also compare calibrations (true directions) with estimates (the sensor's own parameters)");
  verb.add_flag("--anywhere", o.job.anywhere,
                "Also open results outside the folder of the table that lists them");
  verb.add_option("--false-alarm", o.job.false_alarm,
                  "Largest probability that chance is taken for a change, or a unit for an "
                  "outlier; for clouds the share of unchanged cells flagged as changed")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  verb.add_option("--cell-size-m", o.change.cell, "Edge of the cells of clouds, m")
      ->capture_default_str();
  verb.add_option("--reach-m", o.change.reach,
                  "Largest expected displacement of surfaces in clouds, m")
      ->capture_default_str();
  verb.add_option("--table", o.table,
                  "Table to write with one row per cell of two clouds; the ending chooses the "
                  "format: .csv or .nc (NetCDF)")
      ->type_name("FILE");
  return [options](const CommonOptions& common) { return run_compare(*options, common); };
}

}  // namespace risley::app
