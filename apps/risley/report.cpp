// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <filesystem>
#include <memory>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "risley/core/error.hpp"
#include "risley/io/text_file.hpp"
#include "risley/report/report_file.hpp"

#include "command.hpp"
#include "result_folder.hpp"

namespace risley::app {
namespace {

struct ReportCommandOptions {
  std::string folder, page;
};

ExitStatus run_report(const ReportCommandOptions& options, const CommonOptions& common) {
  namespace fs = std::filesystem;
  const fs::path folder(options.folder), data = folder / "report.json";
  if (!fs::is_directory(folder)) {
    throw FileError(options.folder, {}, "expected a folder that estimate or calibrate wrote");
  }
  if (!fs::exists(data)) {
    throw FileError(data.string(), {},
                    "is missing: estimate -o and calibrate -o write it beside calibration.yaml");
  }
  const std::string page = options.page.empty() ? (folder / "report.html").string() : options.page;
  require_apart(common, {page});
  if (fs::exists(folder / jobs::kIncomplete)) {
    spdlog::warn(
        "{}: the files beside it may be of different runs, because the last one was "
        "stopped: run it again",
        (folder / jobs::kIncomplete).string());
  }
  const report::Report report = report::read_report(data.string());
  const std::string html = page_of(report);
  io::write_text_file(page, html);
  if (common.json) {
    print_json(common, {{"html", page}, {"bytes", html.size()}, {"verb", report::verb_of(report)}});
  } else {
    say("{}\n", page);
  }
  return kDone;
}

}  // namespace

Run declare_report(CLI::App& verb) {
  const auto options = std::make_shared<ReportCommandOptions>();
  verb.add_option("DIR", options->folder, "Folder that estimate -o or calibrate -o wrote")
      ->required();
  verb.add_option("-o,--output", options->page, "The page (default: DIR/report.html)");
  return [options](const CommonOptions& common) { return run_report(*options, common); };
}

}  // namespace risley::app
