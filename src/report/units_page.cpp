// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/units_page.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/number_text.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"
#include "risley/sensors/prism_sizes.hpp"

namespace risley::report {
namespace {

using jobs::ComparedFleet;
using jobs::ComparedPair;
using jobs::ComparedUnit;
using jobs::ComparedUnits;
using jobs::ParameterDifference;

/// More do not help a reader.
constexpr std::size_t kMostPairsShown = 500;

bool is_tested(const ComparedPair& pair) { return pair.comparison.change.degrees_of_freedom > 0; }

std::string probability_text(bool tested, double p_value) {
  return tested ? fmt::format("{:.2g}", p_value) : "–";
}

/// Places of the displayed pairs, in order: all, or those least explained by chance.
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
    html += fmt::format("Of {} pairs, these {} are the ones least explained by chance. ",
                        compared.pairs.size(), shown.size());
  }
  return html +
         fmt::format(
             "p is the probability that the differences of all parameters together are as large as "
             "these, or larger, by chance. A pair counts as changed where p is below {:.2g}, so "
             "that unchanged results are called changed with a probability of at most {:g}.</p>\n",
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
        found.tested ? fmt::format("{:.1f}", found.worst_z) : "–",
        probability_text(found.tested, found.p_value),
        angle_with_sigma(found.beams.errors.total, found.beams.total_sigma),
        angle_with_sigma(found.beams.errors.shape, found.beams.shape_sigma),
        escape_html(compared.results[unit.results.back()]));
  }
  html +=
      "</tbody></table></div>\n<p class=\"note\">Each unit by its last result, against the median "
      "of all.";
  if (one.fleet.parameters.empty()) return html + "</p>\n";
  return html +
         fmt::format(
             " Robust z is the distance of a parameter from its median over the "
             "spread of the fleet and the standard uncertainty of the result together. p is an "
             "upper limit of the probability that chance alone puts any of the {} units so far off "
             "in any of their parameters ({}) or of the combinations of these ({}).</p>\n",
             one.units.size(), one.fleet.parameters.size(), one.fleet.combinations.cols());
}

/// Least duration of a series, in days, for drawing it over dates.
constexpr std::int64_t kDay_ms = 24 * 3600 * 1000;

bool has_dates(const ComparedUnits& compared) {
  if (compared.written_ms.empty()) return false;
  const auto [first, last] = std::ranges::minmax(compared.written_ms);
  return last - first >= kDay_ms && std::ranges::is_sorted(compared.written_ms);
}

/// Glass does not change, but its mounting may.
bool can_change(const std::string& name, TrainShape shape) {
  return !name.starts_with("refractive_index") && !name.starts_with("wedge_angle") &&
         !sensors::find_prism_size(name, shape.prisms);
}

/// One parameter over the results of a series, in the unit of files.
struct ParameterOverResults {
  Chart chart;
  bool can_change = false;
  double largest = 0;  ///< difference of two results of a unit, sigmas
  std::string words;   ///< of that difference
};

/// Parameters over the results of a series: first those that can change, ordered by the size of the
/// change.
std::vector<ParameterOverResults> parameters_over_results(const ComparedUnits& compared) {
  std::vector<ParameterOverResults> found;
  const auto& parameters = compared.pairs.front().comparison.parameters;
  const TrainShape shape = compared.pairs.front().comparison.b.shape();
  const bool dates = has_dates(compared);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const auto is_known = [&](const ComparedPair& pair) {
      const auto& own = pair.comparison.parameters;
      return own.size() == parameters.size() && own[i].name == parameters[i].name &&
             own[i].sigma > 0;
    };
    if (!std::all_of(compared.pairs.begin(), compared.pairs.end(), is_known)) continue;
    const std::string& name = parameters[i].name;
    const jobs::FileUnit unit = jobs::file_unit_of(name, shape);
    ParameterOverResults one;
    one.can_change = can_change(name, shape);
    Series values{"", "a", SeriesKind::points, {}, {}};
    std::map<std::size_t, std::pair<double, double>> by_place;  // value and sigma
    for (const ComparedPair& pair : compared.pairs) {
      const ParameterDifference& own = pair.comparison.parameters[i];
      by_place.emplace(pair.a, std::pair(own.value_a, own.sigma_a));
      by_place.emplace(pair.b, std::pair(own.value_b, own.sigma_b));
      const double sigmas = std::abs(own.difference) / own.sigma;
      if (sigmas <= one.largest || jobs::are_two_units(pair.comparison)) continue;
      one.largest = sigmas;
      const NumberText text =
          number_text(own.difference / unit.si_per_unit, own.sigma / unit.si_per_unit);
      one.words = fmt::format("{} by {} ± {} {}", name, text.value, text.sigma, unit.unit);
    }
    for (const auto& [place, known] : by_place) {
      values.x.push_back(static_cast<double>(dates ? compared.written_ms[place]
                                                   : static_cast<std::int64_t>(place) + 1));
      values.y.push_back(known.first / unit.si_per_unit);
      values.sigma.push_back(known.second / unit.si_per_unit);
    }
    one.chart.title = name;
    one.chart.x_label = dates ? "when the result was written" : "result, in the order given";
    one.chart.dates = dates;
    one.chart.y_label = fmt::format("{}, ± 1 sigma", unit.unit);
    one.chart.series.push_back(std::move(values));
    found.push_back(std::move(one));
  }
  std::ranges::stable_sort(found, [](const auto& a, const auto& b) {
    return a.can_change != b.can_change ? a.can_change : a.largest > b.largest;
  });
  return found;
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
  if (fleet.parameters.empty()) return {};
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
         "</tbody></table>\n<p class=\"note\">Median and standard deviation of the units, the "
         "latter from the median of their distances; it includes the standard uncertainties of the "
         "results.</p>\n";
}

std::string left_out_html(const ComparedUnits& compared) {
  if (compared.left_out.empty()) return {};
  std::vector<std::string> items;
  for (const jobs::LeftOut& one : compared.left_out) {
    items.push_back(fmt::format("{}: {}", one.name, one.reason));
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

/// One sentence on changes. @param parameters  of a series; empty otherwise
std::string change_words(const ComparedUnits& compared,
                         const std::vector<ParameterOverResults>& parameters) {
  std::vector<const ComparedPair*> pairs;
  for (const ComparedPair& pair : compared.pairs) {
    if (!jobs::are_two_units(pair.comparison)) pairs.push_back(&pair);
  }
  if (pairs.empty()) return "No unit has two results.";
  const auto changes = std::ranges::count_if(pairs, &ComparedPair::changed);
  if (changes > 0) {
    const ComparedPair& first = **std::ranges::find_if(pairs, &ComparedPair::changed);
    const std::string &a = compared.results[first.a], &b = compared.results[first.b];
    std::string words = fmt::format("{} and {} differ by more than chance explains", a, b);
    if (pairs.size() > 1) {
      words = fmt::format("{} of {} pairs{} {} by more than chance explains, {}{} to {}", changes,
                          pairs.size(), pairs.size() < compared.pairs.size() ? " of one unit" : "",
                          changes == 1 ? "differs" : "differ", changes == 1 ? "" : "first ", a, b);
    }
    const auto most = std::ranges::max_element(parameters, {}, &ParameterOverResults::largest);
    if (most != parameters.end()) words += fmt::format("; most of all {}", most->words);
    return words + ".";
  }
  return std::ranges::any_of(pairs, [](const ComparedPair* pair) { return is_tested(*pair); })
             ? "No change is seen."
             : "No conclusion is possible: the results have no covariance.";
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
  if (std::ranges::none_of(one.fleet.units, &jobs::FleetUnit::tested)) {
    return fmt::format(
        " Whether one of the {} units ({}) stands out is unknown: the results have no covariance.",
        one.units.size(), sensor);
  }
  if (count == 0) {
    return fmt::format(" None of the {} units ({}) stands out from the others.", one.units.size(),
                       sensor);
  }
  return fmt::format(" {} of {} units ({}) {} not like the others: {}.", count, one.units.size(),
                     sensor, count == 1 ? "is" : "are", outliers);
}

/// Of the first result of a series and its last; none if these were not compared.
std::vector<KeyNumber> numbers_of_series(const ComparedUnits& compared) {
  const auto ends = std::ranges::find_if(compared.pairs, [&](const ComparedPair& pair) {
    return pair.a == 0 && pair.b + 1 == compared.results.size();
  });
  if (ends == compared.pairs.end()) return {};
  const jobs::ResultComparison& c = ends->comparison;
  std::vector<KeyNumber> numbers{{angle_with_sigma(c.beams.errors.total, c.beams.total_sigma),
                                  "between the directions of the first result and the last"},
                                 {angle_with_sigma(c.beams.errors.shape, c.beams.shape_sigma),
                                  "of that is between the beams: their shape"}};
  if (is_tested(*ends)) {
    numbers.push_back({probability_text(true, c.change.p_value),
                       "is the probability of such differences by chance"});
  }
  return numbers;
}

std::string subject_of(const ComparedUnits& compared) {
  if (compared.units.size() > 1) return fmt::format("Of {} units.", compared.units.size());
  const ComparedUnit& unit = compared.units.front();
  return fmt::format("Of {}{}.", unit.sensor, unit.serial.empty() ? "" : " " + unit.serial);
}

}  // namespace

std::string units_page(const ComparedUnits& compared, const jobs::Provenance& provenance) {
  Figures figures;
  std::vector<ParameterOverResults> parameters;
  if (compared.is_one_series) parameters = parameters_over_results(compared);
  std::string words = change_words(compared, parameters);
  for (const ComparedFleet& fleet : compared.fleets) words += fleet_words(fleet, compared);
  std::vector<Chart> charts;
  charts.reserve(parameters.size());
  for (ParameterOverResults& one : parameters) charts.push_back(std::move(one.chart));
  std::vector<Chart> fleets;
  for (const ComparedFleet& fleet : compared.fleets) {
    if (!fleet.fleet.parameters.empty()) fleets.push_back(chart_of_fleet(fleet));
  }
  const std::string head =
      fmt::format("<p class=\"verdict\"><b>{}</b></p>\n", escape_html(words)) +
      (compared.is_one_series ? overview_html(numbers_of_series(compared), charts, figures)
                              : charts_html(fleets, figures));
  Sections sections;
  for (const ComparedFleet& fleet : compared.fleets) {
    const std::string& sensor = compared.units[fleet.units.front()].sensor;
    sections.add(fmt::format("Units against each other: {}", sensor), fleet_html(fleet, compared),
                 Sections::Shown::unfolded);
    sections.add(fmt::format("Parameters of the fleet: {}", sensor),
                 fleet_parameters_html(fleet.fleet));
  }
  if (charts.size() > 1) {
    sections.add("Parameters over the results", charts_html(charts, figures, 1),
                 Sections::Shown::unfolded);
  }
  sections.add("Pairs", pairs_html(compared), Sections::Shown::unfolded);
  sections.add("Left out", left_out_html(compared));
  sections.add("Results", results_html(compared));
  sections.add(kHowToRepeat, provenance_html(provenance));
  return page_html(fmt::format("{} results", compared.results.size()), subject_of(compared), head,
                   sections, figures);
}

}  // namespace risley::report
