// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/estimate_page.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::report {
namespace {

using estimation::Moments;

/// What is known of the noise, in sentences; ends with a space.
std::string noise_words(const EstimateReport& r) {
  const double expected = degrees_from_radians(r.expected_residual);
  if (!r.noise || r.noise->held) {
    return fmt::format("The stated noise and rounding alone would leave {}°. ",
                       plain_text(expected, 3));
  }
  const auto angle = [](double value, double sigma) {
    const NumberText text = number_text(degrees_from_radians(value), degrees_from_radians(sigma));
    return fmt::format("{}° ± {}°", text.value, text.sigma);
  };
  return fmt::format(
      "Apart from rounding, the directions have a noise of {} in azimuth and {} in zenith, found "
      "in the data; a healthy unit of this kind has {}°. ",
      angle(r.noise->azimuth, r.noise->azimuth_sigma),
      angle(r.noise->zenith, r.noise->zenith_sigma),
      plain_text(degrees_from_radians(r.noise->usual), 3));
}

Verdict verdict_of(const EstimateReport& r) {
  Verdict verdict;
  verdict.converged = r.converged;
  verdict.reason = r.reason;
  verdict.result = r.verdict.value_or(ReportedVerdict{});
  verdict.warnings = r.warnings;
  verdict.facts = fmt::format(
      "The residuals are {}° in azimuth and {}° in zenith (root mean square). {}{} of {} shots "
      "were left out as outliers.",
      finite_text("{:.3g}", degrees_from_radians(r.azimuth_residuals.rms)),
      finite_text("{:.3g}", degrees_from_radians(r.zenith_residuals.rms)), noise_words(r),
      count_text(r.outliers), count_text(r.shots));
  verdict.mend = fmt::format(
      "check that {} is the instrument that made the recording, that its times are right, and "
      "whether the elevation in the file has the opposite sign ({} yes); a longer recording, or {} "
      "full, gives the estimate more data",
      name_of(kSetting.sensor), name_of(kSetting.mirror), name_of(kSetting.rate));
  return verdict;
}

std::vector<KeyNumber> key_numbers(const EstimateReport& r) {
  const auto angles = [](double azimuth, double zenith) {
    return fmt::format("{}°, {}°", finite_text("{:.3g}", degrees_from_radians(azimuth)),
                       finite_text("{:.3g}", degrees_from_radians(zenith)));
  };
  std::vector<KeyNumber> numbers{
      {angles(r.azimuth_residuals.rms, r.zenith_residuals.rms),
       "residuals of the directions in azimuth and zenith, root mean square: at most " +
           offset_text(std::max(r.azimuth_residuals.rms, r.zenith_residuals.rms))}};
  if (r.noise && !r.noise->held) {
    numbers.push_back({angles(r.noise->azimuth, r.noise->zenith),
                       "noise found in the directions, one standard deviation: at most " +
                           offset_text(std::max(r.noise->azimuth, r.noise->zenith))});
  }
  numbers.push_back({count_text(r.shots),
                     fmt::format("shots used, of which {} are outliers", count_text(r.outliers))});
  return numbers;
}

std::string subject_text(const EstimateReport& r) {
  const recordings::TimeAuditResult& audit = r.recording.audit;
  std::string text =
      fmt::format("{} ({}), {} observations over {:.4g} s, {} shots used. Sensor {} with {} prisms",
                  r.recording.name, r.recording.format, count_text(audit.observations),
                  audit.duration_s, count_text(r.shots), r.sensor, r.prisms);
  if (r.combination != 0) {
    text += r.combination == 1 ? "; speed combination 1, the slow rotor first"
                               : "; speed combination 2, the fast rotor first";
  }
  if (r.mirrored) text += "; the sign of the elevation was reversed";
  if (r.frame) {
    text += fmt::format(
        "; the recording's frame was turned back by {:.3f}° in yaw and {:.3f}° in "
        "pitch",
        degrees_from_radians(r.frame->yaw), degrees_from_radians(r.frame->pitch));
  }
  return text + ".";
}

std::string parameters_html(const EstimateReport& r) {
  const bool any_held = any_held_parameter(r.parameters);
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>parameter</th><th>value</th>"
      "<th>σ</th>";
  if (any_held) html += "<th>σ given held</th>";
  html += "<th>unit</th><th>nominal</th><th>difference</th>";
  if (r.truth) html += "<th>truth</th><th>error</th><th>error / σ</th>";
  html += "</tr></thead><tbody>\n";
  for (const ReportedParameter& row : r.parameters) {
    const ParameterInfo& info = find_parameter(row.name, r.shape());
    const double scale = 1.0 / info.si_per_unit,
                 sigma = row.sigma_given_held.value_or(row.sigma) * scale;
    const NumberText shown = number_text(row.value * scale, sigma);
    html += fmt::format("<tr>{}<td>{}</td><td>{}</td>", parameter_head(info), shown.value,
                        number_text(row.value * scale, row.sigma * scale).sigma);
    if (any_held) html += fmt::format("<td>{}</td>", shown.sigma);
    html += fmt::format("<td>{}</td>", escape_html(info.unit));
    if (std::isfinite(row.nominal)) {
      html += fmt::format("<td>{:.7g}</td><td>{}</td>", row.nominal * scale,
                          text_to_place_of((row.value - row.nominal) * scale, sigma));
    } else {
      html += "<td></td><td></td>";
    }
    if (r.truth && std::isfinite(row.truth)) {
      html += fmt::format("<td>{}</td><td>{}</td><td{}>{}</td>",
                          text_to_place_of(row.truth * scale, sigma),
                          text_to_place_of(row.error * scale, sigma),
                          std::abs(row.error_over_sigma) > kFarOff ? " class=\"far\"" : "",
                          finite_text("{:.2f}", row.error_over_sigma));
    } else if (r.truth) {
      html += "<td></td><td></td><td></td>";
    }
    html += "</tr>\n";
  }
  html += fmt::format(
      "</tbody></table></div>\n<p class=\"note\">σ is one standard deviation. {}Angular velocities "
      "are means over the recording, rotation angles are those at the first used shot.</p>\n",
      any_held ? "It includes the uncertainty of the parameters that were held; the second σ "
                 "leaves that out and is for comparing recordings of one unit. "
               : "");
  if (r.truth) {
    std::string rmse;
    for (std::size_t i = 0; i < r.truth->rotation_angle_rmse.size(); ++i) {
      rmse +=
          fmt::format("{}{}° for prism {}", i == 0 ? "" : ", ",
                      finite_text("{:.3g}", degrees_from_radians(r.truth->rotation_angle_rmse[i])),
                      prism_capital(static_cast<int>(i)));
    }
    html += fmt::format(
        "<p>Against the truth: the rotation angles are off by {} (root mean square). The squared "
        "errors are {:.3g} times (parameters) and {:.3g} times (rotation angles) what the stated "
        "sigmas predict; near 1 the sigmas are right, far above 1 they are too small.</p>\n",
        escape_html(rmse), r.truth->nees_parameters, r.truth->nees_rotation_angles);
  }
  return html;
}

std::string unobservable_html(const EstimateReport& r) {
  std::string html;
  if (!r.unobservable.empty()) {
    std::vector<std::string> items;
    for (const estimation::WeakDirection& weak : r.unobservable) {
      items.push_back(
          fmt::format("{}: its sigma remains {:.2g}", direction_text(weak), weak.sigma));
    }
    html += fmt::format(
                "<p>The recording does not determine these combinations of the free parameters (in "
                "units of 1 degree, or 0.01 of an index). Hold one parameter of each with "
                "<code>{}</code>.</p>\n",
                name_of(kSetting.fix)) +
            list_html(items);
  } else {
    html += "<p>The recording determines all free parameters.</p>\n";
  }
  if (!r.advice.empty()) html += list_html(r.advice);
  return html;
}

std::string pieces_html(const EstimateReport& r, Figures& figures) {
  if (!r.pieces || r.parameter_charts.empty()) return "";
  const EstimateReport::Pieces& p = *r.pieces;
  std::string html = fmt::format(
      "<p>Each dot is the estimate from one of {} pieces of the recording alone ({:.2g} s or "
      "less), with its own sigma. Their squared differences are {} times what their sigmas "
      "predict ({:.0f} degrees of freedom: 1 ± {:.2f} is expected if the sensor does not change "
      "and the sigmas are right).{}</p>\n",
      p.count, p.duration, finite_text("{:.2f}", p.chi2), p.degrees_of_freedom,
      p.degrees_of_freedom > 0 ? std::sqrt(2.0 / p.degrees_of_freedom) : 0.0,
      p.failed == 0 ? "" : fmt::format(" {} more pieces gave no estimate.", p.failed));
  return html + charts_html(r.parameter_charts, figures);
}

std::string moments_html(const EstimateReport& r) {
  const auto row = [](const char* name, const Moments& m) {
    const double k = kDegreesPerRadian;
    return fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td>{}</td></tr>\n",
        name, finite_text("{:.3g}", k * m.mean), finite_text("{:.3g}", k * m.std),
        finite_text("{:.3g}", k * m.rms), millimetres(offset_at(m.rms)),
        finite_text("{:.2f}", m.skewness), finite_text("{:.2f}", m.kurtosis), count_text(m.count));
  };
  return fmt::format(
             "<div class=\"wide\"><table><thead><tr><th>residual</th><th>mean, deg</th>"
             "<th>standard deviation, deg</th><th>root mean square, deg</th>"
             "<th>at {:.0f} m, mm</th><th>skewness</th><th>excess kurtosis</th><th>shots</th></tr>"
             "</thead><tbody>\n",
             kStatedDistance) +
         row("azimuth", r.azimuth_residuals) + row("zenith", r.zenith_residuals) +
         fmt::format(
             "</tbody></table></div>\n<p class=\"note\">Residual: observed minus estimated. At "
             "{:.0f} m: how far the root mean square moves a point there, at most. Outliers are "
             "left out of this table, of the histograms and of the maps. Skewness and excess "
             "kurtosis of a normal distribution are 0.</p>\n",
             kStatedDistance);
}

/// What the residuals did to the sigmas, and whether they hang on a prism's angle.
std::string variance_html(const EstimateReport& r) {
  std::string html;
  if (r.variance) {
    html += fmt::format(
        "<p>The residuals have {:.3f} times the stated variance, and their autocorrelation "
        "multiplies the variance of means by {:.3f}; every variance on this page was therefore "
        "multiplied by {:.3f}.</p>\n",
        r.variance->unit_variance, r.variance->autocorrelation_factor, r.variance->variance_factor);
  }
  std::string uneven;
  for (std::size_t k = 0; k < r.unevenness.size(); ++k) {
    uneven +=
        fmt::format("{}{} for prism {}", k == 0 ? "" : ", ", finite_text("{:.2f}", r.unevenness[k]),
                    prism_capital(static_cast<int>(k)));
  }
  return html + fmt::format(
                    "<p>The residuals' means over 5° of a prism's rotation angle have this many "
                    "times the variance that noise alone would give them: {}. Far above 1, the "
                    "optics are off in a way that the free parameters do not describe.</p>\n",
                    uneven);
}

}  // namespace

std::string estimate_page(const EstimateReport& r) {
  Figures figures;
  const std::string head =
      verdict_html(verdict_of(r)) + overview_html(key_numbers(r), r.residual_charts, figures);
  Sections sections;
  sections.add("Parameters", parameters_html(r), Sections::Shown::unfolded);
  sections.add("What this recording does not determine", unobservable_html(r));
  sections.add("Are the parameters stable?", pieces_html(r, figures));
  sections.add("Rotors", charts_html(r.rotor_charts, figures));
  sections.add("Residuals",
               moments_html(r) + variance_html(r) + charts_html(r.residual_charts, figures, 1));
  sections.add("Scan pattern", charts_html(r.pattern_charts, figures));
  sections.add(kCorrelations, correlation_html(r.free, r.covariance, r.shape()));
  sections.add(kTimes, time_audit_html({r.recording}));
  sections.add(kHowToRepeat, provenance_html(r.provenance));
  return page_html("risley estimate: " + r.recording.name, subject_text(r), head, sections,
                   figures);
}

}  // namespace risley::report
