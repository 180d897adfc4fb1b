// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/comparison_page.hpp"

#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/report/html.hpp"
#include "risley/sensors/prism_sizes.hpp"
#include "risley/sensors/range_values.hpp"

#include "report/pages.hpp"

namespace risley::report {
namespace {

using calibration::PointingError;
using jobs::ParameterDifference;
using jobs::ResultComparison;

std::vector<KeyNumber> key_numbers(const PointingError& beams) {
  return {{angle_with_sigma(beams.errors.total, beams.total_sigma),
           fmt::format("between the directions of the two ({})", offset_text(beams.errors.total))},
          {angle_with_sigma(beams.errors.gauge, beams.gauge_sigma),
           "of that is a rotation of all beams together"},
          {angle_with_sigma(beams.errors.shape, beams.shape_sigma),
           "of that is between the beams: their shape"}};
}

/// Results of one converged run look alike on every page.
std::string verdict_of(const ComparedResult& one) {
  const View report(one.report);
  Verdict verdict = verdict_of(report);
  verdict.facts = "Of " + recording_names(report) + ".";
  return fmt::format("<div><h3>{} ({})</h3>{}</div>\n", escape_html(one.name), verb_of(one.report),
                     verdict_html(verdict));
}

struct InUnits {
  std::string head;
  double factor = 1;  ///< times the SI value
};

/// Words and symbol of a range error.
std::pair<std::string, std::string> range_words(std::string_view name) {
  if (name == jobs::kRangeOffset) return {"range offset", "r_0"};
  if (name == "range_near_m") return {"range error near the sensor", "r_n"};
  if (name == "range_incidence") return {"range error of tilted surfaces", "r_i"};
  if (name == "range_per_decade_m") return {"range error of dark surfaces", "r_d"};
  return {"range error of an emitter", "r_e"};
}

InUnits in_units(const ParameterDifference& one, TrainShape shape) {
  if (sensors::is_range_value(one.name)) {
    const auto [words, symbol] = range_words(one.name);
    return {parameter_head(words, symbol, one.name), 1};
  }
  if (const auto size = sensors::find_prism_size(one.name, shape.prisms)) {
    const bool thickness = !size->rate.thickness.empty();
    return {parameter_head(thickness ? "thickness of a prism" : "spacing of two prisms",
                           thickness ? "d" : "s", one.name),
            1};
  }
  const ParameterInfo& info = find_parameter(one.name, shape);
  return {parameter_head(info), 1 / info.si_per_unit};
}

std::string value_cells(double value, double sigma) {
  const NumberText text = number_text(value, sigma);
  return fmt::format("<td>{}</td><td>{}</td>", text.value,
                     is_sigma(sigma) ? text.sigma : std::string("held"));
}

std::string parameters_html(const ResultComparison& c, const ComparedResult& a,
                            const ComparedResult& b) {
  std::string html = fmt::format(
      "<div class=\"wide\"><table><thead><tr><th>parameter</th><th>{}</th><th>±</th><th>{}</th>"
      "<th>±</th><th>difference</th><th>±</th><th>in sigmas</th></tr></thead><tbody>\n",
      escape_html(a.name), escape_html(b.name));
  for (const ParameterDifference& one : c.parameters) {
    const InUnits units = in_units(one, c.b.shape());
    const bool known = is_sigma(one.sigma);
    const double ratio = known ? one.difference / one.sigma : 0;
    html += "<tr>" + units.head +
            value_cells(units.factor * one.value_a, units.factor * one.sigma_a) +
            value_cells(units.factor * one.value_b, units.factor * one.sigma_b);
    if (known) {
      const NumberText text = number_text(units.factor * one.difference, units.factor * one.sigma);
      html += fmt::format("<td>{}</td><td>{}</td><td{}>{:.1f}</td></tr>\n", text.value, text.sigma,
                          std::abs(ratio) > kFarOff ? " class=\"far\"" : "", ratio);
    } else {
      html += fmt::format("<td>{}</td><td>–</td><td>–</td></tr>\n",
                          plain_text(units.factor * one.difference, 4));
    }
  }
  return html + fmt::format(
                    "</tbody></table></div>\n<p class=\"note\">{} The two results are treated as "
                    "independent. "
                    "Differences beyond {:g} standard uncertainties stand out. Parameters may "
                    "change together in ways that leave the directions unchanged, so judge by the "
                    "difference in direction.</p>\n",
                    c.held_alike
                        ? "Both results are from one unit and held the same parameters at the same "
                          "values: any error of these is common to both, so the standard "
                          "uncertainties exclude it."
                        : "Standard uncertainties include the uncertainty of the held parameters.",
                    kFarOff);
}

std::string directions_html(const PointingError& beams) {
  std::string html = fmt::format(
      "<table><thead><tr><th>difference of the directions</th><th>root mean square</th><th>mm at "
      "{:.0f} m</th></tr></thead><tbody>\n",
      kStatedDistance);
  const auto row = [&](const char* head, double value, double sigma) {
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td></tr>\n", head,
                        angle_with_sigma(value, sigma), millimetres(offset_at(value)));
  };
  row("total", beams.errors.total, beams.total_sigma);
  row("shared: a rotation of all beams together", beams.errors.gauge, beams.gauge_sigma);
  row("shape: the rest", beams.errors.shape, beams.shape_sigma);
  row("shape of the worst beam", beams.worst_shape, beams.worst_shape_sigma);
  const Vector3<double>& turn = beams.errors.rotation;
  return html +
         fmt::format(
             "</tbody></table>\n<p class=\"note\">The direction of a beam according to the first "
             "result minus that of the second, over all rotation angles of the prisms. The shared "
             "rotation has a roll of {}°, a pitch of {}° and a yaw of {}°.</p>\n",
             plain_text(degrees_from_radians(turn.x), 3),
             plain_text(degrees_from_radians(turn.y), 3),
             plain_text(degrees_from_radians(turn.z), 3));
}

Chart differences_chart(const ResultComparison& c) {
  Chart chart{"Differences of the parameters",
              "parameter, in the order of the table",
              "difference, sigmas",
              {},
              "Parameters held in both results are omitted."};
  Series bars{"", "a", SeriesKind::points, {}, {}};
  for (std::size_t i = 0; i < c.parameters.size(); ++i) {
    if (!is_sigma(c.parameters[i].sigma)) continue;
    bars.x.push_back(static_cast<double>(i + 1));
    bars.y.push_back(c.parameters[i].difference / c.parameters[i].sigma);
  }
  chart.series.push_back(std::move(bars));
  return chart;
}

std::string subject_text(const ResultComparison& c) {
  const auto words = [](const sensors::Sensor& sensor) {
    return sensor.serial.empty() ? sensor.name + " of no known serial number"
                                 : fmt::format("{} {}", sensor.name, sensor.serial);
  };
  if (c.same_unit) return fmt::format("One unit, {}, in two results.", words(c.a));
  return fmt::format("{} and {}.", words(c.a), words(c.b));
}

}  // namespace

std::string comparison_page(const ComparedResult& a, const ComparedResult& b,
                            const ResultComparison& comparison,
                            const jobs::Provenance& provenance) {
  Figures figures;
  const std::string head =
      "<div class=\"charts\">\n" + verdict_of(a) + verdict_of(b) + "</div>\n" +
      overview_html(key_numbers(comparison.beams), {differences_chart(comparison)}, figures);
  Sections sections;
  sections.add("Parameters", parameters_html(comparison, a, b), Sections::Shown::unfolded);
  sections.add("Directions", directions_html(comparison.beams), Sections::Shown::unfolded);
  sections.add(kHowToRepeat, provenance_html(provenance));
  return page_html(fmt::format("Two results: {} and {}", a.name, b.name), subject_text(comparison),
                   head, sections, figures);
}

}  // namespace risley::report
