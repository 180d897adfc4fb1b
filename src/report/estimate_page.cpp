// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/estimation/frame_turn.hpp"
#include "risley/report/html.hpp"

#include "report/pages.hpp"

namespace risley::report {
namespace {

using json::Json;

/// Description of the noise, in sentences; ends with a space.
std::string noise_words(const View& r) {
  const View noise = r["noise"];
  if (noise["held"].flag()) {
    return fmt::format("The stated noise and rounding alone would leave {}°. ",
                       plain_text(r["residuals"]["expected_rms_deg"].number(), 3));
  }
  return fmt::format(
      "Apart from rounding, the noise of the directions is {} in azimuth and {} in zenith, "
      "estimated from the data; a healthy unit of this kind has {}°. ",
      angle_text(noise["azimuth_deg"]), angle_text(noise["zenith_deg"]),
      plain_text(r["page"]["usual_noise_deg"].number(), 3));
}

double residual_rms(const View& r, const char* angle) {
  return r["residuals"][angle]["rms"].number();
}

Verdict estimate_verdict(const View& r) {
  Verdict verdict = verdict_of(r);
  verdict.facts = fmt::format(
      "The residuals are {}° in azimuth and {}° in zenith (root mean square). {}Rejected as "
      "outliers: {} of {} shots.",
      finite_text("{:.3g}", residual_rms(r, "azimuth_deg")),
      finite_text("{:.3g}", residual_rms(r, "zenith_deg")), noise_words(r),
      count_text(r["outliers"].count()), count_text(r["observations_used"].count()));
  return verdict;
}

std::vector<KeyNumber> estimate_numbers(const View& r) {
  const auto add = [](double azimuth, double zenith, const char* words) {
    return KeyNumber{
        fmt::format("{}°, {}°", finite_text("{:.3g}", azimuth), finite_text("{:.3g}", zenith)),
        words + offset_of(std::max(azimuth, zenith))};
  };
  std::vector<KeyNumber> numbers{
      add(residual_rms(r, "azimuth_deg"), residual_rms(r, "zenith_deg"),
          "residuals of the directions in azimuth and zenith, root mean square: at most ")};
  const View noise = r["noise"];
  if (!noise["held"].flag()) {
    numbers.push_back(
        add(noise["azimuth_deg"]["value"].number(), noise["zenith_deg"]["value"].number(),
            "noise of the directions, estimated from the data, one standard deviation: at most "));
  }
  numbers.push_back(
      {count_text(r["observations_used"].count()),
       fmt::format("shots used; outliers among them: {}", count_text(r["outliers"].count()))});
  return numbers;
}

std::string estimate_subject(const View& r) {
  const View recording = r["page"]["recordings"].list().front();
  std::string text = fmt::format(
      "{} ({}), {} observations over {} s, {} shots used. Sensor {} with {} prisms",
      recording["name"].text(), recording["format"].text(),
      count_text(recording["observations"].count()),
      finite_text("{:.4g}", recording["duration_s"].number()),
      count_text(r["observations_used"].count()), r["preset"].text(), shape_of(r).prisms.elements);
  if (r.has("combination")) {
    text += r["combination"].count() == 1 ? "; speed combination 1, the slow rotor first"
                                          : "; speed combination 2, the fast rotor first";
  }
  if (r["mirrored"].flag()) text += "; the sign of the elevation was reversed";
  if (r["frame"]["estimated"].flag()) {
    const auto [first, second] = estimation::turn_names(r["frame"].has("roll_deg"));
    text +=
        fmt::format("; the recording's frame was turned back by {:.3f}° in {} and {:.3f}° in {}",
                    r["frame"][first + "_deg"]["value"].number(), first,
                    r["frame"][second + "_deg"]["value"].number(), second);
  }
  return text + ".";
}

/// One number per prism: "1.2° for prism A, 1.3° for prism B".
std::string by_prism_words(const View& values, std::string_view format, const char* unit) {
  std::string words;
  for (const auto& [letter, value] : values.entries()) {
    words += fmt::format("{}{}{} for prism {}", words.empty() ? "" : ", ",
                         finite_text(format, value.number()), unit, prism_capital(letter[0] - 'a'));
  }
  return words;
}

std::string estimate_parameters_html(const View& r) {
  const bool any_held = any_held_parameter(r["parameters"]), truth = r.has("truth");
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>parameter</th><th>value</th>"
      "<th>σ</th>";
  if (any_held) html += "<th>σ given held</th>";
  html += "<th>unit</th><th>nominal</th><th>difference</th>";
  if (truth) html += "<th>truth</th><th>error</th><th>error / σ</th>";
  html += "</tr></thead><tbody>\n";
  for (const auto& [name, parameter] : r["parameters"].entries()) {
    const ParameterWords words = parameter_words(name, shape_of(r));
    const double value = parameter["value"].number();
    const double sigma = parameter["sigma_given_held"].number();
    const NumberText shown = number_text(value, sigma);
    html += fmt::format("<tr>{}<td>{}</td><td>{}</td>", words.head_html, shown.value,
                        number_text(value, parameter["sigma"].number()).sigma);
    if (any_held) html += fmt::format("<td>{}</td>", shown.sigma);
    html += fmt::format("<td>{}</td>", escape_html(words.unit));
    const double nominal = number_of(r["page"]["nominal"], name);
    if (std::isfinite(nominal)) {
      html += fmt::format("<td>{:.7g}</td><td>{}</td>", nominal,
                          text_to_place_of(value - nominal, sigma));
    } else {
      html += "<td></td><td></td>";
    }
    if (truth && r["truth"]["parameters"].has(name)) {
      const View own = r["truth"]["parameters"][name];
      const double ratio = own["error_over_sigma"].number();
      html += fmt::format(
          "<td>{}</td><td>{}</td><td{}>{}</td>", text_to_place_of(own["true"].number(), sigma),
          text_to_place_of(own["error"].number(), sigma),
          std::abs(ratio) > kFarOff ? " class=\"far\"" : "", finite_text("{:.2f}", ratio));
    } else if (truth) {
      html += "<td></td><td></td><td></td>";
    }
    html += "</tr>\n";
  }
  html += fmt::format(
      "</tbody></table></div>\n<p class=\"note\">σ is one standard deviation. {}Angular velocities "
      "are means over the recording, rotation angles are those at the first used shot.</p>\n",
      any_held ? "It includes the uncertainty of the held parameters; the second σ excludes it, "
                 "for comparing recordings of one unit. "
               : "");
  if (truth) {
    html += fmt::format(
        "<p>Compared with the truth, the rotation angles are off by {} (root mean square). The "
        "squared "
        "errors are {:.3g} times (parameters) and {:.3g} times (rotation angles) what the stated "
        "sigmas predict; near 1 the sigmas are right, far above 1 they are too small.</p>\n",
        by_prism_words(r["truth"]["rotation_angle_rmse_deg"], "{:.3g}", "°"),
        r["truth"]["nees_parameters"].number(), r["truth"]["nees_rotation_angles"].number());
  }
  return html;
}

std::string estimate_unobservable_html(const View& r) {
  std::string html;
  if (r["converged"].flag()) html = "<p>The recording determines all free parameters.</p>\n";
  if (r["unobservable"].size() > 0) {
    html = fmt::format(
               "<p>The recording does not determine these combinations of the free parameters "
               "(in units of 1 degree, or 0.01 of an index). Hold one parameter of each with "
               "<code>{}</code>.</p>\n",
               name_of(kSetting.fix)) +
           list_html(weak_directions(r["unobservable"]));
  }
  const std::vector<std::string> advice = r["page"]["advice"].texts();
  return advice.empty() ? html : html + list_html(advice);
}

std::string pieces_html(const View& r, Figures& figures) {
  const View charts = r["charts"]["parameters"];
  if (!r["page"].has("pieces") || charts.size() == 0) return "";
  const View p = r["page"]["pieces"];
  const double freedom = p["degrees_of_freedom"].number();
  const std::uint64_t failed = p["failed"].count();
  return fmt::format(
             "<p>Each dot is the estimate from one of {} pieces of the recording alone ({:.2g} s "
             "or "
             "less), with its own sigma. Their squared differences are {} times what their sigmas "
             "predict ({:.0f} degrees of freedom: 1 ± {:.2f} is expected if the sensor does not "
             "change and the sigmas are right).{}</p>\n",
             p["count"].count(), p["duration_s"].number(),
             finite_text("{:.2f}", p["chi2_per_degree_of_freedom"].number()), freedom,
             freedom > 0 ? std::sqrt(2.0 / freedom) : 0.0,
             failed == 0 ? ""
                         : fmt::format(" {} more piece{} gave no estimate.", failed,
                                       failed == 1 ? "" : "s")) +
         charts_html(charts.json(), figures);
}

std::string moments_html(const View& r) {
  const std::uint64_t outliers = r["outliers"].count(), used = r["observations_used"].count();
  const auto row = [&](const char* name, const View& m) {
    const auto cell = [&](const char* format, const char* key) {
      return fmt::format("<td>{}</td>", finite_text(format, m[key].number()));
    };
    return fmt::format("<tr><th scope=\"row\">{}</th>", name) + cell("{:.3g}", "mean") +
           cell("{:.3g}", "std") + cell("{:.3g}", "rms") +
           fmt::format("<td>{}</td>",
                       millimetres(offset_at(radians_from_degrees(m["rms"].number())))) +
           cell("{:.2f}", "skewness") + cell("{:.2f}", "kurtosis") +
           fmt::format("<td>{}</td></tr>\n", count_text(used - std::min(outliers, used)));
  };
  return fmt::format(
             "<div class=\"wide\"><table><thead><tr><th>residual</th><th>mean, deg</th>"
             "<th>standard deviation, deg</th><th>root mean square, deg</th>"
             "<th>at {:.0f} m, mm</th><th>skewness</th><th>excess kurtosis</th><th>shots</th></tr>"
             "</thead><tbody>\n",
             kStatedDistance) +
         row("azimuth", r["residuals"]["azimuth_deg"]) +
         row("zenith", r["residuals"]["zenith_deg"]) +
         fmt::format(
             "</tbody></table></div>\n<p class=\"note\">Residual: observed minus estimated. At "
             "{:.0f} m: the largest displacement of a point there that the root mean square "
             "causes. This table, the histograms and the maps exclude outliers. Skewness and "
             "excess "
             "kurtosis of a normal distribution are 0.</p>\n",
             kStatedDistance);
}

/// Effect of the residuals on the sigmas, and their dependence on a prism's angle.
std::string variance_html(const View& r) {
  const auto factor = [residuals = r["residuals"]](const char* key) {
    return finite_text("{:.3f}", residuals[key].number());
  };
  return fmt::format(
      "<p>The residuals have {} times the stated variance, and their autocorrelation "
      "multiplies the variance of means by {}; every variance on this page was therefore "
      "multiplied by {}.</p>\n<p>The residuals' means over 5° of a prism's rotation angle have "
      "this many times the variance that noise alone would give them: {}. Far above 1, the optics "
      "are off in a way that the free parameters do not describe.</p>\n",
      factor("unit_variance"), factor("autocorrelation_factor"), factor("variance_factor"),
      by_prism_words(r["residuals_over_angle_chi2_per_bin"], "{:.2f}", ""));
}

/// Inputs for programs of lidar odometry; none from a failure.
std::string noise_model_html(const View& r) {
  if (!r.has("noise_model") || !r["converged"].flag()) return {};
  const View model = r["noise_model"], shared = r["noise_model"]["shared"];
  const auto number = [](const View& value) { return finite_text("{:.3g}", value.number()); };
  const auto known = [&](const char* key, const char* unit, const char* source) {
    return shared.has(key) ? fmt::format("{}{} ({})", number(shared[key]), unit,
                                         escape_html(shared[source].text()))
                           : std::string("not known");
  };
  std::string html = fmt::format(
      "<p>One standard deviation of single points, rounding included: {} m in range ({}), and {}° "
      "in "
      "direction along either axis across the beam ({}° in azimuth, {}° in zenith); together a "
      "variance of {} m² at {} m. All points share further errors, which do not average out: in "
      "direction {}, in range {}.</p>\n<div class=\"wide\"><table><thead><tr><th>program</th>"
      "<th>setting</th><th>value</th></tr></thead><tbody>\n",
      number(model["range_m"]), escape_html(model["range_source"].text()),
      number(model["direction_deg"]), number(model["azimuth_deg"]), number(model["zenith_deg"]),
      number(model["point_variance_m2"]), number(model["range_distance_m"]),
      known("direction_deg", "°", "direction_source"), known("range_m", " m", "range_source"));
  for (const auto& [program, settings] : model["settings"].entries()) {
    for (const auto& [name, value] : settings.entries()) {
      html += fmt::format("<tr><th>{}</th><td>{}</td><td>{}</td></tr>\n", escape_html(program),
                          escape_html(name), number(value));
    }
  }
  return html + "</tbody></table></div>\n";
}

}  // namespace

std::string estimate_page(const View& r) {
  Figures figures;
  const View charts = r["charts"];
  const View residuals = charts["residuals"];
  const std::string head = verdict_html(estimate_verdict(r)) +
                           overview_html(estimate_numbers(r), residuals.json(), figures);
  Sections sections;
  sections.add("Parameters", estimate_parameters_html(r), Sections::Shown::unfolded);
  sections.add("What this recording does not determine", estimate_unobservable_html(r));
  sections.add("Are the parameters stable?", pieces_html(r, figures));
  sections.add("Rotors", charts_html(charts["rotors"].json(), figures));
  sections.add("Residuals",
               moments_html(r) + variance_html(r) + charts_html(residuals.json(), figures, 1));
  sections.add("Numbers for lidar odometry", noise_model_html(r));
  sections.add("Scan pattern", charts_html(charts["pattern"].json(), figures));
  add_end(sections, r);
  return page_html("risley estimate" + title_of(r), estimate_subject(r), head, sections, figures);
}

}  // namespace risley::report
