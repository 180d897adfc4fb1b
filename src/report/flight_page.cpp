// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/flight_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "risley/calibration/calibrate.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/core/setting.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"

#include "report/flight_unknowns.hpp"

namespace risley::report {
namespace {

using calibration::DirectionErrors;
using calibration::FlightDatum;
using calibration::FlightUnknown;
using calibration::NotTold;
using calibration::StripPair;

/// A pair of strips keeps this sigma of a shift that its ground does not tell, m.
constexpr double kUntoldShift = 0.99;
/// Component of a sensor's axis along the vertical from which on it counts as vertical.
constexpr double kUpright = 0.8;
/// Correlations below it tie nothing.
constexpr double kTied = 0.1;

/// Three significant digits at most, never as a power of ten.
std::string angle_text(double radians) {
  const double angle = degrees_from_radians(radians);
  if (!is_sigma(std::abs(angle))) return finite_text("{:.0f}", angle);
  constexpr double kThirdDigit = 0.1;  // of two
  std::string text = text_to_place_of(angle, kThirdDigit * std::abs(angle));
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

/// "0.0039° (5.4 mm at 80 m)", at the height flown
std::string angle_on_ground(double radians, double height) {
  return fmt::format("{}° ({})", angle_text(radians), offset_text(radians, height));
}

const FlightUnknown* find_unknown(const FlightReport& r, std::string_view name) {
  const auto found = std::find_if(r.unknowns.begin(), r.unknowns.end(),
                                  [&](const FlightUnknown& one) { return one.name == name; });
  return found == r.unknowns.end() ? nullptr : &*found;
}

/// "6.0021° ± 0.0020°"
std::string boresight_text(const FlightReport& r, std::string_view name) {
  const FlightUnknown* unknown = find_unknown(r, name);
  if (unknown == nullptr || !std::isfinite(unknown->value)) return "–";
  const NumberText text =
      number_text(degrees_from_radians(unknown->value), degrees_from_radians(unknown->sigma));
  if (unknown->held || text.sigma.empty()) return text.value + "° (held)";
  return fmt::format("{}° ± {}°", text.value, text.sigma);
}

std::string poor_rotation_html(const FlightReport& r) {
  return fmt::format(
      "<p><b>The directions of the beams are poorly known:</b> the rotation that all beams share "
      "has a sigma of {}°, {}° and {}° about the sensor's X, Y and Z, and more than {:.2g}° "
      "together is poor. Flights that help:</p>{}",
      angle_text(r.datum.sigma_x), angle_text(r.datum.sigma_y), angle_text(r.datum.sigma_z),
      degrees_from_radians(calibration::kPoorDatum),
      list_html({"strips that cross, and strips in opposite directions over the same ground",
                 "ground with roofs, embankments or other slopes in several directions",
                 "a better trajectory, above all in heading",
                 "an aircraft that sways a little: damped mounts reveal less"}));
}

Verdict verdict_of(const FlightReport& r) {
  Verdict verdict;
  verdict.converged = r.converged;
  verdict.reason = r.reason;
  verdict.result = r.verdict.value_or(ReportedVerdict{});
  verdict.warnings = r.warnings;
  verdict.facts =
      r.unknowns.empty()
          ? "Nothing was adjusted."
          : fmt::format(
                "The strips, straight stretches of the flight, lie {} mm apart before and {} mm "
                "after the calibration (root mean square over {} of them and all ground that they "
                "share). The boresight, the sensor's actual rotation against the mount as "
                "designed, is X {}, Y {}, Z {} about the sensor's axes. Boresight and prisms "
                "together give the directions of the beams to {}, root mean square over the field "
                "of view.",
                millimetres(r.rms_before), millimetres(r.rms_after),
                r.pair_count == 1 ? "one pair" : fmt::format("{} pairs", r.pair_count),
                boresight_text(r, "boresight_x_deg"), boresight_text(r, "boresight_y_deg"),
                boresight_text(r, "boresight_z_deg"),
                angle_on_ground(r.datum.total, r.datum.height));
  verdict.mend = fmt::format(
      "check in the differences between strips below that overlapping strips are of one flight; "
      "check the axes of the mount, and that recording and trajectory use the same time; give "
      "larger sigmas to what the mount states too precisely; and hold parameters that this flight "
      "does not determine ({})",
      name_of(kSetting.fix));
  if (!r.converged) return verdict;
  if (!(r.datum.rotation <= calibration::kPoorDatum)) verdict.care_html = poor_rotation_html(r);
  if (!(r.rms_after < r.rms_before)) {
    verdict.care_html +=
        "<p><b>The strips fit no better than before.</b> What was given may be as good as what "
        "was found.</p>";
  }
  return verdict;
}

std::string subject_of(const FlightReport& r) {
  std::string text;
  for (const ReportedRecording& one : r.recordings) {
    text += (text.empty() ? "" : ", ") + one.name;
  }
  text += fmt::format(
      "{}{} strips, {} shots with a range, {} of them used. Sensor {}{} with {} prisms, from the "
      "preset {}",
      text.empty() ? "" : ": ", r.strip_count, count_text(r.shots), count_text(r.used), r.sensor,
      r.serial.empty() ? "" : " " + r.serial, r.prisms, r.preset);
  if (!r.mount.empty()) text += fmt::format(", on {}", r.mount);
  return text + "; by an adjustment of all strips, the mount and the trajectory together.";
}

std::vector<KeyNumber> key_numbers(const FlightReport& r) {
  if (r.unknowns.empty()) return {};
  return {{fmt::format("{} mm", millimetres(r.rms_after)),
           fmt::format("between strips after the calibration, {} mm before",
                       millimetres(r.rms_before))},
          {fmt::format("{}°", angle_text(r.datum.total)),
           "standard uncertainty of the directions of the beams: " +
               offset_text(r.datum.total, r.datum.height)},
          {fmt::format("{} mm", millimetres(r.range_sigma)), "noise of one range"}};
}

std::string to_place(double value, double sigma) {
  return std::isfinite(value) ? text_to_place_of(value, sigma) : "–";
}

std::string unknown_row(const FlightReport& r, std::size_t i, bool prisms) {
  const FlightUnknown& unknown = r.unknowns[i];
  const UnknownInfo info = unknown_info(unknown.name, r.shape());
  const double scale = 1.0 / info.si_per_unit;
  const double sigma = scale * unknown.sigma;
  const auto in_unit = [&](double value) { return to_place(scale * value, sigma); };
  std::string html =
      fmt::format("<tr>{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                  parameter_head(info.long_name, info.symbol, unknown.name), in_unit(unknown.value),
                  is_sigma(sigma) ? number_text(scale * unknown.value, sigma).sigma : "–",
                  escape_html(info.unit), in_unit(unknown.start));
  html += fmt::format("<td>{}</td>", in_unit(unknown.value - unknown.start));
  if (prisms) html += fmt::format("<td>{}</td>", finite_text("{:.7g}", scale * r.nominal[i]));
  html += fmt::format("<td>{}</td>", is_sigma(unknown.prior_sigma)
                                         ? finite_text("{:.3g}", scale * unknown.prior_sigma)
                                         : "–");
  if (unknown.held) {
    html += fmt::format("<td class=\"text\" colspan=\"2\">{}</td>",
                        is_sigma(unknown.sigma) ? "held, but uncertain" : "held");
  } else {
    html += fmt::format("<td>{}</td>", finite_text("{:.0f} %", 100 * unknown.prior_share));
    html += unknown.twin.empty() || !(std::abs(unknown.twin_correlation) >= kTied)
                ? "<td class=\"text\">–</td>"
                : fmt::format("<td class=\"text\">{} ({})</td>",
                              symbol_html(unknown_info(unknown.twin, r.shape()).symbol),
                              finite_text("{:.2f}", unknown.twin_correlation));
  }
  if (r.truth) {
    const double error = unknown.value - r.truth->values[i];
    const double ratio =
        unknown.held || !is_sigma(unknown.sigma) ? kUnknown : error / unknown.sigma;
    html += fmt::format("<td>{}</td><td>{}</td><td{}>{}</td>", in_unit(r.truth->values[i]),
                        in_unit(error), std::abs(ratio) > kFarOff ? " class=\"far\"" : "",
                        finite_text("{:.2f}", ratio));
  }
  return html + "</tr>\n";
}

std::string unknowns_table(const FlightReport& r, bool prisms) {
  std::string rows;
  for (std::size_t i = 0; i < r.unknowns.size(); ++i) {
    if (is_of_train(r.unknowns[i].name) == prisms) rows += unknown_row(r, i, prisms);
  }
  if (rows.empty()) return "<p>There are none.</p>\n";
  return fmt::format(
      "<div "
      "class=\"wide\"><table><thead><tr><th>unknown</th><th>value</th><th>σ</th><th>unit</"
      "th><th>before</th><th>change</th>{}<th>σ "
      "before</th><th>share of<br>σ before</th><th class=\"text\">most correlated "
      "with</th>{}</tr></thead><tbody>\n{}</tbody></table></div>\n",
      prisms ? "<th>nominal</th>" : "",
      r.truth ? "<th>truth</th><th>error</th><th>error / σ</th>" : "", rows);
}

/// "forward", "to the right" or "down" of the body, or the numbers.
std::string axis_text(const Eigen::MatrixXd& body_from_sensor, Eigen::Index axis) {
  static constexpr std::array<std::pair<const char*, const char*>, 3> kWays = {
      {{"forward", "backward"}, {"to the right", "to the left"}, {"down", "up"}}};
  constexpr double kAlong = 1 - 1e-9;
  for (Eigen::Index k = 0; k < 3; ++k) {
    const auto& [with, against] = kWays[static_cast<std::size_t>(k)];
    if (body_from_sensor(k, axis) > kAlong) return with;
    if (body_from_sensor(k, axis) < -kAlong) return against;
  }
  return fmt::format("along ({:.4f}, {:.4f}, {:.4f})", body_from_sensor(0, axis),
                     body_from_sensor(1, axis), body_from_sensor(2, axis));
}

std::string mount_html(const FlightReport& r) {
  std::string html;
  const Eigen::MatrixXd& m = r.body_from_sensor;
  html += fmt::format(
      "<p>As designed, the sensor's X, its optical axis, points {}, its Y {} and its Z {}. "
      "Reference point of the trajectory: {}.</p>\n",
      axis_text(m, 0), axis_text(m, 1), axis_text(m, 2),
      r.reference_point.empty() ? "not named by the mount" : escape_html(r.reference_point));
  html += unknowns_table(r, false);
  return html +
         "<p class=\"note\">σ is one standard deviation, everything included. Before: what was "
         "given, with its σ. Share of σ before: (σ / σ before)², 100 % where the flight "
         "determines nothing. Most correlated with: the unknown with the largest correlation, "
         "which is in brackets, from ±0.1 on; near ±1 only the sum or the difference of the two "
         "is well known. Lever arm: from the trajectory's reference point to the sensor, along "
         "the body's axes.</p>\n";
}

std::string prisms_html(const FlightReport& r) {
  return unknowns_table(r, true) +
         "<p class=\"note\">Nominal: the preset. A pitch or yaw that all beams share can hardly "
         "be told from the boresight, so single angles may be known less well than the directions "
         "of the beams.</p>\n";
}

std::string datum_row(const char* name, double height, double total, double rotation, double shape,
                      const std::array<double, 3>& axes) {
  std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", name);
  for (const double value : {total, rotation, shape, axes[0], axes[1], axes[2]}) {
    html += fmt::format("<td>{}</td>", angle_text(value));
  }
  return html + fmt::format("<td>{}</td><td>{}</td></tr>\n", millimetres(offset_at(total, height)),
                            millimetres(offset_at(shape, height)));
}

std::string directions_html(const FlightReport& r) {
  const FlightDatum& d = r.datum;
  std::string html = fmt::format(
      "<div class=\"wide\"><table><thead><tr><th>directions "
      "of the beams, deg</th><th>total</th><th>rotation</th><th>shape</th><th>about X</th>"
      "<th>about Y</th><th>about Z</th><th>total at {0} m,<br>mm</th><th>shape at {0} m,<br>mm</th>"
      "</tr></thead><tbody>\n",
      finite_text("{:.0f}", d.height));
  html += datum_row("σ after this flight", d.height, d.total, d.rotation, d.shape,
                    {d.sigma_x, d.sigma_y, d.sigma_z});
  if (r.truth) {
    const auto row = [&](const char* name, const DirectionErrors& e) {
      return datum_row(name, d.height, std::hypot(e.gauge, e.shape), e.gauge, e.shape,
                       {e.rotation.x, e.rotation.y, e.rotation.z});
    };
    html += row("error before, against the truth", r.truth->before);
    html += row("error after, against the truth", r.truth->after);
  }
  return html + fmt::format(
                    "</tbody></table></div>\n<p class=\"note\">Boresight and prisms together, root "
                    "mean square over the field of view: the rotation that all beams share, about "
                    "the sensor's axes, and the shape, which no rotation explains. {} m is the "
                    "median range of the flight.</p>\n",
                    finite_text("{:.0f}", d.height));
}

/// What a combination that is not told means to somebody who flies.
std::string advice_of(const FlightReport& r, const NotTold& combination) {
  const auto has = [&](std::string_view name) {
    return combination.words.find(name) != std::string::npos;
  };
  if (has("of the trajectory")) {
    return "Only their sum is known. Points of this flight are not affected; on another flight "
           "the boresight may be off by as much as the trajectory was on this one.";
  }
  if (has("lever_arm") && has("clock_offset")) {
    return "At one speed, a sensor that sits further ahead and one whose clock is late look the "
           "same. Strips at two speeds tell them apart.";
  }
  if (has("lever_arm_z") && has("range_offset")) {
    return "Both raise or lower all ground. Points of known height determine them.";
  }
  if (has("lever_arm_z")) {
    return "In level flight the lever arm down raises or lowers all ground alike. Measure it "
           "well, or use points of known height.";
  }
  if (has("lever_arm")) {
    return "Slopes in several directions, strips in several directions and a swaying aircraft "
           "determine it.";
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    if (!has(fmt::format("boresight_{}", "xyz"[axis]))) continue;
    return std::abs(r.body_from_sensor(2, axis)) > kUpright
               ? "Flat ground does not show a rotation about the vertical: fly over roofs or "
                 "other slopes."
               : "Strips in opposite or crossing directions determine it.";
  }
  return "";
}

std::string not_told_html(const FlightReport& r) {
  std::string html;
  if (r.not_told.empty()) {
    return html + (r.unknowns.empty() ? "<p>Nothing was adjusted.</p>\n"
                                      : "<p>The flight adds to what was known of every free "
                                        "unknown.</p>\n");
  }
  html +=
      "<p>The flight says less about these than was known before, so what was given decides "
      "(numbers are in units of the σ before).</p>\n<ul>";
  for (const NotTold& one : r.not_told) {
    html += fmt::format("<li>{}: {} of the σ before remains. {}</li>",
                        escape_html(words_of_unknowns(one.words, r.shape())),
                        finite_text("{:.0f} %", 100 * one.sigma), escape_html(advice_of(r, one)));
  }
  return html + "</ul>\n";
}

std::string control_html(const FlightReport& r) {
  if (r.control.empty()) return {};
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>name</th><th>shots</th>"
      "<th>seen above it, mm</th><th>stated σ, mm</th><th></th></tr></thead><tbody>\n";
  for (const calibration::SeenControl& seen : r.control) {
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        escape_html(seen.name), count_text(seen.shots), seen.used ? millimetres(seen.off) : "–",
        millimetres(seen.sigma),
        !seen.used ? "left out" : (seen.significant ? "contradicts the flight" : ""));
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">Known points and planes on the ground, which "
         "the flight is tied to. Heights are along the ground's normal.</p>\n";
}

std::string shift_cell(const StripPair& pair, Eigen::Index axis) {
  if (!(pair.sigma[axis] < kUntoldShift)) return "<td>–</td>";
  const NumberText text =
      number_text(kMillimetres * pair.shift[axis], kMillimetres * pair.sigma[axis]);
  if (text.sigma.empty() || !std::isfinite(pair.shift[axis])) return "<td>–</td>";
  return fmt::format("<td>{} ± {}</td>", text.value, text.sigma);
}

std::string pair_cells(const StripPair* pair) {
  if (pair == nullptr) return "<td>–</td><td>–</td><td>–</td><td>–</td><td>–</td><td>–</td>";
  std::string html = fmt::format("<td>{}</td><td>{}</td><td>{}</td>", count_text(pair->cells),
                                 millimetres(pair->mean), millimetres(pair->rms));
  for (Eigen::Index axis = 0; axis < 3; ++axis) html += shift_cell(*pair, axis);
  return html;
}

std::string pairs_html(const FlightReport& r) {
  std::map<std::pair<int, int>, std::pair<const StripPair*, const StripPair*>> rows;
  for (const StripPair& pair : r.pairs_before) rows[{pair.first, pair.second}].first = &pair;
  for (const StripPair& pair : r.pairs_after) rows[{pair.first, pair.second}].second = &pair;
  if (rows.empty()) return "<p>No two strips saw the same ground.</p>\n";
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>strips</th><th></th><th>cells</th><th>mean,<br>mm"
      "</th><th>RMS,<br>mm</th><th>shift east,<br>mm</th><th>north,<br>mm</th><th>up,<br>mm</th>"
      "</tr></thead><tbody>\n";
  for (const auto& [strips, pair] : rows) {
    html += fmt::format(
        "<tr><th scope=\"row\">strip {} minus strip {}</th><td "
        "class=\"text\">before</td>{}</tr>\n<tr><th scope=\"row\"></th><td "
        "class=\"text\">after</td>{}</tr>\n",
        strips.second + 1, strips.first + 1, pair_cells(pair.first), pair_cells(pair.second));
  }
  html += "</tbody></table></div>\n<p class=\"note\">";
  if (rows.size() < r.pair_count) {
    html += fmt::format("The {} pairs with the most ground in common, of {}. ", rows.size(),
                        r.pair_count);
  }
  return html +
         "Cells: squares of ground that both strips saw. Differences are along the ground's "
         "normals, positive where the first strip named lies above the second; the shift is what "
         "explains most of them, with its sigma, and a dash where the ground has no slope that "
         "would determine it. After the calibration no mean or shift should stand out.</p>\n";
}

std::string strips_html(const FlightReport& r, Figures& figures) {
  std::string html;
  if (!r.strips.empty()) {
    html +=
        "<div class=\"wide\"><table><thead><tr><th>strip</th><th>begins, s</th><th>takes, s</th>"
        "<th>course, deg</th><th>speed, m/s</th><th>median range, m</th><th>sway, deg</th></tr>"
        "</thead><tbody>\n";
    for (const FlightReport::Strip& one : r.strips) {
      html += fmt::format(
          "<tr><th scope=\"row\">strip {}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}"
          "</td><td>{}</td></tr>\n",
          one.strip + 1, finite_text("{:.1f}", one.begin), finite_text("{:.1f}", one.duration),
          finite_text("{:.1f}", degrees_from_radians(one.course)), finite_text("{:.2f}", one.speed),
          finite_text("{:.1f}", one.range), finite_text("{:.2f}", degrees_from_radians(one.sway)));
    }
    html +=
        "</tbody></table></div>\n<p class=\"note\">Strips are numbered from 1; they begin in "
        "seconds since the first shot, and their course is that over ground. Sway: how much roll "
        "and pitch vary together; an aircraft that sways reveals more.</p>\n";
  }
  html += charts_html(r.strip_charts, figures);
  return html;
}

std::string shots_html(const FlightReport& r) {
  std::string html = fmt::format(
      "<p>{} of {} shots were used, on {} cells of ground. {} were left out because they lie "
      "beyond three sigmas of their cell{}; {} cells were too rough. The other shots hit such "
      "cells, or ground that only one strip saw.</p>\n",
      count_text(r.used), count_text(r.shots), count_text(r.cells), count_text(r.outliers),
      r.without_pose == 0 ? ""
                          : fmt::format(", and {} because the trajectory has no pose for them",
                                        count_text(r.without_pose)),
      count_text(r.rough_cells));
  html += fmt::format(
      "<p>The residuals scatter {} times as much as the stated noise of the ranges predicts: the "
      "noise of one range is {} mm.</p>\n",
      finite_text("{:.3g}", r.sigma0), millimetres(r.range_sigma));
  if (r.roughness.value_or(0) > 0) {
    html += fmt::format(
        "<p>Of that, {} mm are the ground itself, which departs from a plane within each cell; all "
        "strips see the same, and the uncertainties account for it.</p>\n",
        millimetres(*r.roughness));
  }
  return html;
}

std::string corrections_html(const FlightReport& r, Figures& figures) {
  std::string delay;
  if (r.attitude_delay && r.attitude_delay_sigma) {
    const NumberText text =
        number_text(1e3 * *r.attitude_delay, 1e3 * r.attitude_delay_sigma.value());
    delay = fmt::format(
        "<p>According to the strips, attitudes are late against positions by {} ± {} ms.</p>\n",
        text.value, text.sigma);
  }
  return fmt::format(
             "<p>Position and attitude are corrected at {} knots, points in time {} s apart, and "
             "linearly between. σ is their remaining uncertainty. Corrections should be about as "
             "large as the errors stated for the trajectory; where they jump or are larger, a "
             "warning says so, and the uncertainties account for it.</p>\n",
             count_text(r.knots), finite_text("{:.3g}", r.knot_spacing)) +
         delay + charts_html(r.correction_charts, figures);
}

std::string correlations_html(const FlightReport& r) {
  std::vector<Eigen::Index> known;
  std::vector<CorrelationHead> heads;
  for (std::size_t i = 0; i < r.unknowns.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (!(r.covariance(row, row) > 0)) continue;
    const UnknownInfo info = unknown_info(r.unknowns[i].name, r.shape());
    known.push_back(row);
    heads.push_back({parameter_head(info.long_name, info.symbol, r.unknowns[i].name),
                     symbol_html(info.symbol)});
  }
  return correlation_html(heads, r.covariance(known, known));
}

}  // namespace

std::string flight_page(const FlightReport& r) {
  Figures figures;
  const std::string head =
      verdict_html(verdict_of(r)) + overview_html(key_numbers(r), r.difference_charts, figures);
  Sections sections;
  sections.add("How well the beams are known", directions_html(r), Sections::Shown::unfolded);
  sections.add("Mount, ranges and clock", mount_html(r), Sections::Shown::unfolded);
  sections.add("What this flight does not determine", not_told_html(r));
  sections.add("Known ground", control_html(r));
  sections.add("Strips before and after",
               pairs_html(r) + charts_html(r.difference_charts, figures, 1));
  sections.add("The flight", strips_html(r, figures));
  sections.add("Ground", shots_html(r) + charts_html(r.ground_charts, figures));
  sections.add("Residuals", r.residual_charts.empty() ? "<p>There are none to draw.</p>\n"
                                                      : charts_html(r.residual_charts, figures));
  sections.add("Corrections of the trajectory", corrections_html(r, figures));
  sections.add("Prisms", prisms_html(r));
  sections.add(kCorrelations, correlations_html(r));
  sections.add(kTimes, time_audit_html(r.recordings));
  sections.add(kHowToRepeat, provenance_html(r.provenance));
  std::string title = "risley calibrate, in flight";
  if (!r.recordings.empty()) title += ": " + r.recordings.front().name;
  if (r.recordings.size() > 1) title += fmt::format(" and {} more", r.recordings.size() - 1);
  return page_html(title, subject_of(r), head, sections, figures);
}

}  // namespace risley::report
