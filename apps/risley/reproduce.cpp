// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "reproduction/reproduce.hpp"

#include <filesystem>
#include <memory>
#include <string>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/jobs/recording_input.hpp"
#include "risley/jobs/result_folder.hpp"
#include "risley/jobs/sensor_choice.hpp"

#include "command.hpp"
#include "reading_options.hpp"
#include "reproduction/reproduction_page.hpp"
#include "result_folder.hpp"
#include "table.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

using reproduction::Check;
using reproduction::Reproduction;
using reproduction::Row;

struct ReproduceCommandOptions {
  std::string folder, recording;
  ReadingWishes reading;
  bool full = false;
};

/// A number that is not finite prints as null.
Json row_json(const Row& row) {
  Json object = {{"term", row.term},
                 {"paper", row.paper ? Json(row.paper->value) : Json()},
                 {"paper_text", row.paper ? Json(row.paper->text) : Json()},
                 {"ours", row.ours},
                 {"unit", row.unit},
                 {"pass", passes(row)},
                 {"bound", bound_text(row)},
                 {"reason", reason_text(row)}};
  if (row.sigma) object["sigma"] = *row.sigma;
  if (row.distribution) {
    object["distribution"] = {{"quantile_05", row.distribution->low},
                              {"median", row.distribution->median},
                              {"quantile_95", row.distribution->high},
                              {"percentile_of_paper", row.distribution->percentile},
                              {"draws", row.distribution->draws}};
  }
  Json checks = Json::array();
  for (const Check& check : row.checks) {
    checks.push_back({{"what", check.what},
                      {"value", check.value},
                      {"least", check.least},
                      {"greatest", check.greatest},
                      {"why", check.why},
                      {"pass", passes(check)}});
  }
  object["checks"] = checks;
  if (!row.note.empty()) object["note"] = row.note;
  return object;
}

Json reproduction_json(const Reproduction& found, const jobs::Provenance& provenance) {
  Json tables = Json::object();
  for (const reproduction::Table& table : found.tables) {
    Json rows = Json::array();
    for (const Row& row : table.rows) rows.push_back(row_json(row));
    tables[table.name] = {{"title", table.title}, {"method", table.method}, {"rows", rows}};
  }
  Json origin = Json::object();
  for (const auto& [name, value] : provenance) origin[name] = value;
  return {{"rows", row_count(found)},
          {"passed", passed_count(found)},
          {"tables", tables},
          {"provenance", origin}};
}

void print_reproduction(const Reproduction& found) {
  for (const reproduction::Table& table : found.tables) {
    say("{}\n", table.title);
    Table text({"", "term", "paper", "ours", "unit"});
    for (const Row& row : table.rows) {
      text.add({passes(row) ? "pass" : "FAIL", row.term, row.paper ? row.paper->text : "-",
                fmt::format("{:.6g}", row.ours), row.unit});
    }
    text.print();
    say("\n");
  }
  for (const reproduction::Table& table : found.tables) {
    for (const Row& row : table.rows) {
      if (!passes(row)) say("{}, {}: {}\n", table.name, row.term, reason_text(row));
    }
  }
  say("{} of {} rows pass\n", passed_count(found), row_count(found));
}

/// The recording of a real unit, read as estimate reads one.
reproduction::RealRecording real_recording(const std::string& path, const ReadingWishes& reading,
                                           const CommonOptions& common) {
  ProgressBar bar("reading", common);
  jobs::EstimationInput input =
      jobs::read_for_estimation({path, read_options(reading), {}, {}}, bar.progress());
  log_warnings(path, input.warnings);
  return {std::filesystem::path(path).filename().string(), std::move(input.choice.sensor),
          input.series.rows(), std::move(input.head)};
}

ExitStatus run_reproduce(const ReproduceCommandOptions& options, const CommonOptions& common) {
  const auto path = [&](const char* name) {
    return (std::filesystem::path(options.folder) / name).string();
  };
  require_apart(common, {path("report.html"), path("reproduction.json")});
  jobs::ResultFolder folder(options.folder);
  reproduction::ReproduceOptions settings;
  settings.seed = common.seed;
  if (options.full) settings.effort = reproduction::kFullEffort;
  std::vector<recordings::Source> inputs;
  if (!options.recording.empty()) {
    settings.recording = real_recording(options.recording, options.reading, common);
    inputs.emplace_back(options.recording);
  }
  Reproduction found;
  {
    ProgressBar bar("reproducing", common);
    found = reproduction::reproduce(settings, bar.progress());
  }
  const jobs::Provenance provenance = jobs::with_inputs(provenance_of(common), inputs);
  const Json object = with_head(common, reproduction_json(found, provenance));
  folder.add_text({"report.html", reproduction::reproduction_page(found, provenance)});
  folder.add_text(
      {"reproduction.json", object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"});
  log_warnings(folder.commit());
  if (common.json) {
    print_json(common, object);
  } else {
    print_reproduction(found);
  }
  return passed_count(found) == row_count(found) ? kDone : kNumbersFailed;
}

}  // namespace

Run declare_reproduce(CLI::App& verb) {
  const auto options = std::make_shared<ReproduceCommandOptions>();
  ReproduceCommandOptions& o = *options;
  verb.add_option("-o,--output", o.folder, "Folder to write reproduction.json and report.html to")
      ->required();
  verb.add_flag(
      "--full", o.full,
      "Use more random draws, and all 100,000 shots per second for Table 3 (takes minutes)");
  verb.add_option("--recording", o.recording,
                  "Recording of a real, stationary Mid-40 for section 3.1");
  add_reading_options(verb, o.reading);
  return [options](const CommonOptions& common) { return run_reproduce(*options, common); };
}

}  // namespace risley::app
