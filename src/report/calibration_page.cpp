// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/calibration_page.hpp"

#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

namespace risley::report {
namespace {

using calibration::CalibratedPlane;
using calibration::DatumKind;
using calibration::DirectionErrors;
using calibration::FormalDatum;
using calibration::PriorTest;
using calibration::SurfaceStep;

constexpr const char* kNothingToDraw = "<p>There are no points to draw.</p>\n";

std::string degrees(double radians) { return finite_text("{:.3g}", degrees_from_radians(radians)); }

/// A sigma that was never computed is zero.
std::string sigma_degrees(double sigma) {
  const double in_degrees = degrees_from_radians(sigma);
  return is_sigma(sigma) ? number_text(in_degrees, in_degrees).sigma : "–";
}

std::string recording_name(const CalibrationReport& r, std::size_t recording) {
  if (recording < r.recordings.size()) return r.recordings[recording].name;
  return fmt::format("recording {}", recording + 1);
}

std::string plane_name(const CalibrationReport& r, std::size_t plane) {
  return plane < r.planes.size() ? r.planes[plane].name : fmt::format("plane {}", plane + 1);
}

/// Pitch and yaw together: what moves where the sensor looks.
double boresight_sigma(const FormalDatum& datum) {
  return std::hypot(datum.sigma_pitch, datum.sigma_yaw);
}

bool has_poor_datum(const CalibrationReport& r) {
  return !(boresight_sigma(r.datum) <= calibration::kPoorDatum);
}

const char* datum_text(DatumKind kind) {
  switch (kind) {
    case DatumKind::planes:
      return "the known normals of walls fix the sensor's frame";
    case DatumKind::stations:
      return "the known rotations of the sensor between recordings fix its frame";
    case DatumKind::both:
      return "known normals of walls and known rotations between recordings fix the sensor's frame";
    case DatumKind::none:
      break;
  }
  return "no outside reference fixes the sensor's frame, only the shape of the bundle that its "
         "beams form";
}

std::string boresight_advice_html(const CalibrationReport& r) {
  return fmt::format(
      "<p><b>The absolute boresight from these walls must not be trusted:</b> pitch and yaw, "
      "which all beams share, have a combined standard uncertainty of {}°, and more than {:.2g}° "
      "is poor. The shape of the bundle, and with it the flatness of point clouds, is not "
      "affected. Set-ups that help:</p>{}",
      sigma_degrees(boresight_sigma(r.datum)), degrees_from_radians(calibration::kPoorDatum),
      list_html(
          {"a wall that is steeply tilted against the axis of view, 50 to 65 degrees, and "
           "fills the whole field of view",
           "a longer range to the walls",
           fmt::format(
               "the body turned upside down against a stop between two recordings, given with {}",
               name_of(kSetting.stations)),
           fmt::format("walls whose normals are known in the sensor's frame, given with {}",
                       name_of(kSetting.planes))}));
}

Verdict verdict_of(const CalibrationReport& r) {
  Verdict verdict;
  verdict.converged = r.converged;
  verdict.reason = r.reason;
  verdict.result = r.verdict.value_or(ReportedVerdict{});
  verdict.warnings = r.warnings;
  verdict.facts =
      r.planes.empty()
          ? "No wall was used."
          : fmt::format(
                "The walls are {} mm thick before and {} mm after the calibration (root mean "
                "square distance "
                "of {} points from {} plane{}); {}; the standard uncertainty of roll is {}°, of "
                "pitch {}° and of yaw {}°.",
                millimetres(r.rms_before), millimetres(r.rms_after), count_text(r.points),
                r.planes.size(), r.planes.size() == 1 ? "" : "s", datum_text(r.datum_kind),
                sigma_degrees(r.datum.sigma_roll), sigma_degrees(r.datum.sigma_pitch),
                sigma_degrees(r.datum.sigma_yaw));
  verdict.mend = fmt::format(
      "check in the views below that what was taken for walls really is walls; record more walls "
      "that fill the field of view, near and far and steeply tilted; hold parameters that these "
      "walls do not determine ({}); and check known normals and stations, if any were given",
      name_of(kSetting.fix));
  if (r.converged && has_poor_datum(r)) verdict.care_html = boresight_advice_html(r);
  return verdict;
}

std::string subject_text(const CalibrationReport& r) {
  std::string text;
  for (const ReportedRecording& one : r.recordings) {
    text += (text.empty() ? "" : ", ") + one.name;
  }
  text += fmt::format(
      "{}{} observations, {} of them used. Sensor {}{} with {} prisms, from the preset {}",
      text.empty() ? "" : ": ", count_text(r.observations), count_text(r.points), r.sensor,
      r.serial.empty() ? "" : " " + r.serial, r.prisms, r.preset);
  text += r.method == calibration::CalibrationMethod::paper
              ? "; by the paper's unweighted distances from planes"
              : "; by an adjustment of all recordings together";
  return text + ".";
}

std::vector<KeyNumber> key_numbers(const CalibrationReport& r) {
  std::vector<KeyNumber> numbers;
  if (r.pointing_error) {
    const auto known = [](double value, double sigma) {
      const NumberText text = number_text(degrees_from_radians(value), degrees_from_radians(sigma));
      return fmt::format("{}° ± {}°", text.value, text.sigma);
    };
    const DirectionErrors& errors = r.pointing_error->errors;
    numbers.push_back({known(errors.total, r.pointing_error->total_sigma),
                       "error of the reported directions: " + offset_text(errors.total)});
    numbers.push_back({known(errors.shape, r.pointing_error->shape_sigma),
                       "of this is in the shape of the bundle of beams, which no alignment "
                       "removes: " +
                           offset_text(errors.shape)});
  }
  numbers.push_back({fmt::format("{} mm", millimetres(r.rms_after)),
                     fmt::format("thickness of the walls after the calibration, {} mm before",
                                 millimetres(r.rms_before))});
  return numbers;
}

std::string to_place_of(double value, double sigma) {
  return std::isfinite(value) ? text_to_place_of(value, sigma) : "–";
}

std::string sigma_cell(double value, double sigma) {
  return fmt::format("<td>{}</td>", is_sigma(sigma) ? number_text(value, sigma).sigma : "–");
}

std::string parameter_row(const CalibrationReport& r, const ReportedParameter& row, bool any_held) {
  const ParameterInfo& info = find_parameter(row.name, r.shape());
  const double scale = 1.0 / info.si_per_unit;
  const double value = scale * row.value, sigma = scale * row.sigma_given_held.value_or(row.sigma);
  std::string html = fmt::format(
      "<tr>{}<td>{}</td>{}{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td>", parameter_head(info),
      to_place_of(value, sigma), sigma_cell(value, scale * row.sigma),
      any_held ? sigma_cell(value, sigma) : "", escape_html(info.unit),
      finite_text("{:.7g}", scale * row.nominal), to_place_of(scale * row.believed, sigma),
      to_place_of(scale * (row.value - row.believed), sigma));
  if (std::isfinite(row.truth)) {
    html +=
        fmt::format("<td>{}</td><td>{}</td><td{}>{}</td>", to_place_of(scale * row.truth, sigma),
                    to_place_of(scale * row.error, sigma),
                    std::abs(row.error_over_sigma) > kFarOff ? " class=\"far\"" : "",
                    finite_text("{:.2f}", row.error_over_sigma));
  }
  return html + "</tr>\n";
}

std::string parameters_html(const CalibrationReport& r) {
  const bool truth = !r.parameters.empty() && std::isfinite(r.parameters.front().truth);
  const bool any_held = any_held_parameter(r.parameters);
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>parameter</th><th>value</th>"
      "<th>σ</th>";
  if (any_held) html += "<th>σ given held</th>";
  html += "<th>unit</th><th>nominal</th><th>believed</th><th>difference</th>";
  if (truth) html += "<th>truth</th><th>error</th><th>error / σ</th>";
  html += "</tr></thead><tbody>\n";
  for (const ReportedParameter& row : r.parameters) html += parameter_row(r, row, any_held);
  return html +
         "</tbody></table></div>\n<p class=\"note\">σ is one standard deviation, everything "
         "included" +
         (any_held ? ", also the uncertainty of the parameters that were held, which the second σ "
                     "leaves out: if a held parameter is wrong, the others change so that the "
                     "beams still point the same way. Nominal"
                   : ". Nominal") +
         ": the preset. Believed: what the sensor used to compute its directions. Difference: "
         "value minus believed.</p>\n";
}

/// What a row of the table of range errors and sizes says, for readers.
std::string number_words(const std::string& name) {
  if (name == "range_offset_m") return "every range is longer by";
  if (name == "range_near_m") return "at 1 m from the sensor, ranges are longer by";
  if (name == "range_incidence")
    return "part of a tilted footprint's depth that ranges are longer by";
  if (name == "range_per_decade_m") return "ranges are longer for each tenth of the intensity by";
  constexpr std::string_view kEmitter = "range_emitter_", kThickness = "prism_thickness_",
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
std::string numbers_html(const CalibrationReport& r) {
  if (!r.numbers || r.numbers->empty()) return "";
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>ranges and beam origin</th><th>value</th>"
      "<th>σ</th><th>σ before</th><th>unit</th></tr></thead><tbody>\n";
  for (const calibration::CalibratedNumber& number : *r.numbers) {
    const bool length = number.name.ends_with("_m");
    const double scale = length ? kMillimetres : 1.0;
    const double value = scale * number.value, sigma = scale * number.total_sigma;
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td>{}<td>{}</td><td>{}</td></tr>\n",
                        escape_html(number_words(number.name)), to_place_of(value, sigma),
                        sigma_cell(value, sigma), finite_text("{:.2g}", scale * number.prior_sigma),
                        length ? "mm" : "1");
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">σ before: what was assumed. A σ that hardly "
         "changed means that these walls do not determine the value: boards of one material and "
         "known thickness, or dark and light patches on one wall, determine the error that depends "
         "on intensity.</p>\n";
}

std::string formal_datum_row(const char* name, const FormalDatum& datum) {
  std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", name);
  for (const double sigma : {datum.shape, datum.gauge, datum.total, datum.sigma_roll,
                             datum.sigma_pitch, datum.sigma_yaw}) {
    html += fmt::format("<td>{}</td>", sigma_degrees(sigma));
  }
  return html + "</tr>\n";
}

std::string direction_errors_row(const char* name, const DirectionErrors& errors) {
  std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", name);
  for (const double error : {errors.shape, errors.gauge, errors.total, errors.rotation.x,
                             errors.rotation.y, errors.rotation.z, errors.azimuth_rmse,
                             errors.zenith_rmse, errors.azimuth_bias, errors.zenith_bias}) {
    html += fmt::format("<td>{}</td>", degrees(error));
  }
  return html + "</tr>\n";
}

/// What reported directions are off by, and what of it all beams share.
std::string pointing_html(const CalibrationReport& r) {
  if (!r.pointing_error) return "";
  const DirectionErrors& errors = r.pointing_error->errors;
  std::string html = fmt::format(
      "<div class=\"wide\"><table><thead><tr><th>error of reported "
      "directions</th><th>deg</th><th>σ</th><th>mm at {:.0f} m</th></tr></thead><tbody>\n",
      kStatedDistance);
  const auto add = [&](const char* name, double error, double sigma) {
    html += fmt::format("<tr><th scope=\"row\">{}</th><td>{}</td>{}<td>{}</td></tr>\n", name,
                        to_place_of(degrees_from_radians(error), degrees_from_radians(sigma)),
                        sigma_cell(degrees_from_radians(error), degrees_from_radians(sigma)),
                        millimetres(offset_at(error)));
  };
  add("total", errors.total, r.pointing_error->total_sigma);
  add("shared: a rotation of all beams together", errors.gauge, r.pointing_error->gauge_sigma);
  add("shape: the rest", errors.shape, r.pointing_error->shape_sigma);
  add("shape of the worst beam", r.pointing_error->worst_shape,
      r.pointing_error->worst_shape_sigma);
  return html +
         fmt::format(
             "</tbody></table></div>\n<p class=\"note\">Root mean squares over the beams of the "
             "recordings: reported directions against those of this calibration, σ from the "
             "calibration's covariance. The shared rotation is roll {}°, pitch {}° and yaw {}°; "
             "aligning the mount by its point clouds removes it, but not the shape.</p>\n",
             to_place_of(degrees_from_radians(errors.rotation.x),
                         degrees_from_radians(r.datum.sigma_roll)),
             to_place_of(degrees_from_radians(errors.rotation.y),
                         degrees_from_radians(r.datum.sigma_pitch)),
             to_place_of(degrees_from_radians(errors.rotation.z),
                         degrees_from_radians(r.datum.sigma_yaw)));
}

std::string prior_tests_html(const std::vector<PriorTest>& tests) {
  if (tests.empty()) return "";
  std::string html =
      "<h3>Prior knowledge against the data</h3>\n<div "
      "class=\"wide\"><table><thead><tr><th>name</th><th>kind</th><th>misfit, "
      "deg</th><th>χ²</th><th>degrees of freedom</th><th>critical "
      "χ²</th><th>verdict</th></tr></thead><tbody>\n";
  for (const PriorTest& test : tests) {
    // Without a degree of freedom the data say nothing of it.
    const bool tested = test.degrees_of_freedom > 0 && std::isfinite(test.chi2 + test.critical);
    const bool fits = test.chi2 <= test.critical;
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td{}>{}</td></tr>\n",
        escape_html(test.name), test.station ? "station" : "known normal", degrees(test.misfit),
        finite_text("{:.3g}", test.chi2), test.degrees_of_freedom,
        finite_text("{:.3g}", test.critical), tested && !fits ? " class=\"far\"" : "",
        !tested ? "not tested"
        : fits  ? "fits"
                : "contradicts the data");
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">Misfit: the rotation between what was stated "
         "and what the adjustment found. A correct station or normal exceeds the critical value "
         "once in 10,000 times. Not tested: the data do not determine it.</p>\n";
}

std::string unobservable_html(const CalibrationReport& r) {
  if (r.unobservable.empty()) return "";
  std::vector<std::string> items;
  for (const estimation::WeakDirection& weak : r.unobservable) {
    items.push_back(fmt::format("{}: its sigma remains {}", direction_text(weak),
                                finite_text("{:.2g}", weak.sigma)));
  }
  return "<h3>What remains unobservable</h3>\n<p>The walls do not determine these combinations of "
         "parameters (in units of 1 degree, or 0.01 of an index).</p>\n" +
         list_html(items) + "\n";
}

std::string datum_html(const CalibrationReport& r) {
  std::string html = fmt::format(
      "<p>In this calibration {}.</p>\n"
      "<div class=\"wide\"><table><thead><tr><th>standard uncertainty of the beams, "
      "deg</th><th>shape</th><th>gauge</th><th>total</th><th>roll</th><th>pitch</th><th>yaw</th></"
      "tr></thead><tbody>\n",
      datum_text(r.datum_kind));
  html += formal_datum_row("everything included", r.datum);
  html +=
      formal_datum_row("without the common errors of the rotation angles", r.datum_without_common);
  html +=
      "</tbody></table></div>\n<p class=\"note\">Shape: distortion of the bundle of beams, which "
      "walls reveal. Gauge: the rotation that all beams share, roll, pitch and yaw about X, Y and "
      "Z, which only an outside reference, or the bundle's shape, determines. Both are root mean "
      "squares over the beams.</p>\n";
  if (r.truth) {
    html +=
        "<h3>Against the truth</h3>\n<div class=\"wide\"><table><thead><tr>"
        "<th>error of the beams, deg</th><th>shape</th><th>gauge</th><th>total</th><th>roll</th>"
        "<th>pitch</th><th>yaw</th><th>azimuth<br>RMSE</th><th>zenith<br>RMSE</th>"
        "<th>azimuth<br>bias</th><th>zenith<br>bias</th></tr></thead><tbody>\n";
    html += direction_errors_row("before", r.truth->before);
    html += direction_errors_row("after", r.truth->after);
    html +=
        "</tbody></table></div>\n<p class=\"note\">RMSE: root mean square error. Bias: mean error. "
        "Roll, pitch and yaw: the shared rotation that explains most of the errors.</p>\n";
  }
  return html + unobservable_html(r) + prior_tests_html(r.prior_tests);
}

/// A floor or a ceiling, whose normal has no azimuth to speak of.
bool is_level(const CalibratedPlane& plane) {
  constexpr double kSteep = 0.999;  // cosine of 2.6 degrees
  return std::abs(plane.normal.z) > kSteep;
}

std::string planes_html(const CalibrationReport& r) {
  if (r.planes.empty()) return "<p>There are none.</p>\n";
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>plane</th><th>recording</th>"
      "<th>normal azimuth,<br>deg</th><th>zenith,<br>deg</th><th>distance,<br>m</th><th>points</th>"
      "<th>outliers</th><th>RMS before,<br>mm</th><th>after,<br>mm</th><th>range σ,<br>mm</th></tr>"
      "</thead><tbody>\n";
  for (const CalibratedPlane& plane : r.planes) {
    const SphericalAngles<double> normal = angles_from_direction(plane.normal);
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        escape_html(plane.name), escape_html(recording_name(r, plane.recording)),
        is_level(plane) ? "–" : finite_text("{:.2f}", degrees_from_radians(normal.azimuth)),
        finite_text("{:.2f}", degrees_from_radians(normal.zenith)),
        finite_text("{:.3f}", plane.distance), count_text(plane.points), count_text(plane.outliers),
        millimetres(plane.rms_before), millimetres(plane.rms), millimetres(plane.range_sigma));
  }
  html +=
      "</tbody></table></div>\n<p class=\"note\">Normals and distances are seen from the sensor "
      "(X forward, Y left, Z up). RMS: root mean square distance of the points from the plane, "
      "before with the believed parameters and a plane fitted to them. Outliers: shots near the "
      "plane that were not used. Range σ: noise of one range that the residuals show.</p>\n";
  html += fmt::format(
      "<p>The residuals scatter {} times as much as the stated range noise "
      "predicts.</p>\n",
      finite_text("{:.3g}", r.sigma0));
  if (r.wall_shape && r.wall_shape->sigma > 0) {
    html += fmt::format(
        "<p>The walls wave by {} mm (one standard deviation) over {} m. Every sigma on this page "
        "includes what this may do to the result.</p>\n",
        finite_text("{:.2g}", kMillimetres * r.wall_shape->sigma),
        finite_text("{:.2g}", r.wall_shape->length));
  }
  return html;
}

std::string steps_html(const CalibrationReport& r) {
  if (r.planes.empty()) return "";
  if (r.steps.empty()) return "<p>No step was found on a wall.</p>\n";
  std::vector<std::string> items;
  for (const SurfaceStep& step : r.steps) {
    items.push_back(fmt::format(
        "{} in {}: {} mm {} the sensor, about {}° wide, around azimuth {}° and zenith {}°, {} "
        "points",
        plane_name(r, step.plane), recording_name(r, step.recording),
        millimetres(std::abs(step.height)), step.height < 0 ? "towards" : "away from",
        finite_text("{:.1f}", degrees_from_radians(step.size)),
        finite_text("{:.1f}", degrees_from_radians(step.azimuth)),
        finite_text("{:.1f}", degrees_from_radians(step.zenith)), step.points));
  }
  return "<h3>Steps on the walls</h3>\n<p>These regions stand off their wall, as a door frame or "
         "a picture does; their shots were left out of the adjustment.</p>\n" +
         list_html(items) + "\n";
}

}  // namespace

std::string calibration_page(const CalibrationReport& r) {
  Figures figures;
  const std::vector<Chart>& first = r.pointing_charts ? *r.pointing_charts : r.thickness_charts;
  const std::string head =
      verdict_html(verdict_of(r)) + overview_html(key_numbers(r), first, figures);
  Sections sections;
  std::string pointing = pointing_html(r);
  if (r.pointing_charts) pointing += charts_html(*r.pointing_charts, figures, 1);
  sections.add("Where the sensor points", pointing, Sections::Shown::unfolded);
  sections.add("Parameters", parameters_html(r) + numbers_html(r), Sections::Shown::unfolded);
  sections.add("Datum", datum_html(r) + charts_html(r.truth_charts, figures));
  sections.add("Walls", planes_html(r) + steps_html(r) + charts_html(r.wall_charts, figures));
  sections.add("Thickness of the walls",
               r.thickness_charts.empty()
                   ? kNothingToDraw
                   : charts_html(r.thickness_charts, figures, r.pointing_charts ? 0 : 1));
  sections.add("What was taken for a wall",
               r.view_charts.empty() ? kNothingToDraw : charts_html(r.view_charts, figures));
  sections.add(kCorrelations, correlation_html(r.free, r.covariance, r.shape()));
  sections.add(kTimes, time_audit_html(r.recordings));
  sections.add(kHowToRepeat, provenance_html(r.provenance));
  std::string title = "risley calibrate";
  if (!r.recordings.empty()) title += ": " + r.recordings.front().name;
  if (r.recordings.size() > 1) title += fmt::format(" and {} more", r.recordings.size() - 1);
  return page_html(title, subject_text(r), head, sections, figures);
}

}  // namespace risley::report
