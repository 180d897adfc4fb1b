// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/units_page.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::report {
namespace {

using jobs::ComparedFleet;
using jobs::ComparedPair;
using jobs::ComparedUnit;
using jobs::ComparedUnits;
using jobs::ParameterDifference;

/// More do not help a reader.
constexpr std::size_t kMostPairsShown = 500;

std::size_t changes_of(const ComparedUnits& compared) {
  return static_cast<std::size_t>(std::count_if(compared.pairs.begin(), compared.pairs.end(),
                                                [](const auto& pair) { return pair.changed; }));
}

bool is_tested(const ComparedPair& pair) { return pair.comparison.change.degrees_of_freedom > 0; }

std::string probability_text(bool tested, double p_value) {
  return tested ? fmt::format("{:.2g}", p_value) : "&ndash;";
}

/// Places of the pairs that are shown, in their order: all, or those that chance explains least.
std::vector<std::size_t> shown_pairs(const ComparedUnits& compared) {
  std::vector<std::size_t> places(compared.pairs.size());
  std::iota(places.begin(), places.end(), std::size_t{0});
  if (places.size() <= kMostPairsShown) return places;
  const auto p_value = [&](std::size_t place) {
    return compared.pairs[place].comparison.change.p_value;
  };
  std::stable_sort(places.begin(), places.end(),
                   [&](std::size_t a, std::size_t b) { return p_value(a) < p_value(b); });
  places.resize(kMostPairsShown);
  std::sort(places.begin(), places.end());
  return places;
}

std::string pairs_html(const ComparedUnits& compared) {
  if (compared.pairs.empty()) return {};
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>from</th><th>to</th><th>one unit</th>"
      "<th>directions apart</th><th>of that, shape</th><th>p</th><th>answer</th></tr></thead>"
      "<tbody>\n";
  const std::vector<std::size_t> shown = shown_pairs(compared);
  for (const std::size_t place : shown) {
    const ComparedPair& pair = compared.pairs[place];
    const jobs::ResultComparison& c = pair.comparison;
    html += fmt::format(
        "<tr{}><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td></tr>\n",
        pair.changed ? " class=\"bad\"" : "", escape_html(compared.results[pair.a]),
        escape_html(compared.results[pair.b]), jobs::one_unit_words(c),
        angle_with_sigma(c.beams.errors.total, c.beams.total_sigma),
        angle_with_sigma(c.beams.errors.shape, c.beams.shape_sigma),
        probability_text(is_tested(pair), c.change.p_value), jobs::answer_words(pair));
  }
  html += "</tbody></table></div>\n<p class=\"note\">";
  if (shown.size() < compared.pairs.size()) {
    html += fmt::format("Of {} pairs, these {} are the ones that chance explains least. ",
                        compared.pairs.size(), shown.size());
  }
  return html +
         fmt::format(
             "p is the probability that the differences of all parameters together are as large as "
             "these, or larger, by chance. A pair counts as changed where p is below {:.2g}, so "
             "that results in which nothing changed are called changed with a probability of {:g} "
             "at most.</p>\n",
             compared.least_p_value, compared.false_alarm);
}

std::string fleet_html(const ComparedFleet& one, const ComparedUnits& compared) {
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>unit</th><th>answer</th>"
      "<th>furthest off in</th><th>robust z</th><th>p</th>"
      "<th>directions apart from the middle</th><th>of that, shape</th>"
      "<th>result</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < one.units.size(); ++i) {
    const ComparedUnit& unit = compared.units[one.units[i]];
    const jobs::FleetUnit& found = one.fleet.units[i];
    html += fmt::format(
        "<tr{}><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td>{}</td></tr>\n",
        found.outlier ? " class=\"bad\"" : "", escape_html(unit.serial), jobs::answer_words(found),
        jobs::worst_words(found, one.fleet),
        found.tested ? fmt::format("{:.1f}", found.worst_z) : "&ndash;",
        probability_text(found.tested, found.p_value),
        angle_with_sigma(found.beams.errors.total, found.beams.total_sigma),
        angle_with_sigma(found.beams.errors.shape, found.beams.shape_sigma),
        escape_html(compared.results[unit.results.back()]));
  }
  return html +
         fmt::format(
             "</tbody></table></div>\n<p class=\"note\">Each unit by its last result, against "
             "the median of all. Robust z is the distance of a parameter from its median over the "
             "spread of the fleet and the standard uncertainty of the result together. p is the "
             "probability that chance puts any of the {} units so far off in any of {} "
             "parameters, or in any of {} combinations of them, at most.</p>\n",
             one.units.size(), one.fleet.parameters.size(), one.fleet.combinations.cols());
}

/// One parameter over results, in the unit of files.
class ParameterChart {
 public:
  ParameterChart(std::string name, std::string x_label, TrainShape shape)
      : unit_(jobs::file_unit_of(name, shape).si_per_unit) {
    chart_.y_label = jobs::file_unit_of(name, shape).unit;
    chart_.title = std::move(name);
    chart_.x_label = std::move(x_label);
  }
  void add(std::size_t place, double value, double sigma) {
    values_.x.push_back(static_cast<double>(place));
    values_.y.push_back(value / unit_);
    low_.x.push_back(values_.x.back());
    low_.y.push_back((value - sigma) / unit_);
    high_.x.push_back(values_.x.back());
    high_.y.push_back((value + sigma) / unit_);
  }
  Chart chart() && {
    chart_.series = {std::move(values_), std::move(low_), std::move(high_)};
    return std::move(chart_);
  }

 private:
  Chart chart_;
  double unit_;
  Series values_{"value", "a", SeriesKind::points, {}, {}};
  Series low_{"1 sigma", "ink", SeriesKind::line, {}, {}}, high_ = low_;
};

/// Parameters over the results of a series.
std::vector<Chart> charts_of_series(const ComparedUnits& compared) {
  std::vector<Chart> charts;
  const auto& parameters = compared.pairs.front().comparison.parameters;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto is_known = [&](const ComparedPair& pair) {
      const auto& own = pair.comparison.parameters;
      return own.size() == parameters.size() && own[i].name == parameters[i].name &&
             own[i].sigma > 0;
    };
    if (!std::all_of(compared.pairs.begin(), compared.pairs.end(), is_known)) continue;
    ParameterChart chart(parameters[i].name, "result, in the order given",
                         compared.pairs.front().comparison.b.shape());
    for (const ComparedPair& pair : compared.pairs) {
      const ParameterDifference& one = pair.comparison.parameters[i];
      if (pair.b == 1) chart.add(1, one.value_a, one.sigma_a);
      if (pair.a + 1 == pair.b) chart.add(pair.b + 1, one.value_b, one.sigma_b);
    }
    charts.push_back(std::move(chart).chart());
  }
  return charts;
}

/// Robust z of every unit in every parameter.
Chart chart_of_fleet(const ComparedFleet& one) {
  Chart chart{"Units against each other",
              "unit, in the order of the table",
              "robust z",
              {},
              "One mark for each parameter and each combination of them."};
  Series usual{"like the others", "a", SeriesKind::points, {}, {}};
  Series outliers{"outlier", "bad", SeriesKind::points, {}, {}};
  for (std::size_t i = 0; i < one.fleet.units.size(); ++i) {
    const jobs::FleetUnit& unit = one.fleet.units[i];
    Series& series = unit.outlier ? outliers : usual;
    for (const std::vector<double>* of_unit : {&unit.robust_z, &unit.robust_z_combined}) {
      for (const double z : *of_unit) {
        if (!std::isfinite(z)) continue;
        series.x.push_back(static_cast<double>(i + 1));
        series.y.push_back(z);
      }
    }
  }
  chart.series.push_back(std::move(usual));
  if (!outliers.x.empty()) chart.series.push_back(std::move(outliers));
  return chart;
}

std::string fleet_parameters_html(const jobs::Fleet& fleet) {
  std::string html =
      "<table><thead><tr><th>parameter</th><th>middle</th><th>spread among units</th><th>unit</th>"
      "</tr></thead><tbody>\n";
  for (const jobs::FleetParameter& one : fleet.parameters) {
    const jobs::FileUnit unit = jobs::file_unit_of(one.name, fleet.shape);
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{:.5f}</td><td>{:.5f}</td><td>{}</td></tr>\n", one.name,
        one.middle / unit.si_per_unit, one.spread / unit.si_per_unit, unit.unit);
  }
  return html +
         "</tbody></table>\n<p class=\"note\">Median of the units and standard deviation among "
         "them, "
         "from the median of their distances; it includes the standard uncertainties of the "
         "results.</p>\n";
}

std::string left_out_html(const ComparedUnits& compared) {
  if (compared.left_out.empty()) return {};
  std::vector<std::string> items;
  for (const jobs::LeftOut& one : compared.left_out) {
    items.push_back(escape_html(fmt::format("{}: {}", one.name, one.reason)));
  }
  return list_html(items);
}

std::string results_html(const ComparedUnits& compared) {
  std::string html = "<ol>\n";
  for (const std::string& name : compared.results) {
    html += fmt::format("<li>{}</li>\n", escape_html(name));
  }
  return html + "</ol>\n";
}

std::string change_words(const ComparedUnits& compared) {
  if (compared.pairs.empty()) return "No unit has two results.";
  const std::size_t changes = changes_of(compared);
  if (changes > 0) {
    return fmt::format("{} of {} pairs differ by more than chance explains.", changes,
                       compared.pairs.size());
  }
  return std::any_of(compared.pairs.begin(), compared.pairs.end(), is_tested)
             ? "No change is seen."
             : "Nothing can be said: the results have no covariance.";
}

std::string fleet_words(const ComparedFleet& one, const ComparedUnits& compared) {
  std::string outliers;
  std::size_t count = 0;
  for (std::size_t i = 0; i < one.units.size(); ++i) {
    if (!one.fleet.units[i].outlier) continue;
    outliers += (outliers.empty() ? "" : ", ") + compared.units[one.units[i]].serial;
    ++count;
  }
  const std::string& sensor = compared.units[one.units.front()].sensor;
  if (count == 0) {
    return fmt::format(" None of the {} units ({}) stands out from the others.", one.units.size(),
                       sensor);
  }
  return fmt::format(" {} of {} units ({}) {} not like the others: {}.", count, one.units.size(),
                     sensor, count == 1 ? "is" : "are", outliers);
}

/// Of the first result of a series and its last.
std::vector<KeyNumber> numbers_of_series(const ComparedUnits& compared) {
  const ComparedPair& ends =
      *std::find_if(compared.pairs.begin(), compared.pairs.end(), [&](const ComparedPair& pair) {
        return pair.a == 0 && pair.b + 1 == compared.results.size();
      });
  const jobs::ResultComparison& c = ends.comparison;
  return {{angle_with_sigma(c.beams.errors.total, c.beams.total_sigma),
           "between the directions of the first result and the last"},
          {angle_with_sigma(c.beams.errors.shape, c.beams.shape_sigma),
           "of that is the beams against each other: their shape"},
          {probability_text(is_tested(ends), c.change.p_value),
           "is the probability of such differences by chance"}};
}

std::string subject_of(const ComparedUnits& compared) {
  if (compared.units.size() > 1) return fmt::format("Of {} units.", compared.units.size());
  const ComparedUnit& unit = compared.units.front();
  return fmt::format("Of {}{}.", unit.sensor, unit.serial.empty() ? "" : " " + unit.serial);
}

}  // namespace

std::string units_page(const ComparedUnits& compared, const jobs::Provenance& provenance) {
  Figures figures;
  std::string words = change_words(compared);
  for (const ComparedFleet& fleet : compared.fleets) words += fleet_words(fleet, compared);
  std::vector<Chart> fleets;
  for (const ComparedFleet& fleet : compared.fleets) fleets.push_back(chart_of_fleet(fleet));
  const std::string head = fmt::format("<p class=\"verdict\"><b>{}</b></p>\n", escape_html(words)) +
                           (compared.is_one_series ? overview_html(numbers_of_series(compared),
                                                                   std::vector<Chart>(), figures)
                                                   : charts_html(fleets, figures));
  Sections sections;
  for (const ComparedFleet& fleet : compared.fleets) {
    const std::string& sensor = compared.units[fleet.units.front()].sensor;
    sections.add(fmt::format("Units against each other: {}", sensor), fleet_html(fleet, compared),
                 Sections::Shown::unfolded);
    sections.add(fmt::format("Parameters of the fleet: {}", sensor),
                 fleet_parameters_html(fleet.fleet));
  }
  sections.add("Pairs", pairs_html(compared), Sections::Shown::unfolded);
  if (compared.is_one_series) {
    const std::vector<Chart> charts = charts_of_series(compared);
    sections.add("Parameters over the results",
                 charts.empty() ? std::string() : charts_html(charts, figures),
                 Sections::Shown::unfolded);
  }
  sections.add("Left out", left_out_html(compared));
  sections.add("Results", results_html(compared));
  sections.add(kHowToRepeat, provenance_html(provenance));
  return page_html(fmt::format("{} results", compared.results.size()), subject_of(compared), head,
                   sections, figures);
}

}  // namespace risley::report
