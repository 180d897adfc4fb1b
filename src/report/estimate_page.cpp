// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/estimate_page.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/report/number_text.hpp"

#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/page_parts.hpp"

namespace risley::report {
namespace {

using estimation::Estimate;
using estimation::Moments;
using estimation::RotorStates;

constexpr std::size_t kMostPoints = 4000;     // per scatter diagram
constexpr std::size_t kMostMapPoints = 9000;  // of the scan pattern
constexpr double kPatternDuration = 0.09;     // s, as in the paper's figures of the pattern

Verdict verdict_of(const EstimatePageInput& input) {
  const Estimate& e = input.estimate;
  Verdict verdict;
  verdict.converged = e.converged;
  verdict.reason = e.reason;
  verdict.warnings = e.warnings;
  verdict.warnings.insert(verdict.warnings.end(), input.warnings.begin(), input.warnings.end());
  verdict.facts = fmt::format(
      "What is left unexplained is {:.3g}° in azimuth and {:.3g}° in zenith (root mean square); "
      "noise and rounding alone would leave {:.3g}°. {} of {} shots were left out as outliers.",
      degrees_from_radians(e.azimuth_residuals.rms), degrees_from_radians(e.zenith_residuals.rms),
      degrees_from_radians(e.expected_residual), e.outliers, e.series.size());
  verdict.healthy = "Healthy: the model describes this recording.";
  verdict.mend_html =
      "check that --sensor is the instrument that recorded, that --noise-angle-deg is its noise, "
      "and whether the file has the sign of the elevation turned (--mirror yes); a longer "
      "recording or --rate-hz full gives the estimation more to hold on to.";
  verdict.use_html =
      "nothing. Any command takes <code>calibration.yaml</code> with <code>--sensor</code>.";
  return verdict;
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

/// All diagrams of the page.
class ChartPage {
 public:
  explicit ChartPage(const EstimatePageInput& input)
      : input_(input),
        states_(input.estimate.states),
        azimuth_(input.estimate.map ? input.estimate.map->azimuth_residual
                                    : states_.azimuth_residual),
        zenith_(input.estimate.map ? input.estimate.map->zenith_residual : states_.zenith_residual),
        outlier_(input.estimate.map ? input.estimate.map->outlier : states_.outlier) {}

  const Figures& figures() const { return figures_; }

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
  std::string figure(const Chart& chart) { return figures_.add(chart); }

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
  Figures figures_;
};

}  // namespace

std::string estimate_page(const EstimatePageInput& input) {
  const Estimate& e = input.estimate;
  ChartPage charts(input);
  std::string body = verdict_html(verdict_of(input));
  body += parameters_html(input);
  body += "<h2>Rotors</h2>\n" + charts.rotors();
  body += "<h2>Residuals</h2>\n" + moments_html(e) + variance_html(e) + charts.residuals();
  body += "<h2>Scan pattern</h2>\n" + charts.pattern();
  body += correlation_html(e.free, e.covariance, e.sensor.prisms());
  body += provenance_html(input.provenance);
  return page_html("risley estimate: " + input.recording, subject_text(input), body,
                   charts.figures());
}

}  // namespace risley::report
