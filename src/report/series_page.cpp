// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/series_page.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::report {
namespace {

using jobs::ComparedPair;
using jobs::ComparedSeries;
using jobs::ParameterDifference;

std::size_t changes_of(const ComparedSeries& series) {
  return static_cast<std::size_t>(std::count_if(series.pairs.begin(), series.pairs.end(),
                                                [](const auto& pair) { return pair.changed; }));
}

/// The pair of the first result and the last.
const ComparedPair& ends_of(const ComparedSeries& series) {
  return *std::find_if(series.pairs.begin(), series.pairs.end(), [&](const ComparedPair& pair) {
    return pair.a == 0 && pair.b + 1 == series.results.size();
  });
}

std::string pairs_html(const ComparedSeries& series) {
  std::string html =
      "<table><thead><tr><th>from</th><th>to</th><th>one unit</th><th>directions apart</th>"
      "<th>of that, shape</th><th>p</th><th>answer</th></tr></thead><tbody>\n";
  for (const ComparedPair& pair : series.pairs) {
    const jobs::ResultComparison& c = pair.comparison;
    const bool tested = c.change.degrees_of_freedom > 0;
    html += fmt::format(
        "<tr{}><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td></tr>\n",
        pair.changed ? " class=\"bad\"" : "", escape_html(series.results[pair.a]),
        escape_html(series.results[pair.b]), c.same_unit ? "yes" : "not known",
        angle_with_sigma(c.beams.errors.total, c.beams.total_sigma),
        angle_with_sigma(c.beams.errors.shape, c.beams.shape_sigma),
        tested ? fmt::format("{:.2g}", c.change.p_value) : "&ndash;",
        !tested        ? "no sigmas to test with"
        : pair.changed ? "changed"
                       : "no change seen");
  }
  return html +
         fmt::format(
             "</tbody></table>\n<p class=\"note\">p is the probability that the differences of all "
             "parameters together are as large as these, or larger, by chance. A pair counts as "
             "changed where p is below {:.2g}, so that a series in which nothing changed is called "
             "changed with a probability of {:g} at most.</p>\n",
             series.least_p_value, series.false_alarm);
}

/// One parameter over the series, in the unit of files.
Chart chart_of(const ComparedSeries& series, std::size_t parameter) {
  const ParameterDifference& like = series.pairs.front().comparison.parameters[parameter];
  const TrainShape shape = series.pairs.front().comparison.b.shape();
  const bool in_metres = like.name == jobs::kRangeOffset;
  const double unit = in_metres ? 1 : find_parameter(like.name, shape).si_per_unit;
  Series values{"value", "a", SeriesKind::points, {}, {}};
  Series low{"1 sigma", "ink", SeriesKind::line, {}, {}}, high = low;
  const auto add = [&](std::size_t place, double value, double sigma) {
    values.x.push_back(static_cast<double>(place + 1));
    values.y.push_back(value / unit);
    low.x.push_back(values.x.back());
    low.y.push_back((value - sigma) / unit);
    high.x.push_back(values.x.back());
    high.y.push_back((value + sigma) / unit);
  };
  for (const ComparedPair& pair : series.pairs) {
    const ParameterDifference& one = pair.comparison.parameters[parameter];
    if (pair.b == 1) add(0, one.value_a, one.sigma_a);
    if (pair.a + 1 == pair.b) add(pair.b, one.value_b, one.sigma_b);
  }
  Chart chart{like.name,
              "result, in the order given",
              in_metres ? "m" : find_parameter(like.name, shape).unit,
              {},
              {}};
  chart.series = {std::move(values), std::move(low), std::move(high)};
  return chart;
}

std::string parameters_html(const ComparedSeries& series, Figures& figures) {
  std::vector<Chart> charts;
  const auto& parameters = series.pairs.front().comparison.parameters;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const bool known = std::all_of(series.pairs.begin(), series.pairs.end(), [&](const auto& pair) {
      return pair.comparison.parameters.size() == parameters.size() &&
             pair.comparison.parameters[i].name == parameters[i].name &&
             pair.comparison.parameters[i].sigma > 0;
    });
    if (known) charts.push_back(chart_of(series, i));
  }
  return charts.empty() ? std::string() : charts_html(charts, figures);
}

std::string names_html(const ComparedSeries& series) {
  std::string html = "<ol>\n";
  for (const std::string& name : series.results) {
    html += fmt::format("<li>{}</li>\n", escape_html(name));
  }
  return html + "</ol>\n";
}

}  // namespace

std::string series_page(const ComparedSeries& series, const Provenance& provenance) {
  Figures figures;
  const std::size_t changes = changes_of(series);
  const ComparedPair& ends = ends_of(series);
  const std::string head =
      fmt::format("<p class=\"verdict\"><b>{}</b></p>\n",
                  changes == 0 ? "No change is seen."
                               : fmt::format("{} of {} pairs differ by more than chance explains.",
                                             changes, series.pairs.size())) +
      overview_html(
          {{angle_with_sigma(ends.comparison.beams.errors.total, ends.comparison.beams.total_sigma),
            "between the directions of the first result and the last"},
           {angle_with_sigma(ends.comparison.beams.errors.shape, ends.comparison.beams.shape_sigma),
            "of that is the beams against each other: their shape"},
           {fmt::format("{:.2g}", ends.comparison.change.p_value),
            "is the probability of such differences by chance"}},
          {}, figures);
  Sections sections;
  sections.add("Pairs", pairs_html(series), Sections::Shown::unfolded);
  sections.add("Parameters over the series", parameters_html(series, figures),
               Sections::Shown::unfolded);
  sections.add("Results", names_html(series));
  sections.add(kHowToRepeat, provenance_html(provenance));
  const std::string serial = ends.comparison.b.serial;
  return page_html(fmt::format("{} results", series.results.size()),
                   fmt::format("Of {}{}.", ends.comparison.b.name,
                               serial.empty() ? std::string() : " " + serial),
                   head, sections, figures);
}

}  // namespace risley::report
