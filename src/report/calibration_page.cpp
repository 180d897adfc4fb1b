// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/report/html.hpp"

#include "report/pages.hpp"

namespace risley::report {
namespace {

using json::Json;

constexpr const char* kNothingToDraw = "<p>There are no points to draw.</p>\n";

std::string degrees_cell(const View& angle) {
  return fmt::format("<td>{}</td>", finite_text("{:.3g}", angle.number()));
}

/// A sigma that was never computed is zero.
std::string sigma_text(double sigma) {
  return is_sigma(sigma) ? number_text(sigma, sigma).sigma : "–";
}

/// Pitch and yaw together: they move the sensor's line of sight.
double boresight_sigma(const View& r) {
  return std::hypot(r["datum"]["sigma_pitch_deg"].number(), r["datum"]["sigma_yaw_deg"].number());
}

const char* datum_text(const View& r) {
  using calibration::DatumKind;
  const std::string kind = r["datum"]["kind"].text();
  if (kind == to_string(DatumKind::planes)) {
    return "the known normals of walls fix the sensor's frame";
  }
  if (kind == to_string(DatumKind::stations)) {
    return "the known rotations of the sensor between recordings fix its frame";
  }
  if (kind == to_string(DatumKind::both)) {
    return "known normals of walls and known rotations between recordings fix the sensor's frame";
  }
  return "no external reference fixes the sensor's frame; only the shape of the beam bundle does";
}

std::string boresight_advice_html(const View& r) {
  return fmt::format(
      "<p><b>Do not trust the absolute boresight from these walls:</b> pitch and yaw, common to "
      "all beams, have a combined standard uncertainty of {}°, and more than {:.2g}° is poor. This "
      "does not affect the shape of the bundle, and so the flatness of point clouds. Set-ups that "
      "help:</p>{}",
      sigma_text(boresight_sigma(r)), degrees_from_radians(calibration::kPoorDatum),
      list_html({"a wall that is tilted steeply against the optical axis, by 50 to 65 degrees, and "
                 "fills the whole field of view",
                 "a longer range to the walls",
                 fmt::format("the body turned upside down against a stop between two recordings, "
                             "given with {}",
                             name_of(kSetting.stations)),
                 fmt::format("walls whose normals are known in the sensor's frame, given with {}",
                             name_of(kSetting.planes))}));
}

std::string thickness_text(const View& r, const char* when) {
  return millimetres(r[when]["plane_rms_m"].number());
}

Verdict calibration_verdict(const View& r) {
  Verdict verdict = verdict_of(r);
  const std::size_t planes = r["planes"].size();
  const auto sigma = [&](const char* key) { return sigma_text(r["datum"][key].number()); };
  verdict.facts =
      planes == 0
          ? "No wall was used."
          : fmt::format(
                "The walls are {} mm thick before and {} mm after the calibration (root mean "
                "square distance "
                "of {} points from {} plane{}); {}; the standard uncertainty of roll is {}°, of "
                "pitch {}° and of yaw {}°.",
                thickness_text(r, "before"), thickness_text(r, "after"),
                count_text(r["points"].count()), planes, planes == 1 ? "" : "s", datum_text(r),
                sigma("sigma_roll_deg"), sigma("sigma_pitch_deg"), sigma("sigma_yaw_deg"));
  verdict.mend = fmt::format(
      "check in the views below that all walls found are real; record more walls that fill the "
      "field of view, near and far and steeply tilted; hold parameters that these walls do not "
      "determine ({}); and check known normals and stations, if any were given",
      name_of(kSetting.fix));
  const bool poor = !(radians_from_degrees(boresight_sigma(r)) <= calibration::kPoorDatum);
  if (verdict.converged && poor) verdict.care_html = boresight_advice_html(r);
  return verdict;
}

std::string calibration_subject(const View& r) {
  const std::string names = recording_names(r), serial = r.has("serial") ? r["serial"].text() : "";
  return fmt::format(
      "{}{}{} observations, {} of them used. Sensor {}{} with {} prisms, from the preset {}{}.",
      names, names.empty() ? "" : ": ", count_text(observations_of(r)),
      count_text(r["points"].count()), r["preset"].text(), serial.empty() ? "" : " " + serial,
      shape_of(r).prisms.elements, r["preset"].text(),
      r["method"].text() == "paper" ? "; by the paper's method, unweighted distances from planes"
                                    : "; by an adjustment of all recordings together");
}

std::vector<KeyNumber> calibration_numbers(const View& r) {
  if (!r["converged"].flag()) return {};
  const View total = r["pointing_error"]["total_deg"], shape = r["pointing_error"]["shape_deg"];
  return {{angle_text(total),
           "error of the reported directions: " + offset_of(total["value"].number())},
          {angle_text(shape),
           "of this is in the shape of the beam bundle, which no alignment removes: " +
               offset_of(shape["value"].number())},
          {fmt::format("{} mm", thickness_text(r, "after")),
           fmt::format("thickness of the walls after the calibration, {} mm before",
                       thickness_text(r, "before"))}};
}

std::string to_place_of(double value, double sigma) {
  return std::isfinite(value) ? text_to_place_of(value, sigma) : "–";
}

std::string sigma_cell(double value, double sigma) {
  return fmt::format("<td>{}</td>", is_sigma(sigma) ? number_text(value, sigma).sigma : "–");
}

std::string parameter_row(const View& r, const std::string& name, const View& parameter,
                          bool any_held) {
  const ParameterWords words = parameter_words(name, shape_of(r));
  const View page = r["page"];
  const double value = parameter["value"].number(), total = parameter["sigma"].number();
  const double sigma = parameter["sigma_given_held"].number();
  const double believed = number_of(page["believed"], name);
  std::string html = fmt::format(
      "<tr>{}<td>{}</td>{}{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td>", words.head_html,
      to_place_of(value, sigma), sigma_cell(value, total), any_held ? sigma_cell(value, sigma) : "",
      escape_html(words.unit), finite_text("{:.7g}", number_of(page["nominal"], name)),
      to_place_of(believed, sigma), to_place_of(value - believed, sigma));
  if (page.has("true")) {
    const double truth = number_of(page["true"], name), error = value - truth;
    const double ratio = total > 0 ? error / total : kUnknown;
    html += fmt::format(
        "<td>{}</td><td>{}</td><td{}>{}</td>", to_place_of(truth, sigma), to_place_of(error, sigma),
        std::abs(ratio) > kFarOff ? " class=\"far\"" : "", finite_text("{:.2f}", ratio));
  }
  return html + "</tr>\n";
}

std::string calibration_parameters_html(const View& r) {
  const bool any_held = any_held_parameter(r["parameters"]);
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>parameter</th><th>value</th>"
      "<th>σ</th>";
  if (any_held) html += "<th>σ given held</th>";
  html += "<th>unit</th><th>nominal</th><th>believed</th><th>difference</th>";
  if (r["page"].has("true")) html += "<th>truth</th><th>error</th><th>error / σ</th>";
  html += "</tr></thead><tbody>\n";
  for (const auto& [name, one] : r["parameters"].entries()) {
    html += parameter_row(r, name, one, any_held);
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">σ is one standard deviation, all error sources "
         "included" +
         (any_held ? ", also the uncertainty of the held parameters, which the second σ excludes: "
                     "if a held parameter is wrong, the others change so that the beams still "
                     "point the same way. Nominal"
                   : ". Nominal") +
         ": the preset. Believed: the values from which the sensor computed its directions. "
         "Difference: "
         "value minus believed.</p>\n";
}

/// Description of a row in the table of range errors and sizes.
std::string number_words(const std::string& name) {
  if (name == "constant_m") return "every range is longer by";
  if (name == "near_m") return "range excess at 1 m from the sensor";
  if (name == "incidence") return "range excess as a fraction of the depth of a tilted footprint";
  if (name == "per_decade_m") return "range excess per tenth of the intensity";
  constexpr std::string_view kEmitter = "emitter_", kThickness = "prism_thickness_",
                             kSpacing = "prism_spacing_";
  const auto part = [&](std::string_view prefix) {
    return name.substr(prefix.size(), name.size() - prefix.size() - 2);
  };
  if (name.starts_with(kEmitter)) return "ranges of emitter " + part(kEmitter) + " are longer by";
  if (name.starts_with(kThickness)) return "thickness of prism " + part(kThickness);
  if (name.starts_with(kSpacing)) return "spacing behind prism " + part(kSpacing);
  return name;
}

/// Range errors and sizes of the prisms.
std::string numbers_html(const View& r) {
  std::string rows;
  const auto add = [&](const std::string& name, const View& number) {
    const bool length = name.ends_with("_m");
    const double scale = length ? kMillimetres : 1.0;
    const double value = scale * number["value"].number(), sigma = scale * number["sigma"].number();
    rows += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td>{}<td>{}</td><td>{}</td></tr>\n",
        escape_html(number_words(name)), to_place_of(value, sigma), sigma_cell(value, sigma),
        finite_text("{:.2g}", scale * number["prior_sigma"].number()), length ? "mm" : "1");
  };
  for (const auto& [name, one] : r["ranges"].entries()) add(name, one);
  for (const auto& [name, one] : r["sizes"].entries()) add(name, one);
  if (rows.empty()) return "";
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>ranges and beam origin</th><th>value</th>"
      "<th>σ</th><th>σ before</th><th>unit</th></tr></thead><tbody>\n" +
      rows;
  return html +
         "</tbody></table></div>\n<p class=\"note\">σ before: what was assumed. A σ that hardly "
         "changed means that these walls do not determine the value; to determine the "
         "intensity-dependent error, scan boards of one material and known thickness, or dark and "
         "light patches on one wall.</p>\n";
}

std::string formal_datum_row(const char* name, const View& datum) {
  std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", name);
  for (const char* key : {"sigma_shape_deg", "sigma_gauge_deg", "sigma_total_deg", "sigma_roll_deg",
                          "sigma_pitch_deg", "sigma_yaw_deg"}) {
    html += fmt::format("<td>{}</td>", sigma_text(datum[key].number()));
  }
  return html + "</tr>\n";
}

std::string direction_errors_row(const char* name, const View& errors) {
  std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", name);
  for (const char* key : {"shape_deg", "gauge_deg", "total_deg"}) html += degrees_cell(errors[key]);
  for (const char* axis : {"roll", "pitch", "yaw"}) {
    html += degrees_cell(errors["rotation_deg"][axis]);
  }
  for (const char* key :
       {"azimuth_rmse_deg", "zenith_rmse_deg", "azimuth_bias_deg", "zenith_bias_deg"}) {
    html += degrees_cell(errors[key]);
  }
  return html + "</tr>\n";
}

/// Errors of reported directions, and the part common to all beams.
std::string pointing_html(const View& r) {
  const View pointing = r["pointing_error"];
  std::string html = fmt::format(
      "<div class=\"wide\"><table><thead><tr><th>error of reported "
      "directions</th><th>deg</th><th>σ</th><th>mm at {:.0f} m</th></tr></thead><tbody>\n",
      kStatedDistance);
  const auto add = [&](const char* name, const View& error) {
    const double value = error["value"].number(), sigma = error["sigma"].number();
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td>{}<td>{}</td></tr>\n", name,
                        to_place_of(value, sigma), sigma_cell(value, sigma),
                        millimetres(offset_at(radians_from_degrees(value))));
  };
  add("total", pointing["total_deg"]);
  add("shared: a rotation of all beams together", pointing["shared_deg"]);
  add("shape: the rest", pointing["shape_deg"]);
  add("shape of the worst beam", pointing["worst_deg"]);
  const auto turn = [&](const char* axis) {
    return to_place_of(pointing["rotation_deg"][axis].number(),
                       r["datum"][fmt::format("sigma_{}_deg", axis)].number());
  };
  return html +
         fmt::format(
             "</tbody></table></div>\n<p class=\"note\">Root mean squares over the beams of the "
             "recordings: reported directions against those of this calibration, σ from the "
             "calibration's covariance. The shared rotation is roll {}°, pitch {}° and yaw {}°; "
             "aligning the mount by means of point clouds removes it, but not the shape.</p>\n",
             turn("roll"), turn("pitch"), turn("yaw"));
}

std::string prior_tests_html(const View& r) {
  const std::vector<View> tests = r["prior_tests"].list();
  if (tests.empty()) return "";
  std::string html =
      "<h3>Prior knowledge against the data</h3>\n<div "
      "class=\"wide\"><table><thead><tr><th>name</th><th>kind</th><th>misfit, "
      "deg</th><th>χ²</th><th>degrees of freedom</th><th>critical "
      "χ²</th><th>verdict</th></tr></thead><tbody>\n";
  for (const View& test : tests) {
    // Without a degree of freedom it is not determined by the data.
    const double chi2 = test["chi2"].number(), critical = test["critical"].number();
    const std::uint64_t freedom = test["degrees_of_freedom"].count();
    const bool tested = freedom > 0 && std::isfinite(chi2 + critical), fits = chi2 <= critical;
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td>{}<td>{}</td><td>{}</td>"
        "<td>{}</td><td{}>{}</td></tr>\n",
        escape_html(test["name"].text()),
        test["kind"].text() == "station" ? "station" : "known normal",
        degrees_cell(test["misfit_deg"]), finite_text("{:.3g}", chi2), freedom,
        finite_text("{:.3g}", critical), tested && !fits ? " class=\"far\"" : "",
        !tested ? "not tested"
        : fits  ? "fits"
                : "contradicts the data");
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">Misfit: the rotation between the stated value "
         "and the adjusted one. A correct station or normal exceeds the critical value "
         "once in 10,000 times. Not tested: the data do not determine it.</p>\n";
}

std::string calibration_unobservable_html(const View& r) {
  if (r["unobservable"].size() == 0) return "";
  return "<h3>What remains unobservable</h3>\n<p>The walls do not determine these combinations of "
         "parameters (in units of 1 degree, or 0.01 of an index).</p>\n" +
         list_html(weak_directions(r["unobservable"])) + "\n";
}

std::string datum_html(const View& r) {
  std::string html = fmt::format(
      "<p>In this calibration {}.</p>\n"
      "<div class=\"wide\"><table><thead><tr><th>standard uncertainty of the beams, "
      "deg</th><th>shape</th><th>gauge</th><th>total</th><th>roll</th><th>pitch</th><th>yaw</th></"
      "tr></thead><tbody>\n",
      datum_text(r));
  html += formal_datum_row("everything included", r["datum"]);
  html += formal_datum_row("without the common errors of the rotation angles",
                           r["page"]["datum_without_common"]);
  html +=
      "</tbody></table></div>\n<p class=\"note\">Shape: distortion of the beam bundle, which walls "
      "reveal. Gauge: the rotation common to all beams, roll, pitch and yaw about X, Y and Z, "
      "which only an external reference, or the bundle's shape, determines. Both are root mean "
      "squares over the beams.</p>\n";
  if (r.has("truth")) {
    html +=
        "<h3>Against the truth</h3>\n<div class=\"wide\"><table><thead><tr>"
        "<th>error of the beams, deg</th><th>shape</th><th>gauge</th><th>total</th><th>roll</th>"
        "<th>pitch</th><th>yaw</th><th>azimuth<br>RMSE</th><th>zenith<br>RMSE</th>"
        "<th>azimuth<br>bias</th><th>zenith<br>bias</th></tr></thead><tbody>\n";
    html += direction_errors_row("before", r["truth"]["before"]);
    html += direction_errors_row("after", r["truth"]["after"]);
    html +=
        "</tbody></table></div>\n<p class=\"note\">RMSE: root mean square error. Bias: mean error. "
        "Roll, pitch and yaw: the shared rotation that explains most of the errors.</p>\n";
  }
  return html + calibration_unobservable_html(r) + prior_tests_html(r);
}

/// A floor or a ceiling has no meaningful azimuth: the cosine of 2.6 degrees.
constexpr double kSteep = 0.999;

std::string planes_html(const View& r) {
  if (r["planes"].size() == 0) return "<p>There are none.</p>\n";
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>plane</th><th>recording</th>"
      "<th>normal azimuth,<br>deg</th><th>zenith,<br>deg</th><th>distance,<br>m</th><th>points</th>"
      "<th>outliers</th><th>RMS before,<br>mm</th><th>after,<br>mm</th><th>range σ,<br>mm</th></tr>"
      "</thead><tbody>\n";
  for (const View& plane : r["planes"].list()) {
    const std::vector<double> n = plane["normal"].numbers();
    const SphericalAngles<double> normal =
        angles_from_direction(Vector3<double>{n.at(0), n.at(1), n.at(2)});
    const bool level = std::abs(n.at(2)) > kSteep;
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        escape_html(plane["name"].text()), escape_html(file_name(plane["recording"].text())),
        level ? "–" : finite_text("{:.2f}", degrees_from_radians(normal.azimuth)),
        finite_text("{:.2f}", degrees_from_radians(normal.zenith)),
        finite_text("{:.3f}", plane["offset_m"].number()), count_text(plane["points"].count()),
        count_text(plane["outliers"].count()), millimetres(plane["before_rms_m"].number()),
        millimetres(plane["rms_m"].number()), millimetres(plane["range_sigma_m"].number()));
  }
  html +=
      "</tbody></table></div>\n<p class=\"note\">Normals and distances are seen from the sensor "
      "(X forward, Y left, Z up). RMS: root mean square distance of the points from the plane, "
      "before with the believed parameters and a plane fitted to them. Outliers: shots near the "
      "plane that were not used. Range σ: noise of a single range, estimated from the "
      "residuals.</p>\n";
  html += fmt::format(
      "<p>The residuals scatter {} times as much as the stated range noise "
      "predicts.</p>\n",
      finite_text("{:.3g}", r["sigma0"].number()));
  const View shape = r["shape"];
  if (shape["sigma_m"].number() > 0) {
    html += fmt::format(
        "<p>The walls have a waviness of {} mm (one standard deviation) over {} m. Every sigma on "
        "this page includes its effect on the result.</p>\n",
        finite_text("{:.2g}", kMillimetres * shape["sigma_m"].number()),
        finite_text("{:.2g}", shape["length_m"].number()));
  }
  return html;
}

std::string steps_html(const View& r) {
  if (r["planes"].size() == 0) return "";
  if (r["steps"].size() == 0) return "<p>No step was found on a wall.</p>\n";
  std::vector<std::string> items;
  for (const View& step : r["steps"].list()) {
    const double height = step["height_m"].number();
    const auto angle = [&](const char* key) { return finite_text("{:.1f}", step[key].number()); };
    items.push_back(fmt::format(
        "{} in {}: {} mm {} the sensor, about {}° wide, around azimuth {}° and zenith {}°, {} "
        "points",
        step["plane"].text(), file_name(step["recording"].text()), millimetres(std::abs(height)),
        height < 0 ? "towards" : "away from", angle("size_deg"), angle("azimuth_deg"),
        angle("zenith_deg"), step["points"].count()));
  }
  return "<h3>Steps on the walls</h3>\n<p>These regions stand out from or behind their wall, as a "
         "door frame or a picture does; the adjustment did not use their shots.</p>\n" +
         list_html(items) + "\n";
}

}  // namespace

std::string calibration_page(const View& r) {
  Figures figures;
  const View charts = r["charts"];
  const auto drawn = [&](const char* name) -> const Json& { return charts[name].json(); };
  const auto or_none = [&](const char* name) {
    return drawn(name).empty() ? kNothingToDraw : charts_html(drawn(name), figures);
  };
  const std::string head = verdict_html(calibration_verdict(r)) +
                           overview_html(calibration_numbers(r), drawn("pointing"), figures);
  Sections sections;
  sections.add("Where the sensor points",
               pointing_html(r) + charts_html(drawn("pointing"), figures, 1),
               Sections::Shown::unfolded);
  sections.add("Parameters", calibration_parameters_html(r) + numbers_html(r),
               Sections::Shown::unfolded);
  sections.add("Datum", datum_html(r) + charts_html(drawn("truth"), figures));
  sections.add("Walls", planes_html(r) + steps_html(r) + charts_html(drawn("walls"), figures));
  sections.add("Thickness of the walls", or_none("thickness"));
  sections.add("What was taken for a wall", or_none("views"));
  add_end(sections, r);
  return page_html("risley calibrate" + title_of(r), calibration_subject(r), head, sections,
                   figures);
}

}  // namespace risley::report
