// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/distribution_page.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::report {
namespace {

using cloud::DensitySquare;
using cloud::PointDistributionSummary;
using cloud::StripDistribution;

/// Profiles that their colours distinguish.
constexpr std::size_t kMostProfiles = 6;
constexpr std::size_t kMostStripRows = 200;

std::string title_of_strip(const StripDistribution& strip) {
  return strip.name.empty() ? fmt::format("strip {}", strip.strip) : strip.name;
}

std::string percent(double share) { return finite_text("{:.2f} %", 100 * share); }

Chart map_of(const PointDistributionSummary& d) {
  Series squares{"", "ink", SeriesKind::cells, {}, {}};
  squares.cell_width = squares.cell_height = d.square;
  for (const DensitySquare& square : d.map) {
    squares.x.push_back(square.x);
    squares.y.push_back(square.y);
    squares.value.push_back(square.density);
  }
  Chart chart{"Density from above",
              "x (east), m",
              "y (north), m",
              {std::move(squares)},
              fmt::format("All strips together, squares of {:g} m. The colours end at three times "
                          "the mean.",
                          d.square),
              ChartKind::ground};
  chart.value_label = "points per square metre";
  if (std::isfinite(d.density)) chart.value_range = {0.0, std::max(3 * d.density, 1e-9)};
  return chart;
}

Chart strips_of(const PointDistributionSummary& d) {
  Series squares{"", "ink", SeriesKind::cells, {}, {}};
  squares.cell_width = squares.cell_height = d.square;
  for (const DensitySquare& square : d.map) {
    squares.x.push_back(square.x);
    squares.y.push_back(square.y);
    squares.value.push_back(square.strips);
  }
  Chart chart{"Strips that see the ground",
              "x (east), m",
              "y (north), m",
              {std::move(squares)},
              "Ground that only one strip covers carries no information about the mount.",
              ChartKind::ground};
  chart.value_label = "strips";
  return chart;
}

Chart profile_of(const PointDistributionSummary& d) {
  static constexpr const char* kColours[] = {"a", "b", "c", "d", "ink", "bad"};
  static_assert(std::size(kColours) == kMostProfiles);
  Chart chart{"Density across the strips",
              "left of the middle of the swath, m",
              "points per square metre",
              {},
              "Mean along every strip."};
  for (std::size_t i = 0; i < std::min(kMostProfiles, d.strips.size()); ++i) {
    const StripDistribution& strip = d.strips[i];
    Series line{title_of_strip(strip), kColours[i], SeriesKind::line, strip.profile.across,
                strip.profile.density};
    chart.series.push_back(std::move(line));
  }
  if (d.strips.size() > kMostProfiles) {
    chart.note += fmt::format(" The first {} of {} strips.", kMostProfiles, d.strips.size());
  }
  return chart;
}

std::string summary_html(const PointDistributionSummary& d) {
  const auto row = [](const char* head, const std::string& value) {
    return fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td></tr>\n", head, value);
  };
  return "<table><tbody>\n" + row("points", count_text(d.points)) +
         row("area of all swaths", finite_text("{:.0f} m²", d.area)) +
         row("aggregate nominal density (ANPD)", finite_text("{:.1f} /m²", d.density)) +
         row("aggregate nominal spacing (ANPS)", finite_text("{:.3f} m", d.spacing)) +
         row("density of the median cell", finite_text("{:.0f} /m²", d.median_density)) +
         row("density that 5 % of the cells do not reach",
             finite_text("{:.0f} /m²", d.low_density)) +
         row("cells that hold a point", percent(d.covered)) +
         row("cells that several strips see", percent(d.overlap)) + "</tbody></table>\n";
}

std::vector<KeyNumber> key_numbers(const PointDistributionSummary& d) {
  return {{finite_text("{:.1f} points/m²", d.density), "density of all strips together (ANPD)"},
          {percent(d.covered), "of the cells hold a point"},
          {finite_text("{:.3f} m", d.spacing), "spacing of the points (ANPS)"}};
}

std::string swaths_html(const PointDistributionSummary& d) {
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>strip</th>"
      "<th>points</th><th>height, m</th><th>swath, m</th><th>dense, m</th><th>density, 1/m²</th>"
      "<th>spacing, m</th><th>in the middle</th>";
  for (const double place : cloud::kSwathPlaces) html += fmt::format("<th>at {:g} R</th>", place);
  html +=
      "<th>variation</th><th>squares with a point</th><th>empty circles</th>"
      "<th>largest, m</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < std::min(kMostStripRows, d.strips.size()); ++i) {
    const StripDistribution& s = d.strips[i];
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td>{}</td>",
        escape_html(title_of_strip(s)), count_text(s.points), finite_text("{:.1f}", s.height),
        finite_text("{:.1f}", s.width), finite_text("{:.1f}", s.dense_width),
        finite_text("{:.0f}", s.density), finite_text("{:.3f}", s.spacing),
        finite_text("{:.0f}", s.middle_density));
    for (const double density : s.place_density) {
      html += fmt::format("<td>{}</td>", finite_text("{:.0f}", density));
    }
    html += fmt::format(
        "<td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        finite_text("{:.2f}", s.cell_variation), percent(s.spacing_cells_covered),
        percent(s.empty_share),
        finite_text("{:.2f}", *std::max_element(s.largest_empty.begin(), s.largest_empty.end())));
  }
  return html +
         fmt::format(
             "</tbody></table></div>\n<p class=\"note\">R: half the swath width with a level "
             "platform. Dense: width about the middle with at least half the "
             "density. In the middle: a stripe of 1 m. Variation: standard deviation of the counts "
             "in squares of {:g} m within 0.9 R, over their mean. Squares with a point: of twice "
             "the spacing, within 0.95 R; at least 90 % where points are spread evenly (USGS Lidar "
             "Base Specification). Empty circles: share of the places within 0.97 R about which a "
             "circle of {:g} m holds no point; largest: diameter of the largest such circle.{}"
             "</p>\n",
             d.density_cell, d.empty_circle,
             d.strips.size() > kMostStripRows
                 ? fmt::format(" The first {} of {} strips.", kMostStripRows, d.strips.size())
                 : "");
}

}  // namespace

std::string distribution_page(const PointDistributionSummary& distribution,
                              const std::string& flight, const jobs::Provenance& provenance) {
  Figures figures;
  const std::vector<Chart> charts{map_of(distribution), strips_of(distribution),
                                  profile_of(distribution)};
  const std::string head = overview_html(key_numbers(distribution), charts, figures);
  Sections sections;
  sections.add("All strips together", summary_html(distribution) + charts_html(charts, figures, 1),
               Sections::Shown::unfolded);
  sections.add("Strip by strip", swaths_html(distribution));
  sections.add(kHowToRepeat, provenance_html(provenance));
  return page_html("Points on the ground: " + flight,
                   "Density and uniformity of a flight's points on the ground.", head, sections,
                   figures);
}

}  // namespace risley::report
