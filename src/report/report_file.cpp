// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/report_file.hpp"

#include <fmt/format.h>

#include "risley/core/error.hpp"
#include "risley/io/json_text.hpp"
#include "risley/io/text_file.hpp"
#include "risley/json/schema.hpp"

#include "report/pages.hpp"
#include "report/view.hpp"

namespace risley::report {
namespace {

using json::Json;

constexpr const char* kFormat = "risley report";
constexpr int kFormatVersion = 2;

/// A condition on diagrams not in the schema: their columns have one length.
void check_columns(const View& chart) {
  for (const View& series : chart["series"].list()) {
    const std::size_t points = series["x"].size();
    const bool cells = series["kind"].text() == "cells", space = chart["kind"].text() == "space";
    for (const auto& [name, needed] :
         {std::pair("y", true), std::pair("z", space), std::pair("value", cells)}) {
      const View column = series[name];
      if (column.size() != points && (needed || column.size() > 0)) {
        throw FileError(
            column.file(), {},
            fmt::format("{}: {} values, expected {}", column.place(), column.size(), points));
      }
    }
  }
}

/// Another one: a matrix has a row and a column for each of its names.
void check_matrix(const View& correlation) {
  const std::size_t size = correlation["names"].size();
  const View matrix = correlation["matrix"];
  const auto check = [size](const View& part, const char* what) {
    if (part.size() == size) return;
    throw FileError(part.file(), {},
                    fmt::format("{}: {} {}, expected {}", part.place(), part.size(), what, size));
  };
  check(matrix, "rows");
  for (const View& row : matrix.list()) check(row, "values");
}

void check_version(const Json& report, const std::string& path) {
  if (report.is_object() && report.value("format", Json()) == kFormat &&
      report.value("format_version", Json()) != kFormatVersion) {
    throw FileError(path, {},
                    fmt::format("format_version: expected {}, found {}; run the command that made "
                                "the result again",
                                kFormatVersion,
                                report.value("format_version", Json())
                                    .dump(-1, ' ', false, Json::error_handler_t::replace)));
  }
}

}  // namespace

Report finished_report(const char* verb, const Json& result, const Json& page, const Json& charts,
                       const jobs::Provenance& provenance) {
  Json report = {{"format", kFormat}, {"format_version", kFormatVersion}, {"verb", verb}};
  report.update(result);
  report.erase("seconds");  // of the unfinished run
  report["page"] = page;
  report["charts"] = charts;
  report["provenance"] = provenance;
  return {report};
}

std::string report_text(const Report& report) {
  return report.json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Report read_report(const std::string& path) { return parse_report(io::read_text_file(path), path); }

Report parse_report(const std::string& text, const std::string& path) {
  io::require_shallow_json(path, text);
  Report report{{}, path};
  try {
    report.json = Json::parse(text);
  } catch (const Json::parse_error& error) {
    throw FileError(path, {error.byte, {}}, "from here on, the text is not JSON");
  } catch (const Json::exception& error) {  // a number beyond the range of doubles
    throw FileError(path, {}, fmt::format("the JSON cannot be read: {}", error.what()));
  }
  check_version(report.json, path);
  json::require_schema(report.json, "report_file.json", path);
  for (const auto& [name, charts] : View(report)["charts"].entries()) {
    for (const View& chart : charts.list()) check_columns(chart);
  }
  check_matrix(View(report)["page"]["correlation"]);
  return report;
}

std::string report_page(const Report& report) {
  const View view(report);
  if (verb_of(report) == "estimate") return estimate_page(view);
  return view["page"].has("mount") ? flight_page(view) : calibration_page(view);
}

std::string verb_of(const Report& report) { return View(report)["verb"].text(); }

}  // namespace risley::report
