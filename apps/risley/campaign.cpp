// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/campaign.hpp"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/error.hpp"
#include "risley/core/text.hpp"
#include "risley/io/text_file.hpp"
#include "risley/json/many_results.hpp"
#include "risley/report/campaign_page.hpp"

#include "command.hpp"
#include "result_folder.hpp"
#include "table.hpp"
#include "warning_log.hpp"

namespace risley::app {
namespace {

constexpr std::size_t kMostShownSettings = 8;

struct CampaignCommandOptions {
  std::string plan, folder, chunk, table;
  bool merge = false;
};

/// I/N
jobs::ChunkNumber chunk_number_from(const std::string& text) {
  jobs::ChunkNumber which;
  const char* const end = text.data() + text.size();
  const auto [slash, first] = std::from_chars(text.data(), end, which.number);
  if (first == std::errc() && slash != end && *slash == '/') {
    const auto [last, second] = std::from_chars(slash + 1, end, which.count);
    if (second == std::errc() && last == end) return which;
  }
  throw InvalidArgument(
      fmt::format("--chunk: found {}, expected I/N, as in 3/40: chunk 3 of 40", text));
}

std::string ratio(double value) {
  return std::isfinite(value) ? fmt::format("{:.3f}", value) : "-";
}

std::string band(const jobs::BandedFigure& figure) {
  if (!std::isfinite(figure.low)) return "-";
  return fmt::format("{:.3f} to {:.3f}", figure.low, figure.high);
}

void print_parameters(const jobs::SettingSummary& summary) {
  Table table({"parameter", "mean error", "rms error", "bound", "unit", "error/bound", "95 of 100",
               "in 2 sigma", "95 of 100"});
  for (const jobs::ParameterSummary& one : summary.parameters) {
    const ParameterInfo& info = find_parameter(one.name, summary.shape);
    const auto text = [&](double value) { return fmt::format("{:.3g}", value / info.si_per_unit); };
    table.add({one.name, text(one.bias), text(one.rmse), text(one.bound), info.unit,
               ratio(one.error_over_bound.value), band(one.error_over_bound),
               ratio(one.within_two_sigma.value), band(one.within_two_sigma)});
  }
  table.print();
}

void print_merged(const jobs::CampaignResult& merged, const std::string& page) {
  say("{} of {} cells\ntable: {}\npage: {}\n\n{}\n", grouped(merged.done), grouped(merged.cells),
      merged.table, page, report::campaign_words(merged));
  const auto words = [](const jobs::SettingSummary& one) {
    return one.grid.empty() ? std::string("all") : jobs::grid_words(one.grid);
  };
  say("\n");
  Table table({"setting", "cells", "answered", "error/bound", "NEES", "95 of 100"});
  for (const jobs::SettingSummary& one : merged.settings) {
    table.add({words(one), grouped(one.cells), grouped(one.answered), ratio(one.error_over_bound),
               ratio(one.nees.value), band(one.nees)});
  }
  table.print();
  if (merged.settings.size() <= kMostShownSettings) {
    for (const jobs::SettingSummary& one : merged.settings) {
      say("\n{}\n", words(one));
      print_parameters(one);
    }
  }
  say("\nbound: root mean square of the stated sigmas, given the held parameters; 95 of 100: "
      "the range of the preceding figure in 95 of 100 campaigns if the covariances are correct\n");
}

/// The missing cells, in words; empty if none is missing.
std::optional<FileError> damage_of(const jobs::CampaignResult& merged, const std::string& folder) {
  if (merged.missing.empty()) return std::nullopt;
  std::string ranges;
  for (const auto& [first, last] : merged.missing) {
    if (ranges.size() > 200) {
      ranges += ", ...";
      break;
    }
    if (!ranges.empty()) ranges += ", ";
    ranges += first == last ? fmt::format("{}", first) : fmt::format("{}-{}", first, last);
  }
  return FileError(
      folder, {},
      fmt::format(
          "{} of {} cells have no result ({}): rerun their chunks; complete chunks are skipped",
          merged.cells - merged.done, merged.cells, ranges));
}

std::string summary_in(const std::string& folder) {
  return (std::filesystem::path(folder) / "summary.json").string();
}
std::string page_in(const std::string& folder) {
  return (std::filesystem::path(folder) / "report.html").string();
}

ExitStatus tell_merged(const jobs::CampaignResult& merged, const CampaignCommandOptions& options,
                       const CommonOptions& common) {
  const std::optional<FileError> damage = damage_of(merged, options.folder);
  Json json = json::of(merged);
  if (damage) json["error"] = damage->what();
  const std::string summary = summary_in(options.folder);
  io::write_text_file(summary, with_head(common, json).dump(2) + "\n");
  json["summary"] = summary;
  const std::string page = page_in(options.folder);
  write_page_file(page, report::campaign_page(merged, provenance_of(common)));
  json["html"] = page;
  log_warnings(merged.warnings);
  if (common.json) {
    print_json(common, json::with_status(json, damage));
  } else {
    print_merged(merged, page);
  }
  if (!damage) return kDone;
  spdlog::error(damage->what());
  return kBadFile;
}

ExitStatus run_campaign(CampaignCommandOptions options, const CommonOptions& typed) {
  if (!options.chunk.empty() && options.merge) {
    throw InvalidArgument(
        "--chunk and --merge cannot be combined: merge when all chunks are complete");
  }
  if (!options.chunk.empty() && !options.table.empty()) {
    throw InvalidArgument("--table goes with --merge, not with --chunk");
  }
  if (options.table.empty()) {
    options.table = (std::filesystem::path(options.folder) / "cells.csv").string();
  }
  const jobs::CampaignPlan plan = jobs::load_campaign_plan(options.plan, typed.seed);
  CommonOptions common = typed;
  common.files.insert(common.files.end(), plan.files.begin(), plan.files.end());
  require_apart(common, {options.table, summary_in(options.folder), page_in(options.folder)});
  const jobs::CampaignOptions job{options.folder, "risley " RISLEY_VERSION};
  if (!options.chunk.empty()) {
    const jobs::ChunkNumber which = chunk_number_from(options.chunk);
    jobs::CampaignChunk chunk;
    {
      ProgressBar bar("computing cells", common);
      chunk = jobs::run_chunk(plan, which, job, bar.progress());
    }
    if (common.json) {
      print_json(common, json::of(chunk));
    } else {
      say("{}: {} cells{}\n", chunk.file, grouped(chunk.cells),
          chunk.made_before ? ", made before" : "");
    }
    return kDone;
  }
  jobs::CampaignResult merged;
  {
    ProgressBar bar(options.merge ? "merging" : "computing cells", common);
    merged = options.merge ? jobs::merge_chunks(plan, options.table, job, bar.progress())
                           : jobs::run_campaign(plan, options.table, job, bar.progress());
  }
  return tell_merged(merged, options, common);
}

}  // namespace

Run declare_campaign(CLI::App& verb) {
  const auto options = std::make_shared<CampaignCommandOptions>();
  CampaignCommandOptions& o = *options;
  verb.add_option("PLAN", o.plan,
                  "Plan (YAML): what to simulate, how to process it, a grid of settings, and the "
                  "number of seeds")
      ->required();
  verb.add_option("-o,--output", o.folder,
                  "Folder for the results: chunks/, cells.csv, summary.json and report.html")
      ->required();
  verb.add_option("--chunk", o.chunk,
                  "Compute only chunk I of N; complete chunks are not computed again (default: all "
                  "chunks, then the merge)")
      ->type_name("I/N");
  verb.add_flag("--merge", o.merge, "Make the table and the summary from the existing chunks");
  verb.add_option(
          "--table", o.table,
          "Table to write with one row per cell; the ending chooses the format: .csv or .nc "
          "(NetCDF) (default: cells.csv in the folder)")
      ->type_name("FILE");
  return [options](const CommonOptions& common) { return run_campaign(*options, common); };
}

}  // namespace risley::app
