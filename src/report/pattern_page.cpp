// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/pattern_page.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::report {
namespace {

Chart rosette_chart(const jobs::PatternDetails& details) {
  const sensors::ScanPattern& rosette = details.rosette;
  Series dots{"", "a", SeriesKind::points, {}, {}};
  for (std::size_t i = 0; i < rosette.size(); ++i) {
    if (std::isnan(rosette.azimuth[i])) continue;
    dots.x.push_back(degrees_from_radians(rosette.azimuth[i]));
    dots.y.push_back(degrees_from_radians(rosette.zenith[i]));
  }
  const double duration = details.coverage.after.back().time;
  Chart chart =
      view_of_directions({fmt::format("The first {:g} s as it grows", duration),
                          {},
                          {},
                          {dots},
                          details.rosette_every == 1
                              ? "Every shot is drawn."
                              : fmt::format("One in {} shots is drawn.", details.rosette_every)},
                         details.coverage.all_around);
  chart.grows_for = duration;
  return chart;
}

/// Density in cells of the map, larger ones if there are too many to draw.
Chart density_chart(const sensors::PatternCoverage& coverage, const sensors::CoverageAfter& after) {
  constexpr double kMostCells = 12'000;
  // A panorama is drawn in azimuth and elevation, in which cells of the map become tall away from
  // the horizon. Its squares hold at least one, and a whole number of them goes around.
  double merged = std::ceil(std::sqrt(static_cast<double>(coverage.cells()) / kMostCells));
  double edge = merged * coverage.cell;
  if (coverage.all_around) {
    const double tallest = 1 / std::sin(coverage.field_inner_angle);
    merged = std::max(merged, std::ceil(tallest));
    edge = kTwoPi / std::floor(kTwoPi / (merged * coverage.cell));
  }
  std::map<std::pair<long, long>, std::pair<double, double>> sums;  // shots, cells
  for (std::size_t i = 0; i < coverage.cells(); ++i) {
    const double x = coverage.all_around ? coverage.azimuth[i] : coverage.left[i];
    const double y = coverage.all_around ? kPi / 2 - coverage.zenith[i] : coverage.up[i];
    auto& [shots, cells] =
        sums[{std::lround(std::floor(x / edge)), std::lround(std::floor(y / edge))}];
    shots += after.cell_shots[i];
    cells += 1;
  }
  const double cell = degrees_from_radians(coverage.cell);
  Series cells{"", "ink", SeriesKind::cells, {}, {}};
  cells.cell_width = cells.cell_height = degrees_from_radians(edge);
  for (const auto& [place, sum] : sums) {
    const double y = degrees_from_radians(edge) * (static_cast<double>(place.second) + 0.5);
    cells.x.push_back(degrees_from_radians(edge) * (static_cast<double>(place.first) + 0.5));
    cells.y.push_back(coverage.all_around ? y : -y);
    cells.value.push_back(sum.first / (sum.second * cell * cell));
  }
  Chart chart{fmt::format("Density after {:g} s", after.time),
              coverage.all_around ? "azimuth, deg" : "left of the axis, deg",
              coverage.all_around ? "elevation, deg" : "below the axis, deg",
              {cells},
              fmt::format("{} shots, cells of {:.3g} degree. The colours end at four times the "
                          "mean.",
                          count_text(after.shots), degrees_from_radians(edge)),
              coverage.all_around ? ChartKind::panorama : ChartKind::map};
  chart.value_label = "shots per square degree";
  chart.value_range = {0.0, std::max(4 * after.mean_density * kSquareDegree, 1e-9)};
  return chart;
}

Chart ring_chart(const sensors::PatternCoverage& coverage) {
  static constexpr const char* kColours[] = {"a", "b", "c", "d", "ink", "bad"};
  Chart chart{coverage.all_around ? "Density by elevation" : "Density by the angle from the axis",
              coverage.all_around ? "elevation, deg" : "angle from the X axis, deg",
              "shots per square degree",
              {},
              "Only the part of each ring inside the field of view counts."};
  for (std::size_t k = 0; k < coverage.after.size(); ++k) {
    const sensors::CoverageAfter& after = coverage.after[k];
    Series line{fmt::format("{:g} s", after.time),
                kColours[k % std::size(kColours)],
                SeriesKind::line,
                {},
                {}};
    for (std::size_t i = 0; i < after.ring_density.size(); ++i) {
      if (coverage.all_around && std::isnan(after.ring_density[i])) continue;  // about the zenith
      const double angle = degrees_from_radians(coverage.ring) * (static_cast<double>(i) + 0.5);
      line.x.push_back(coverage.all_around ? 90 - angle : angle);
      line.y.push_back(after.ring_density[i] * kSquareDegree);
    }
    chart.series.push_back(std::move(line));
  }
  return chart;
}

/// Share of the field of view against time.
Chart growth_chart(const sensors::PatternCoverage& coverage) {
  constexpr std::size_t kMostPoints = 500;
  std::vector<double> times = coverage.first_shot;
  std::sort(times.begin(), times.end());
  Chart chart{"Covered against time",
              "time, s",
              "covered, %",
              {{"", "a", SeriesKind::line, {0.0}, {0.0}}},
              fmt::format("Cells of {:.3g} degree with at least one shot.",
                          degrees_from_radians(coverage.cell))};
  const std::size_t step = (times.size() + kMostPoints - 1) / kMostPoints;
  for (std::size_t i = step - 1; i < times.size() && std::isfinite(times[i]); i += step) {
    chart.series[0].x.push_back(times[i]);
    chart.series[0].y.push_back(100 * static_cast<double>(i + 1) /
                                static_cast<double>(times.size()));
  }
  chart.series[0].x.push_back(coverage.after.back().time);
  chart.series[0].y.push_back(100 * coverage.after.back().covered);
  return chart;
}

std::vector<KeyNumber> key_numbers(const sensors::PatternCoverage& coverage) {
  if (coverage.after.empty()) return {};
  const sensors::CoverageAfter& last = coverage.after.back();
  return {{fmt::format("{:.1f} %", 100 * last.covered),
           fmt::format("of the field of view covered after {:g} s", last.time)},
          {finite_text("{:.3f}°", degrees_from_radians(last.gap)),
           fmt::format("diameter of the largest gap after {:g} s", last.time)},
          {count_text(last.shots), fmt::format("shots in {:g} s", last.time)}};
}

std::string coverage_html(const sensors::PatternCoverage& coverage) {
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>after, s</th>"
      "<th>shots</th><th>covered</th><th>mean density, 1/deg²</th><th>least</th><th>greatest</th>"
      "<th>largest gap, deg</th><th>at azimuth, deg</th><th>zenith, deg</th></tr></thead><tbody>\n";
  for (const sensors::CoverageAfter& after : coverage.after) {
    html += fmt::format(
        "<tr><th scope=\"row\">{:g}</th><td>{}</td><td>{:.1f} %</td><td>{:.4g}</td><td>{:.4g}</td>"
        "<td>{:.4g}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        after.time, count_text(after.shots), 100 * after.covered,
        after.mean_density * kSquareDegree, after.least_density * kSquareDegree,
        after.greatest_density * kSquareDegree,
        finite_text("{:.3f}", degrees_from_radians(after.gap)),
        finite_text("{:.2f}", degrees_from_radians(after.gap_azimuth)),
        finite_text("{:.2f}", degrees_from_radians(after.gap_zenith)));
  }
  return html + fmt::format(
                    "</tbody></table></div>\n<p class=\"note\">Covered: the share of cells of "
                    "{:.3g} degree with at least one shot, among those that {:.3g} s reach ({:.5g} "
                    "square degrees). "
                    "Gap: the diameter of the largest circle without a shot, centred in this field "
                    "of view. Cells are squares of Lambert's {}.</p>\n",
                    degrees_from_radians(coverage.cell), coverage.field_after,
                    coverage.field_solid_angle / kSquareDegree,
                    coverage.all_around ? "cylindrical equal-area map about the Z axis"
                                        : "equal-area map about the X axis");
}

/// Kind and angles of a prism, as two cells of a table.
std::string shape_cells(const PrismTrain& train, int prism) {
  const double angle = degrees_from_radians(train[place::wedge_angle(prism)]);
  switch (train.face_order()[static_cast<std::size_t>(prism)]) {
    case FaceOrder::angled_perpendicular:
      return fmt::format("<td>angled</td><td>{:.6g}</td>", angle);
    case FaceOrder::perpendicular_angled:
      return fmt::format("<td>perpendicular</td><td>{:.6g}</td>", angle);
    case FaceOrder::angled_angled:
      return fmt::format("<td>angled, as the second</td><td>faces {:.6g} and {:.6g}</td>",
                         degrees_from_radians(train[place::prism_tilt_vertical(prism)]), angle);
    case FaceOrder::perpendicular_mirror_upright:
      break;
  }
  return fmt::format("<td>perpendicular, before a mirror</td><td>mirror {:.6g}</td>", angle);
}

std::string prisms_html(const sensors::Sensor& sensor) {
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>prism</th><th>first face</th>"
      "<th>wedge angle, deg</th><th>refractive index</th><th>speed, rpm</th></tr></thead><tbody>\n";
  for (int i = 0; i < sensor.prisms(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    html += fmt::format("<tr><th scope=\"row\">{}</th>{}<td>{:.6g}</td><td>{:.8g}</td></tr>\n",
                        prism_capital(i), shape_cells(sensor.train, i),
                        sensor.train[place::refractive_index(i)],
                        60 * sensor.angular_velocity[k] / kTwoPi);
  }
  return html + fmt::format(
                    "</tbody></table></div>\n<p class=\"note\">In firing order; {} emitter{}, "
                    "{} shots per second.</p>\n",
                    sensor.train.emitters(), sensor.train.emitters() == 1 ? "" : "s",
                    count_text(static_cast<std::uint64_t>(std::llround(sensor.shot_rate))));
}

}  // namespace

std::string pattern_page(const jobs::PatternDetails& details, const jobs::Provenance& provenance) {
  Figures figures;
  const sensors::PatternCoverage& coverage = details.coverage;
  const std::string head = overview_html(key_numbers(coverage), {rosette_chart(details)}, figures);
  Sections sections;
  std::vector<Chart> charts;
  for (const sensors::CoverageAfter& after : coverage.after) {
    charts.push_back(density_chart(coverage, after));
  }
  charts.push_back(growth_chart(coverage));
  charts.push_back(ring_chart(coverage));
  sections.add("Coverage and gaps", coverage_html(coverage) + charts_html(charts, figures),
               Sections::Shown::unfolded);
  sections.add("Prisms", prisms_html(details.sensor));
  sections.add(kHowToRepeat, provenance_html(provenance));
  return page_html("Scan pattern: " + details.sensor.name,
                   "The sensor's shot directions, without noise and with rotors at constant speed, "
                   "and how they fill its field of view.",
                   head, sections, figures);
}

}  // namespace risley::report
