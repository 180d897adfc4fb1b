// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/io/text_file.hpp"
#include "risley/jobs/compare_series.hpp"
#include "risley/report/series_page.hpp"

#include "command.hpp"
#include "result_folder.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

struct CompareOptions {
  jobs::CompareSeriesOptions job;
  std::string page;
};

std::string answer_of(const jobs::ComparedPair& pair) {
  if (pair.comparison.change.degrees_of_freedom == 0) return "no sigmas";
  return pair.changed ? "changed" : "no change seen";
}

void print_series(const jobs::ComparedSeries& series) {
  Table table({"from", "to", "one unit", "directions apart deg", "+- sigma", "shape deg",
               "+- sigma", "p", "answer"});
  for (const jobs::ComparedPair& pair : series.pairs) {
    const jobs::ResultComparison& c = pair.comparison;
    const auto text = [](double value, double sigma) {
      return number_text(degrees_from_radians(value), degrees_from_radians(sigma));
    };
    const NumberText total = text(c.beams.errors.total, c.beams.total_sigma);
    const NumberText shape = text(c.beams.errors.shape, c.beams.shape_sigma);
    table.add({series.results[pair.a], series.results[pair.b], c.same_unit ? "yes" : "not known",
               total.value, total.sigma, shape.value, shape.sigma,
               c.change.degrees_of_freedom > 0 ? fmt::format("{:.2g}", c.change.p_value) : "-",
               answer_of(pair)});
  }
  table.print();
  say("\np: probability that differences of the parameters are as large as these, or larger, by "
      "chance; changed: p below {:.2g}, so that a series without any change is called changed "
      "with a probability of {:g} at most\n",
      series.least_p_value, series.false_alarm);
}

ExitStatus run_compare(const CompareOptions& options, const CommonOptions& common) {
  require_apart(common, {options.page});
  jobs::ComparedSeries series;
  {
    ProgressBar bar("comparing", common);
    series = jobs::compare_series(options.job, bar.progress());
  }
  if (!options.page.empty()) {
    io::write_text_file(options.page, report::series_page(series, provenance_of(common)));
  }
  if (common.json) {
    Json json = json::of(series);
    if (!options.page.empty()) json["html"] = options.page;
    print_json(common, json);
  } else {
    print_series(series);
    if (!options.page.empty()) say("page: {}\n", options.page);
  }
  return kDone;
}

}  // namespace

Run declare_compare(CLI::App& verb) {
  const auto options = std::make_shared<CompareOptions>();
  CompareOptions& o = *options;
  verb.add_option(
          "RESULT", o.job.results,
          "Folders that estimate -o or calibrate -o wrote, or calibration files, in order of "
          "time; at least two")
      ->required()
      ->expected(2, 1'000'000);
  verb.add_option("-o,--output", o.page, "Page (HTML) to write (default: none)");
  verb.add_option("--false-alarm", o.job.false_alarm,
                  "Probability that a series without any change is called changed")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  return [options](const CommonOptions& common) { return run_compare(*options, common); };
}

}  // namespace risley::app
