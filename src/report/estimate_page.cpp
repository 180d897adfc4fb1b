// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/estimate_page.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/report/number_text.hpp"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Woverlength-strings"  // Chart.js is one string
#include "report/chart_js.hpp"
#pragma GCC diagnostic pop
#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/page_assets.hpp"

namespace risley::report {
namespace {

using estimation::Estimate;
using estimation::Moments;
using estimation::RotorStates;

constexpr std::size_t kMostPoints = 4000;     // per scatter diagram
constexpr std::size_t kMostMapPoints = 9000;  // of the scan pattern
constexpr double kPatternDuration = 0.09;     // s, as in the paper's figures of the pattern
constexpr double kFarOff = 3.0;               // errors beyond so many sigmas stand out

/// "Δφ_L0" with a lowered index.
std::string symbol_html(const std::string& symbol) {
  const std::size_t underscore = symbol.find('_');
  if (underscore == std::string::npos) return escape_html(symbol);
  return fmt::format("{}<sub>{}</sub>", escape_html(symbol.substr(0, underscore)),
                     escape_html(symbol.substr(underscore + 1)));
}

std::string parameter_head(const ParameterInfo& parameter) {
  return fmt::format("<th scope=\"row\">{}, {}<span class=\"name\">{}</span></th>",
                     escape_html(parameter.long_name), symbol_html(parameter.symbol),
                     escape_html(parameter.name));
}

std::string list_html(const std::vector<std::string>& items) {
  std::string html = "<ul>";
  for (const std::string& item : items) html += fmt::format("<li>{}</li>", escape_html(item));
  return html + "</ul>";
}

std::string verdict_html(const EstimatePageInput& input) {
  const Estimate& e = input.estimate;
  std::vector<std::string> warnings = e.warnings;
  warnings.insert(warnings.end(), input.warnings.begin(), input.warnings.end());
  const std::string facts = fmt::format(
      "What is left unexplained is {:.3g}° in azimuth and {:.3g}° in zenith (root mean square); "
      "noise "
      "and rounding alone would leave {:.3g}°. {} of {} shots were left out as outliers.",
      degrees_from_radians(e.azimuth_residuals.rms), degrees_from_radians(e.zenith_residuals.rms),
      degrees_from_radians(e.expected_residual), e.outliers, e.series.size());
  std::string kind = "ok", title = "Healthy: the model describes this recording.", advice;
  if (!e.converged) {
    kind = "bad";
    title = "Not converged: do not use these numbers.";
    advice = fmt::format(
        "<p><b>Why:</b> {}</p><p><b>What to do:</b> check that --sensor is the instrument that "
        "recorded, that --noise-angle-deg is its noise, and whether the file has the sign of the "
        "elevation turned (--mirror yes); a longer recording or --rate-hz full gives the "
        "estimation more to hold on to.</p>",
        escape_html(e.reason));
  } else if (!warnings.empty()) {
    kind = "care";
    title = "Converged: usable, with care.";
    advice = list_html(warnings);
  } else {
    advice =
        "<p><b>What to do:</b> nothing. Any command takes <code>calibration.yaml</code> with "
        "<code>--sensor</code>.</p>";
  }
  if (!e.converged && !warnings.empty()) advice += list_html(warnings);
  return fmt::format("<section class=\"verdict {}\"><strong>{}</strong><p>{}</p>{}</section>\n",
                     kind, escape_html(title), escape_html(facts), advice);
}

std::string subject_text(const EstimatePageInput& input) {
  const Estimate& e = input.estimate;
  std::string text =
      fmt::format("{} ({}), {} observations over {:.4g} s, {} shots used. Sensor {} with {} prisms",
                  input.recording, input.recording_format, input.observations, input.duration,
                  e.series.size(), e.sensor.name, e.sensor.prisms());
  if (e.sensor.combination) {
    text += *e.sensor.combination == sensors::SpeedCombination::first
                ? "; speed combination 1, the slow rotor first"
                : "; speed combination 2, the fast rotor first";
  }
  if (e.mirrored) text += "; the sign of the elevation was turned";
  return text + ".";
}

/// The value an estimation started from, in the estimate's speed combination; none for angles.
std::optional<double> nominal_value(const EstimatePageInput& input, const ParameterInfo& info) {
  if (info.kind == ParameterKind::rotation_angle) return std::nullopt;
  const auto& combination = input.estimate.sensor.combination;
  if (info.kind == ParameterKind::angular_velocity && combination && input.nominal.combination) {
    return with_combination(input.nominal, *combination).get(info.name);
  }
  return input.nominal.get(info.name);
}

std::string parameters_html(const EstimatePageInput& input) {
  const Estimate& e = input.estimate;
  const bool truth = input.evaluation.has_value();
  std::string html =
      "<h2>Parameters</h2>\n<div class=\"wide\"><table><thead><tr><th>parameter</th><th>value</th>"
      "<th>σ</th><th>unit</th><th>nominal</th><th>difference</th>";
  if (truth) html += "<th>truth</th><th>error</th><th>error / σ</th>";
  html += "</tr></thead><tbody>\n";
  for (const estimation::EstimatedValue& value : e.values) {
    const ParameterInfo& info = find_parameter(value.name, e.sensor.prisms());
    const double scale = 1.0 / info.si_per_unit, sigma = value.sigma * scale;
    const NumberText shown = number_text(value.value * scale, sigma);
    html += fmt::format("<tr>{}<td>{}</td><td>{}</td><td>{}</td>", parameter_head(info),
                        shown.value, shown.sigma, escape_html(info.unit));
    if (const auto nominal = nominal_value(input, info)) {
      html += fmt::format("<td>{:.7g}</td><td>{}</td>", *nominal * scale,
                          text_to_place_of((value.value - *nominal) * scale, sigma));
    } else {
      html += "<td></td><td></td>";
    }
    if (truth) {
      const auto& all = input.evaluation->parameters;
      const auto found = std::find_if(all.begin(), all.end(),
                                      [&](const auto& one) { return one.name == value.name; });
      if (found != all.end()) {
        html += fmt::format("<td>{}</td><td>{}</td><td{}>{:.2f}</td>",
                            text_to_place_of(found->truth * scale, sigma),
                            text_to_place_of(found->error * scale, sigma),
                            std::abs(found->error_over_sigma) > kFarOff ? " class=\"far\"" : "",
                            found->error_over_sigma);
      } else {
        html += "<td></td><td></td><td></td>";
      }
    }
    html += "</tr>\n";
  }
  html +=
      "</tbody></table></div>\n<p class=\"note\">σ is one standard deviation. Angular velocities "
      "are means over the recording, rotation angles are those at the first used shot.</p>\n";
  if (truth) {
    std::string rmse;
    for (std::size_t i = 0; i < input.evaluation->rotation_angle_rmse.size(); ++i) {
      rmse += fmt::format("{}{:.3g}° for prism {}", i == 0 ? "" : ", ",
                          degrees_from_radians(input.evaluation->rotation_angle_rmse[i]),
                          prism_letter(static_cast<int>(i)));
    }
    html += fmt::format(
        "<p>Against the truth: rotation angles are off by {} (root mean square). The squared "
        "errors "
        "are {:.3g} times (parameters) and {:.3g} times (rotation angles) what the stated sigmas "
        "promise; 1 is honest, far above 1 means sigmas that are too small.</p>\n",
        escape_html(rmse), input.evaluation->nees_parameters,
        input.evaluation->nees_rotation_angles);
  }
  return html;
}

std::string moments_html(const Estimate& e) {
  const auto row = [](const char* name, const Moments& m) {
    const double k = kDegreesPerRadian;
    return fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{:.3g}</td><td>{:.3g}</td><td>{:.3g}</td><td>{:.2f}</td>"
        "<td>{:.2f}</td><td>{}</td></tr>\n",
        name, k * m.mean, k * m.std, k * m.rms, m.skewness, m.kurtosis, m.count);
  };
  return "<div class=\"wide\"><table><thead><tr><th>residual</th><th>mean, deg</th>"
         "<th>standard deviation, deg</th><th>root mean square, deg</th><th>skewness</th>"
         "<th>excess kurtosis</th><th>shots</th></tr></thead><tbody>\n" +
         row("azimuth", e.azimuth_residuals) + row("zenith", e.zenith_residuals) +
         "</tbody></table></div>\n<p class=\"note\">Residual: observed minus estimated. Outliers "
         "are "
         "left out of this table and of the histograms. Skewness and excess kurtosis of a normal "
         "distribution are 0.</p>\n";
}

/// What the residuals did to the sigmas.
std::string variance_html(const Estimate& e) {
  if (!e.map) return "";
  return fmt::format(
      "<p>Residuals show {:.3f} times the variance that was stated, and their autocorrelation "
      "multiplies the variance of means by {:.3f}; for that every variance on this page was "
      "multiplied by {:.3f}.</p>\n",
      e.map->unit_variance, e.map->autocorrelation.factor, e.map->variance_factor);
}

std::string correlation_html(const Estimate& e) {
  const auto& free = e.free;
  if (free.empty()) return "";
  std::string html =
      "<h2>Correlations of the parameters</h2>\n<div class=\"wide\">"
      "<table class=\"heat\"><thead><tr><th></th>";
  std::vector<const ParameterInfo*> infos;
  for (const auto& parameter : free) {
    infos.push_back(&find_parameter(parameter.name, e.sensor.prisms()));
    html += fmt::format("<th scope=\"col\">{}</th>", symbol_html(infos.back()->symbol));
  }
  html += "</tr></thead><tbody>\n";
  const Eigen::MatrixXd& covariance = e.covariance;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    html += fmt::format("<tr>{}", parameter_head(*infos[static_cast<std::size_t>(i)]));
    for (Eigen::Index j = 0; j < covariance.cols(); ++j) {
      double r = covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j));
      if (std::abs(r) < 0.005) r = 0;  // not "-0.00"
      html += fmt::format("<td style=\"background:rgba(var(--{}),{:.2f})\">{:.2f}</td>",
                          r < 0 ? "minus" : "plus", 0.75 * std::min(std::abs(r), 1.0), r);
    }
    html += "</tr>\n";
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">Blue: the two rise together. Red: one "
         "rises where the other falls. Near ±1 only their sum or difference is well "
         "known.</p>\n";
}

std::string provenance_html(const EstimatePageInput& input) {
  std::string html = "<h2>How to make it again</h2>\n<dl>\n";
  for (const auto& [name, value] : input.provenance) {
    html += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_html(name), escape_html(value));
  }
  return html + "</dl>\n";
}

/// All diagrams of the page in one numbering.
class ChartPage {
 public:
  explicit ChartPage(const EstimatePageInput& input)
      : input_(input),
        states_(input.estimate.states),
        azimuth_(input.estimate.map ? input.estimate.map->azimuth_residual
                                    : states_.azimuth_residual),
        zenith_(input.estimate.map ? input.estimate.map->zenith_residual : states_.zenith_residual),
        outlier_(input.estimate.map ? input.estimate.map->outlier : states_.outlier) {}

  std::string data() const { return "[" + data_ + "]"; }

  std::string residuals() {
    const Estimate& e = input_.estimate;
    std::string html = "<div class=\"charts\">\n";
    html += residuals_over_time("Azimuth residuals over time", azimuth_, "a");
    html += residuals_over_time("Zenith residuals over time", zenith_, "b");
    html += one_histogram("Histogram of the azimuth residuals", azimuth_, e.azimuth_residuals, "a");
    html += one_histogram("Histogram of the zenith residuals", zenith_, e.zenith_residuals, "b");
    for (std::size_t rotor = 0; rotor < states_.rotation_angle.size(); ++rotor) {
      html += residuals_over_angle(rotor);
    }
    return html + "</div>\n";
  }

  std::string rotors() {
    std::string html = "<div class=\"charts\">\n";
    for (std::size_t rotor = 0; rotor < states_.angular_velocity.size(); ++rotor) {
      html += figure({fmt::format("Angular velocity of prism {}", letter(rotor)),
                      "time, s",
                      "angular velocity, deg/s",
                      {line("", rotor, states_.angular_velocity[rotor])},
                      peak_line_note(states_.size())});
    }
    if (input_.evaluation) {
      const auto& errors = input_.evaluation->rotation_angle_error;
      for (std::size_t rotor = 0; rotor < errors.size(); ++rotor) {
        html += figure({fmt::format("Error of the rotation angle of prism {}", letter(rotor)),
                        "time, s",
                        "estimate minus truth, deg",
                        {line("", rotor, errors[rotor])},
                        peak_line_note(states_.size())});
      }
    }
    return html + "</div>\n";
  }

  std::string pattern() {
    const estimation::AngleSeries& head = input_.head;
    std::size_t rows = 0;
    while (rows < head.size() && head.time(rows) <= kPatternDuration) ++rows;
    Series shots{"", "a", SeriesKind::points, {}, {}};
    for (const std::size_t i : every_nth(rows, kMostMapPoints)) {
      shots.x.push_back(degrees_from_radians(head.azimuth[i]));
      shots.y.push_back(degrees_from_radians(head.zenith[i]));
    }
    Chart chart{"Scan pattern of the first 0.09 s, as recorded",
                "azimuth, deg",
                "zenith, deg",
                {shots},
                every_nth_note(rows, kMostMapPoints),
                ChartKind::map};
    return figure(chart);
  }

 private:
  std::string figure(const Chart& chart) {
    if (number_ > 0) data_ += ",\n";
    data_ += chart_json(chart, number_);
    return figure_html(chart, number_++);
  }

  static std::string letter(std::size_t rotor) {
    return std::string(1, prism_letter(static_cast<int>(rotor)));
  }
  static std::string colour_of(std::size_t rotor) { return letter(rotor); }

  double time(std::size_t row) const {
    return 1e-9 * static_cast<double>(states_.time_ns[row] - states_.time_ns[0]);
  }
  double shot_time(std::size_t shot) const { return input_.estimate.series.time(shot); }

  Series line(const std::string& label, std::size_t rotor,
              const std::vector<double>& values) const {
    return peak_line(
        label, colour_of(rotor), states_.size(), [this](std::size_t i) { return time(i); },
        [&values](std::size_t i) { return degrees_from_radians(values[i]); });
  }

  std::string residuals_over_time(const std::string& title, const std::vector<double>& residual,
                                  const std::string& colour) {
    Series used{"used", colour, SeriesKind::points, {}, {}};
    Series outliers{"outliers", "bad", SeriesKind::points, {}, {}};
    const std::size_t shots = residual.size();
    for (const std::size_t i : every_nth(shots, kMostPoints)) {
      if (outlier_[i] != 0) continue;
      used.x.push_back(shot_time(i));
      used.y.push_back(degrees_from_radians(residual[i]));
    }
    // Outliers are few and matter: each is drawn as long as that is possible.
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < shots; ++i) {
      if (outlier_[i] != 0 && std::isfinite(residual[i])) rows.push_back(i);
    }
    for (const std::size_t k : every_nth(rows.size(), kMostPoints)) {
      outliers.x.push_back(shot_time(rows[k]));
      outliers.y.push_back(degrees_from_radians(residual[rows[k]]));
    }
    std::string note = every_nth_note(shots, kMostPoints);
    if (!rows.empty()) {
      note += " " + every_nth_note(rows.size(), kMostPoints, "outliers");
    }
    Chart chart{title, "time, s", "observed minus estimated, deg", {used}, note};
    if (!rows.empty()) chart.series.push_back(outliers);
    return figure(chart);
  }

  std::string one_histogram(const std::string& title, const std::vector<double>& residual,
                            const Moments& moments, const std::string& colour) {
    return figure(
        {title, "observed minus estimated, deg", "shots",
         histogram("residuals", colour, residual, outlier_, moments, kDegreesPerRadian),
         "All shots but the outliers. The outermost bins hold everything beyond 4.5 standard "
         "deviations."});
  }

  std::string residuals_over_angle(std::size_t rotor) {
    const auto angle = [this, rotor](std::size_t i) {
      return degrees_from_radians(wrap_to_two_pi(states_.rotation_angle[rotor][i]));
    };
    Chart chart{
        fmt::format("Residuals over the rotation angle of prism {}", letter(rotor)),
        "rotation angle, deg",
        "observed minus estimated, deg",
        {},
        every_nth_note(states_.size(), kMostPoints / 2, input_.estimate.map ? "knots" : "shots") +
            " Lines: means over 5° of all shots that were used.",
        ChartKind::full_turn};
    const estimation::AngleProfile& profile = input_.estimate.residuals_over_angle[rotor];
    const auto add = [&](const std::string& name, const std::vector<double>& residual,
                         const std::vector<double>& mean, const std::string& colour,
                         const std::string& mean_colour) {
      const auto value = [&residual](std::size_t i) { return degrees_from_radians(residual[i]); };
      Series points{name, colour, SeriesKind::points, {}, {}};
      for (const std::size_t i : every_nth(states_.size(), kMostPoints / 2)) {
        if (states_.outlier[i] != 0) continue;
        points.x.push_back(angle(i));
        points.y.push_back(value(i));
      }
      Series means{"mean of " + name, mean_colour, SeriesKind::line, {}, {}};
      for (std::size_t bin = 0; bin < mean.size(); ++bin) {
        means.x.push_back(360.0 * (static_cast<double>(bin) + 0.5) /
                          static_cast<double>(mean.size()));
        means.y.push_back(degrees_from_radians(mean[bin]));
      }
      chart.series.push_back(means);
      chart.series.push_back(points);
    };
    add("azimuth", states_.azimuth_residual, profile.mean_azimuth, "a", "ink");
    add("zenith", states_.zenith_residual, profile.mean_zenith, "b", "c");
    return figure(chart);
  }

  const EstimatePageInput& input_;
  const RotorStates& states_;
  const std::vector<double>&azimuth_, &zenith_;  // residuals of all shots
  const std::vector<unsigned char>& outlier_;
  std::string data_;
  std::size_t number_ = 0;
};

}  // namespace

std::string estimate_page(const EstimatePageInput& input) {
  ChartPage charts(input);
  const std::string title = "risley estimate: " + input.recording;
  std::string page = fmt::format(
      "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n<h1>{}</h1>\n"
      "<p class=\"lead\">{}</p>\n",
      escape_html(title), page_style(), escape_html(title), escape_html(subject_text(input)));
  page += verdict_html(input);
  page += parameters_html(input);
  page += "<h2>Rotors</h2>\n" + charts.rotors();
  page += "<h2>Residuals</h2>\n" + moments_html(input.estimate) + variance_html(input.estimate) +
          charts.residuals();
  page += "<h2>Scan pattern</h2>\n" + charts.pattern();
  page += correlation_html(input.estimate);
  page += provenance_html(input);
  page += "</main>\n<script>";
  page += kChartJs;
  page += "</script>\n<script type=\"application/json\" id=\"page-data\">\n" + charts.data();
  page += "\n</script>\n<script>\n";
  page += page_script();
  page += "</script>\n</body>\n</html>\n";
  return page;
}

}  // namespace risley::report
