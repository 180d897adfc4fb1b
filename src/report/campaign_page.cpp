// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/campaign_page.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/number_text.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::report {
namespace {

using jobs::BandedFigure;
using jobs::CampaignResult;
using jobs::ParameterSummary;
using jobs::SettingSummary;

/// Most settings for which a page has tables.
constexpr std::size_t kMostTables = 60;

std::string name_of(const SettingSummary& one) {
  return one.grid.empty() ? "all cells" : jobs::grid_words(one.grid);
}

std::string band_text(const BandedFigure& figure) {
  if (!std::isfinite(figure.low)) return "–";
  return fmt::format("{:.3f} to {:.3f}", figure.low, figure.high);
}

std::string figure_cells(const BandedFigure& figure) {
  const bool off = std::isfinite(figure.low) && !figure.inside();
  return fmt::format("<td{}>{}</td><td>{}</td>", off ? " class=\"far\"" : "",
                     finite_text("{:.3f}", figure.value), band_text(figure));
}

struct Axis {
  std::string label;
  std::vector<double> at;  ///< of each setting
};

/// The values of a grid of one name if they are numbers, otherwise 1, 2, 3.
Axis axis_of(const std::vector<SettingSummary>& settings) {
  Axis axis{"setting, in the order of the table", {}};
  const auto number = [](const SettingSummary& one) -> std::optional<double> {
    if (one.grid.size() != 1) return std::nullopt;
    const std::string& text = one.grid.front().second;
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  };
  const bool numbers = settings.size() > 1 && std::ranges::all_of(settings, [&](const auto& one) {
                         return number(one).has_value();
                       });
  if (numbers) axis.label = settings.front().grid.front().first;
  for (std::size_t i = 0; i < settings.size(); ++i) {
    axis.at.push_back(numbers ? *number(settings[i]) : static_cast<double>(i + 1));
  }
  return axis;
}

/// A figure over the settings with its band for correct covariances.
template <class Figure>
Chart banded_chart(std::string title, std::string label, const std::vector<SettingSummary>& all,
                   const Axis& axis, const Figure& figure_of) {
  Chart chart{std::move(title), axis.label, std::move(label), {}, ""};
  Series values{"found", "a", SeriesKind::points, {}, {}};
  Series band{"95 of 100 where covariances are true", "ink", SeriesKind::points, {}, {}};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const BandedFigure figure = figure_of(all[i]);
    if (!std::isfinite(figure.value)) continue;
    values.x.push_back(axis.at[i]);
    values.y.push_back(figure.value);
    if (!std::isfinite(figure.low)) continue;
    band.x.push_back(axis.at[i]);
    band.y.push_back(0.5 * (figure.low + figure.high));
    band.sigma.push_back(0.5 * (figure.high - figure.low));
  }
  chart.series = {std::move(values), std::move(band)};
  return chart;
}

Chart errors_chart(const std::vector<SettingSummary>& all, const Axis& axis) {
  Chart chart{"Errors of the prisms' parameters",
              axis.label,
              "error over bound",
              {},
              "Root mean square over parameters and cells, relative to the stated sigmas."};
  Series values{"", "a", SeriesKind::points, {}, {}};
  for (std::size_t i = 0; i < all.size(); ++i) {
    values.x.push_back(axis.at[i]);
    values.y.push_back(all[i].error_over_bound);
  }
  chart.series.push_back(std::move(values));
  return chart;
}

std::string settings_html(const std::vector<SettingSummary>& settings) {
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>setting</th><th>cells</th><th>answered</th>"
      "<th>error over bound</th><th>NEES</th><th>95 of 100</th></tr></thead><tbody>\n";
  for (const SettingSummary& one : settings) {
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td>{}</tr>\n",
                        escape_html(name_of(one)), count_text(one.cells), count_text(one.answered),
                        finite_text("{:.3f}", one.error_over_bound), figure_cells(one.nees));
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">Error over bound: root mean square error of "
         "the prisms' parameters relative to the stated sigmas, given the held parameters; 1 if "
         "the sigmas are correct. NEES: the same with all covariances, squared. 95 of 100: the "
         "range of the preceding figure in 95 of 100 campaigns of this size if the covariances "
         "are correct." +
         (settings.size() > kMostTables
              ? fmt::format(" Parameters are shown for the first {} settings; the JSON has all.",
                            kMostTables)
              : "") +
         "</p>\n";
}

std::string parameters_html(const SettingSummary& one) {
  if (one.parameters.empty()) return {};
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>parameter</th><th>mean error</th><th>root mean "
      "square</th><th>bound</th><th>unit</th><th>error over bound</th><th>95 of 100</th><th>in two "
      "sigmas</th><th>95 of 100</th></tr></thead><tbody>\n";
  for (const ParameterSummary& own : one.parameters) {
    const ParameterInfo& info = find_parameter(own.name, one.shape);
    const auto text = [&](double value) { return plain_text(value / info.si_per_unit, 3); };
    html += fmt::format("<tr>{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td>{}{}</tr>\n",
                        parameter_head(info), text(own.bias), text(own.rmse), text(own.bound),
                        info.unit, figure_cells(own.error_over_bound),
                        figure_cells(own.within_two_sigma));
  }
  return html + "</tbody></table></div>\n";
}

bool has_band(const SettingSummary& one) { return std::isfinite(one.nees.low); }

}  // namespace

std::string campaign_words(const CampaignResult& merged) {
  std::size_t tested = 0, above = 0, below = 0;
  std::uint64_t cells = 0, answered = 0;
  for (const SettingSummary& one : merged.settings) {
    cells += one.cells;
    answered += one.answered;
    if (!has_band(one)) continue;
    ++tested;
    above += one.nees.value > one.nees.high ? 1 : 0;
    below += one.nees.value < one.nees.low ? 1 : 0;
  }
  if (tested == 0) return "No setting has a result whose errors could be compared with sigmas.";
  std::string words = fmt::format("{} of {} cells {} an answer; ", count_text(answered),
                                  count_text(cells), answered == 1 ? "has" : "have");
  const std::size_t all = merged.settings.size(), agree = tested - above - below;
  if (all == 1) {
    if (agree == 1) return words + "errors agree with the covariances.";
    return words + fmt::format("errors are {} than the covariances predict.",
                               above == 1 ? "larger" : "smaller");
  }
  if (agree == all) {
    return words + fmt::format("in each of {} settings errors agree with the covariances.", all);
  }
  words += fmt::format("in {} of {} settings errors agree with the covariances", agree, all);
  if (above > 0) words += fmt::format(", in {} they are larger", above);
  if (below > 0) words += fmt::format(", in {} they are smaller", below);
  if (tested < all) words += fmt::format(", in {} they could not be compared", all - tested);
  return words + ".";
}

std::string campaign_page(const CampaignResult& merged, const jobs::Provenance& provenance) {
  Figures figures;
  const std::vector<SettingSummary>& settings = merged.settings;
  const Axis axis = axis_of(settings);
  std::vector<Chart> charts{banded_chart("Squared errors over covariances", "NEES", settings, axis,
                                         [](const SettingSummary& one) { return one.nees; }),
                            errors_chart(settings, axis)};
  const auto worst = std::ranges::max_element(settings, {}, [](const SettingSummary& one) {
    return std::isfinite(one.error_over_bound) ? one.error_over_bound : 0.0;
  });
  std::vector<KeyNumber> numbers{
      {fmt::format("{} of {}", count_text(merged.done), count_text(merged.cells)),
       "cells have a result"}};
  if (worst != settings.end() && std::isfinite(worst->error_over_bound)) {
    numbers.push_back({fmt::format("{:.3f}", worst->error_over_bound),
                       settings.size() > 1 ? "largest error over bound, of " + name_of(*worst)
                                           : std::string("errors relative to the stated sigmas")});
  }
  std::vector<std::string> care;
  for (const Warning& warning : merged.warnings) care.push_back(warning.message);
  if (!merged.missing.empty()) {
    const std::uint64_t missing = merged.cells - merged.done;
    care.push_back(fmt::format("{} of {} cells {} no result.", count_text(missing),
                               count_text(merged.cells), missing == 1 ? "has" : "have"));
  }
  const std::string head =
      fmt::format("<p class=\"verdict\"><b>{}</b></p>\n", escape_html(campaign_words(merged))) +
      care_html(care) + overview_html(numbers, charts, figures);
  Sections sections;
  sections.add("Settings", settings_html(settings), Sections::Shown::unfolded);
  sections.add("Errors over the settings", charts_html(charts, figures, 1),
               Sections::Shown::unfolded);
  for (std::size_t i = 0; i < std::min(kMostTables, settings.size()); ++i) {
    sections.add("Parameters: " + name_of(settings[i]), parameters_html(settings[i]),
                 settings.size() == 1 ? Sections::Shown::unfolded : Sections::Shown::folded);
  }
  sections.add(kHowToRepeat, provenance_html(provenance));
  return page_html("A campaign",
                   fmt::format("{} cells in {} setting{}.", count_text(merged.cells),
                               settings.size(), settings.size() == 1 ? "" : "s"),
                   head, sections, figures);
}

}  // namespace risley::report
