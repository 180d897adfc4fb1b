// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/error.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/report/comparison_page.hpp"
#include "risley/report/report_file.hpp"

#include "command.hpp"
#include "result_folder.hpp"

namespace risley::app {
namespace {

namespace fs = std::filesystem;

struct ReportCommandOptions {
  std::vector<std::string> folders;
  std::string page;
};

report::Report report_of(const std::string& path) {
  const fs::path folder(path), data = folder / "report.json";
  if (!fs::is_directory(folder)) {
    throw FileError(path, {}, "expected a folder written by estimate or calibrate");
  }
  if (!fs::exists(data)) {
    throw FileError(data.string(), {},
                    "is missing: estimate -o and calibrate -o write it beside calibration.yaml");
  }
  jobs::require_settled(path);
  return report::read_report(data.string());
}

ExitStatus write_page(const std::string& page, const std::string& html, const Json& facts,
                      const CommonOptions& common) {
  write_page_file(page, html);
  if (common.json) {
    Json json{{"html", page}, {"bytes", html.size()}};
    json.update(facts);
    print_json(common, json);
  } else {
    say("{}\n", page);
  }
  return kDone;
}

ExitStatus report_one(const std::string& folder, std::string page, const CommonOptions& common) {
  if (page.empty()) page = (fs::path(folder) / "report.html").string();
  require_apart(common, {page});
  const report::Report report = report_of(folder);
  return write_page(page, report::report_page(report), {{"verb", report::verb_of(report)}}, common);
}

/// Of two results, side by side.
ExitStatus report_two(const std::string& a, const std::string& b, const std::string& page,
                      const CommonOptions& common) {
  if (page.empty()) throw InvalidArgument("--output is missing: the page of the two results");
  require_apart(common, {page});
  const report::Report report_a = report_of(a), report_b = report_of(b);
  const jobs::ResultComparison c = jobs::compare_results(a, b);
  const std::string html =
      report::comparison_page({a, report_a}, {b, report_b}, c, provenance_of(common));
  Json facts{{"verbs", {report::verb_of(report_a), report::verb_of(report_b)}}};
  facts.update(json::of(c));
  return write_page(page, html, facts, common);
}

}  // namespace

Run declare_report(CLI::App& verb) {
  const auto options = std::make_shared<ReportCommandOptions>();
  verb.add_option("DIR", options->folders,
                  "Folder written by estimate -o or calibrate -o, or two of them to compare")
      ->required()
      ->expected(1, 2);
  verb.add_option("-o,--output", options->page,
                  "Page (HTML) to write (default: DIR/report.html; required for two folders)");
  return [options](const CommonOptions& common) {
    const std::vector<std::string>& folders = options->folders;
    return folders.size() == 1 ? report_one(folders.front(), options->page, common)
                               : report_two(folders.front(), folders.back(), options->page, common);
  };
}

}  // namespace risley::app
