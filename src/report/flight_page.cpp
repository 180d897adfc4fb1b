// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
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

#include "report/flight_unknowns.hpp"
#include "report/pages.hpp"

namespace risley::report {
namespace {

using json::Json;

/// Pairs of strips in the table, those with the most ground in common.
constexpr std::size_t kMostPairs = 200;
/// A pair of strips keeps this sigma of a shift that its ground does not determine, m.
constexpr double kUntoldShift = 0.99;
/// Component of a sensor's axis along the vertical from which on it counts as vertical.
constexpr double kUpright = 0.8;
/// Correlations below it tie nothing.
constexpr double kTied = 0.1;

/// Three significant digits at most, never as a power of ten.
std::string angle_text(double angle) {
  if (!is_sigma(std::abs(angle))) return finite_text("{:.0f}", angle);
  constexpr double kThirdDigit = 0.1;  // of two
  std::string text = text_to_place_of(angle, kThirdDigit * std::abs(angle));
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.ends_with('.')) text.pop_back();
  return text;
}

double datum_of(const View& r, const char* key) { return r["datum"][key].number(); }

/// Accuracy of directions, at the flying height.
std::string total_on_ground(const View& r) {
  return offset_text(radians_from_degrees(datum_of(r, "sigma_total_deg")), datum_of(r, "height_m"));
}

/// "6.0021° ± 0.0020°"
std::string boresight_text(const View& r, const std::string& name) {
  if (!r["unknowns"].has(name)) return "–";
  const View unknown = r["unknowns"][name];
  const double value = unknown["value"].number();
  if (!std::isfinite(value)) return "–";
  const NumberText text = number_text(value, unknown["sigma"].number());
  if (unknown["held"].flag() || text.sigma.empty()) return text.value + "° (held)";
  return fmt::format("{}° ± {}°", text.value, text.sigma);
}

double rms_of(const View& r, const char* when) { return r["strips"][when]["rms_m"].number(); }

std::string poor_rotation_html(const View& r) {
  return fmt::format(
      "<p><b>The directions of the beams are poorly known:</b> the rotation common to all beams "
      "has a sigma of {}°, {}° and {}° about the sensor's X, Y and Z, and more than {:.2g}° "
      "together is poor. Flights that help:</p>{}",
      angle_text(datum_of(r, "sigma_x_deg")), angle_text(datum_of(r, "sigma_y_deg")),
      angle_text(datum_of(r, "sigma_z_deg")), degrees_from_radians(calibration::kPoorDatum),
      list_html({"strips that cross, and strips in opposite directions over the same ground",
                 "ground with roofs, embankments or other slopes in several directions",
                 "a better trajectory, above all in heading",
                 "an aircraft that sways a little: damped mounts reveal less"}));
}

Verdict flight_verdict(const View& r) {
  Verdict verdict = verdict_of(r);
  const std::size_t pairs = r["strips"]["pairs"].size();
  verdict.facts =
      r["unknowns"].size() == 0
          ? "Nothing was adjusted."
          : fmt::format(
                "The strips, straight stretches of the flight, lie {} mm apart before and {} mm "
                "after the calibration (root mean square over {} of them and all common ground). "
                "The boresight, the sensor's actual rotation against the mount as "
                "designed, is X {}, Y {}, Z {} about the sensor's axes. Boresight and prisms "
                "together determine the directions of the beams to {}, root mean square over the "
                "field of view.",
                millimetres(rms_of(r, "before")), millimetres(rms_of(r, "after")),
                pairs == 1 ? "one pair" : fmt::format("{} pairs", pairs),
                boresight_text(r, "boresight_x_deg"), boresight_text(r, "boresight_y_deg"),
                boresight_text(r, "boresight_z_deg"),
                fmt::format("{}° ({})", angle_text(datum_of(r, "sigma_total_deg")),
                            total_on_ground(r)));
  verdict.mend = fmt::format(
      "check in the differences between strips below that overlapping strips are from one flight; "
      "check the axes of the mount, and that recording and trajectory use the same time; give "
      "larger sigmas to mount values that are stated too precisely; and hold parameters that this "
      "flight does not determine ({})",
      name_of(kSetting.fix));
  if (!verdict.converged) return verdict;
  const double rotation = radians_from_degrees(datum_of(r, "sigma_rotation_deg"));
  if (!(rotation <= calibration::kPoorDatum)) verdict.care_html = poor_rotation_html(r);
  if (!(rms_of(r, "after") < rms_of(r, "before"))) {
    verdict.care_html +=
        "<p><b>The strips fit no better than before.</b> The given values may be as good as the "
        "adjusted ones.</p>";
  }
  return verdict;
}

std::string flight_subject(const View& r) {
  const std::string names = recording_names(r), serial = r.has("serial") ? r["serial"].text() : "";
  std::string text = fmt::format(
      "{}{}{} strips, {} shots with a range, {} of them used. Sensor {}{} with {} prisms, from the "
      "preset {}",
      names, names.empty() ? "" : ": ", r["strips"]["count"].count(),
      count_text(r["shots"]["on_strips"].count()), count_text(r["shots"]["used"].count()),
      r["preset"].text(), serial.empty() ? "" : " " + serial, shape_of(r).prisms.elements,
      r["preset"].text());
  const std::string mount = r["page"]["mount"]["name"].text();
  if (!mount.empty()) text += fmt::format(", on {}", mount);
  return text + "; by an adjustment of all strips, the mount and the trajectory together.";
}

std::vector<KeyNumber> flight_numbers(const View& r) {
  if (r["unknowns"].size() == 0 || !r["converged"].flag()) return {};
  return {{fmt::format("{} mm", millimetres(rms_of(r, "after"))),
           fmt::format("between strips after the calibration, {} mm before",
                       millimetres(rms_of(r, "before")))},
          {fmt::format("{}°", angle_text(datum_of(r, "sigma_total_deg"))),
           "standard uncertainty of the directions of the beams: " + total_on_ground(r)},
          {fmt::format("{} mm", millimetres(r["range_sigma_m"].number())), "noise of one range"}};
}

std::string to_place(double value, double sigma) {
  return std::isfinite(value) ? text_to_place_of(value, sigma) : "–";
}

std::string unknown_row(const View& r, const std::string& name, const View& unknown, bool prisms) {
  const View page = r["page"];
  const UnknownInfo info = unknown_info(name, shape_of(r));
  const double value = unknown["value"].number(), before = unknown["before"].number();
  const double sigma = info.scale * unknown["sigma"].number();
  const double prior_sigma = unknown["prior_sigma"].number();
  const bool held = unknown["held"].flag();
  const auto in_unit = [&](double number) { return to_place(info.scale * number, sigma); };
  std::string html =
      fmt::format("<tr>{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                  parameter_head(info.long_name, info.symbol, name), in_unit(value),
                  is_sigma(sigma) ? number_text(info.scale * value, sigma).sigma : "–",
                  escape_html(info.unit), in_unit(before), in_unit(value - before));
  if (prisms) {
    html += fmt::format("<td>{}</td>",
                        finite_text("{:.7g}", info.scale * number_of(page["nominal"], name)));
  }
  html += fmt::format(
      "<td>{}</td>", is_sigma(prior_sigma) ? finite_text("{:.3g}", info.scale * prior_sigma) : "–");
  if (held) {
    html += fmt::format("<td class=\"text\" colspan=\"2\">{}</td>",
                        is_sigma(sigma) ? "held, but uncertain" : "held");
  } else {
    const std::string twin = unknown["twin"].text();
    const double correlation = unknown["twin_correlation"].number();
    html +=
        fmt::format("<td>{}</td>", finite_text("{:.0f} %", 100 * unknown["prior_share"].number()));
    html += twin.empty() || !(std::abs(correlation) >= kTied)
                ? "<td class=\"text\">–</td>"
                : fmt::format("<td class=\"text\">{} ({})</td>",
                              symbol_html(unknown_info(twin, shape_of(r)).symbol),
                              finite_text("{:.2f}", correlation));
  }
  if (page.has("true")) {
    const double truth = number_of(page["true"], name), error = value - truth;
    const double ratio = held || !is_sigma(sigma) ? kUnknown : info.scale * error / sigma;
    html += fmt::format("<td>{}</td><td>{}</td><td{}>{}</td>", in_unit(truth), in_unit(error),
                        std::abs(ratio) > kFarOff ? " class=\"far\"" : "",
                        finite_text("{:.2f}", ratio));
  }
  return html + "</tr>\n";
}

std::string unknowns_table(const View& r, bool prisms) {
  std::string rows;
  for (const auto& [name, one] : r["unknowns"].entries()) {
    if (is_of_train(name) == prisms) rows += unknown_row(r, name, one, prisms);
  }
  if (rows.empty()) return "<p>There are none.</p>\n";
  return fmt::format(
      "<div "
      "class=\"wide\"><table><thead><tr><th>unknown</th><th>value</th><th>σ</th><th>unit</"
      "th><th>before</th><th>change</th>{}<th>σ "
      "before</th><th>share of<br>σ before</th><th class=\"text\">most correlated "
      "with</th>{}</tr></thead><tbody>\n{}</tbody></table></div>\n",
      prisms ? "<th>nominal</th>" : "",
      r["page"].has("true") ? "<th>truth</th><th>error</th><th>error / σ</th>" : "", rows);
}

/// [axis of the body, axis of the sensor]
using Axes = std::array<std::array<double, 3>, 3>;

Axes body_from_sensor(const View& r) {
  Axes axes{};
  const std::vector<View> rows = r["page"]["mount"]["body_from_sensor"].list();
  for (std::size_t i = 0; i < 3; ++i) {
    const std::vector<double> row = rows.at(i).numbers();
    for (std::size_t k = 0; k < 3; ++k) axes[i][k] = row.at(k);
  }
  return axes;
}

/// "forward", "to the right" or "down" of the body, or the numbers.
std::string axis_text(const Axes& axes, std::size_t axis) {
  static constexpr std::array<std::pair<const char*, const char*>, 3> kWays = {
      {{"forward", "backward"}, {"to the right", "to the left"}, {"down", "up"}}};
  constexpr double kAlong = 1 - 1e-9;
  for (std::size_t k = 0; k < 3; ++k) {
    if (axes[k][axis] > kAlong) return kWays[k].first;
    if (axes[k][axis] < -kAlong) return kWays[k].second;
  }
  return fmt::format("along ({:.4f}, {:.4f}, {:.4f})", axes[0][axis], axes[1][axis], axes[2][axis]);
}

std::string mount_html(const View& r) {
  std::string html;
  const Axes m = body_from_sensor(r);
  const std::string reference = r["page"]["mount"]["reference_point"].text();
  html += fmt::format(
      "<p>As designed, the sensor's X, its optical axis, points {}, its Y {} and its Z {}. "
      "Reference point of the trajectory: {}.</p>\n",
      axis_text(m, 0), axis_text(m, 1), axis_text(m, 2),
      reference.empty() ? "not named by the mount" : escape_html(reference));
  html += unknowns_table(r, false);
  return html +
         "<p class=\"note\">σ is one standard deviation, all error sources included. Before: the "
         "given values, with their σ. Share of σ before: (σ / σ before)², 100 % where the flight "
         "determines nothing. Most correlated with: the unknown with the largest correlation (in "
         "brackets), if at least ±0.1; near ±1 only the sum or the difference of the two is well "
         "known. Lever arm: from the trajectory's reference point to the sensor, along "
         "the body's axes.</p>\n";
}

std::string prisms_html(const View& r) {
  return unknowns_table(r, true) +
         "<p class=\"note\">Nominal: the preset. A pitch or yaw common to all beams can hardly be "
         "separated from the boresight, so single angles may be known less well than the "
         "directions of the beams.</p>\n";
}

std::string datum_row(const char* name, double height, double total, double rotation, double shape,
                      const std::array<double, 3>& axes) {
  std::string html = fmt::format("<tr><th scope=\"row\">{}</th>", name);
  for (const double value : {total, rotation, shape, axes[0], axes[1], axes[2]}) {
    html += fmt::format("<td>{}</td>", angle_text(value));
  }
  for (const double value : {total, shape}) {
    html += fmt::format("<td>{}</td>", millimetres(offset_at(radians_from_degrees(value), height)));
  }
  return html + "</tr>\n";
}

std::string directions_html(const View& r) {
  const double height = datum_of(r, "height_m");
  std::string html = fmt::format(
      "<div class=\"wide\"><table><thead><tr><th>directions "
      "of the beams, deg</th><th>total</th><th>rotation</th><th>shape</th><th>about X</th>"
      "<th>about Y</th><th>about Z</th><th>total at {0} m,<br>mm</th><th>shape at {0} m,<br>mm</th>"
      "</tr></thead><tbody>\n",
      finite_text("{:.0f}", height));
  html += datum_row(
      "σ after this flight", height, datum_of(r, "sigma_total_deg"),
      datum_of(r, "sigma_rotation_deg"), datum_of(r, "sigma_shape_deg"),
      {datum_of(r, "sigma_x_deg"), datum_of(r, "sigma_y_deg"), datum_of(r, "sigma_z_deg")});
  if (r.has("truth")) {
    const auto row = [&](const char* name, const View& e) {
      const double rotation = e["gauge_deg"].number(), shape = e["shape_deg"].number();
      const View turn = e["rotation_deg"];
      return datum_row(name, height, std::hypot(rotation, shape), rotation, shape,
                       {turn["roll"].number(), turn["pitch"].number(), turn["yaw"].number()});
    };
    html += row("error before, against the truth", r["truth"]["before"]);
    html += row("error after, against the truth", r["truth"]["after"]);
  }
  return html + fmt::format(
                    "</tbody></table></div>\n<p class=\"note\">Boresight and prisms together, root "
                    "mean square over the field of view: the rotation common to all beams, about "
                    "the sensor's axes, and the shape, which no rotation explains. {} m is the "
                    "median range of the flight.</p>\n",
                    finite_text("{:.0f}", height));
}

/// Meaning of an undetermined combination for a flight.
std::string advice_of(const Axes& axes, const std::string& combination) {
  const auto has = [&](std::string_view name) {
    return combination.find(name) != std::string::npos;
  };
  if (has("of the trajectory")) {
    return "Only their sum is known. This does not affect points of this flight; on another flight "
           "the boresight may be off by as much as the trajectory was on this one.";
  }
  if (has("lever_arm") && has("clock_offset")) {
    return "At a single speed, a sensor further ahead and a late clock have the same effect. "
           "Strips at two speeds separate them.";
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
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!has(fmt::format("boresight_{}", "xyz"[axis]))) continue;
    return std::abs(axes[2][axis]) > kUpright
               ? "Flat ground does not show a rotation about the vertical: fly over roofs or "
                 "other slopes."
               : "Strips in opposite or crossing directions determine it.";
  }
  return "";
}

constexpr const char* kNotConverged = "<p>The adjustment did not converge.</p>\n";

std::string not_told_html(const View& r) {
  if (!r["converged"].flag()) return kNotConverged;
  if (r["not_told"].size() == 0) {
    return r["unknowns"].size() == 0
               ? "<p>Nothing was adjusted.</p>\n"
               : "<p>The flight improves on the prior knowledge of every free unknown.</p>\n";
  }
  std::string html =
      "<p>The flight determines these less well than the prior knowledge, so the given values "
      "dominate (numbers are in units of the σ before).</p>\n<ul>";
  for (const View& one : r["not_told"].list()) {
    const std::string combination = one["combination"].text();
    html += fmt::format("<li>{}: {} of the σ before remains. {}</li>",
                        escape_html(words_of_unknowns(combination, shape_of(r))),
                        finite_text("{:.0f} %", 100 * one["sigma_over_before"].number()),
                        escape_html(advice_of(body_from_sensor(r), combination)));
  }
  return html + "</ul>\n";
}

std::string control_html(const View& r) {
  if (r["control"].size() == 0) return {};
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>name</th><th>shots</th>"
      "<th>seen above it, mm</th><th>stated σ, mm</th><th></th></tr></thead><tbody>\n";
  for (const View& seen : r["control"].list()) {
    const bool used = seen["used"].flag();
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        escape_html(seen["name"].text()), count_text(seen["shots"].count()),
        millimetres(seen["off_m"].number()), millimetres(seen["sigma_m"].number()),
        !used ? "left out" : (seen["significant"].flag() ? "contradicts the flight" : ""));
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">Known points and planes on the ground to which "
         "the flight is tied. Heights are along the ground's normal.</p>\n";
}

std::string shift_cell(const View& pair, const char* axis) {
  const double shift = pair["shift_m"][axis].number(), sigma = pair["shift_sigma_m"][axis].number();
  if (!(sigma < kUntoldShift)) return "<td>–</td>";
  const NumberText text = number_text(kMillimetres * shift, kMillimetres * sigma);
  if (text.sigma.empty() || !std::isfinite(shift)) return "<td>–</td>";
  return fmt::format("<td>{} ± {}</td>", text.value, text.sigma);
}

/// @param when  "before" or "after"
std::string pair_cells(const View& pair, const char* when) {
  if (!pair.has(when)) return "<td>–</td><td>–</td><td>–</td><td>–</td><td>–</td><td>–</td>";
  const View own = pair[when];
  std::string html =
      fmt::format("<td>{}</td><td>{}</td><td>{}</td>", count_text(own["cells"].count()),
                  millimetres(own["mean_m"].number()), millimetres(own["rms_m"].number()));
  for (const char* axis : {"east", "north", "up"}) html += shift_cell(own, axis);
  return html;
}

std::string pairs_html(const View& r) {
  std::vector<View> pairs = r["strips"]["pairs"].list();
  const std::size_t all = pairs.size();
  if (all == 0) return "<p>No two strips cover the same ground.</p>\n";
  const auto cells = [](const View& pair) {
    return pair[pair.has("after") ? "after" : "before"]["cells"].count();
  };
  const auto strips = [](const View& pair) {
    return std::pair(pair["first"].count(), pair["second"].count());
  };
  std::stable_sort(pairs.begin(), pairs.end(),
                   [&](const View& a, const View& b) { return cells(a) > cells(b); });
  if (all > kMostPairs) pairs.erase(pairs.begin() + kMostPairs, pairs.end());
  std::sort(pairs.begin(), pairs.end(),
            [&](const View& a, const View& b) { return strips(a) < strips(b); });
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>strips</th><th></th><th>cells</th><th>mean,<br>mm"
      "</th><th>RMS,<br>mm</th><th>shift east,<br>mm</th><th>north,<br>mm</th><th>up,<br>mm</th>"
      "</tr></thead><tbody>\n";
  for (const View& pair : pairs) {
    html += fmt::format(
        "<tr><th scope=\"row\">strip {} minus strip {}</th><td "
        "class=\"text\">before</td>{}</tr>\n<tr><th scope=\"row\"></th><td "
        "class=\"text\">after</td>{}</tr>\n",
        strips(pair).second, strips(pair).first, pair_cells(pair, "before"),
        pair_cells(pair, "after"));
  }
  html += "</tbody></table></div>\n<p class=\"note\">";
  if (pairs.size() < all) {
    html += fmt::format("The {} pairs with the most ground in common, of {}. ", pairs.size(), all);
  }
  return html +
         "Cells: squares of ground that both strips cover. Differences are along the ground's "
         "normals, positive where the first strip named lies above the second; the shift is the "
         "one that explains most of them, with its sigma, and a dash where the ground has no slope "
         "that would determine it. After the calibration no mean or shift should stand out.</p>\n";
}

std::string strips_html(const View& r, Figures& figures) {
  std::string html;
  if (r["page"]["strips"].size() > 0) {
    html +=
        "<div class=\"wide\"><table><thead><tr><th>strip</th><th>begins, s</th><th>takes, s</th>"
        "<th>course, deg</th><th>speed, m/s</th><th>median range, m</th><th>sway, deg</th></tr>"
        "</thead><tbody>\n";
    for (const View& one : r["page"]["strips"].list()) {
      html += fmt::format("<tr><th scope=\"row\">strip {}</th>", one["strip"].count());
      for (const auto& [format, key] :
           {std::pair("{:.1f}", "begin_s"), std::pair("{:.1f}", "duration_s"),
            std::pair("{:.1f}", "course_deg"), std::pair("{:.2f}", "speed_m_per_s"),
            std::pair("{:.1f}", "range_m"), std::pair("{:.2f}", "sway_deg")}) {
        html += fmt::format("<td>{}</td>", finite_text(format, one[key].number()));
      }
      html += "</tr>\n";
    }
    html +=
        "</tbody></table></div>\n<p class=\"note\">Strips are numbered from 1; they begin in "
        "seconds since the first shot, and their course is over ground. Sway: how much roll "
        "and pitch vary together; an aircraft that sways reveals more.</p>\n";
  }
  html += charts_html(r["charts"]["strips"].json(), figures);
  return html;
}

std::string shots_html(const View& r) {
  const View shots = r["shots"];
  const std::uint64_t without_pose = shots["without_pose"].count();
  std::string html = fmt::format(
      "<p>{} of {} shots were used, on {} cells of ground. {} were rejected because they lie "
      "beyond three sigmas of their cell{}; {} cells were too rough. The other shots hit such "
      "cells, or ground that only one strip covers.</p>\n",
      count_text(shots["used"].count()), count_text(shots["on_strips"].count()),
      count_text(r["cells"].count()), count_text(shots["outliers"].count()),
      without_pose == 0 ? ""
                        : fmt::format(", and {} because the trajectory has no pose for them",
                                      count_text(without_pose)),
      count_text(r["rough_cells"].count()));
  html += fmt::format(
      "<p>The residuals scatter {} times as much as the stated noise of the ranges predicts: the "
      "noise of one range is {} mm.</p>\n",
      finite_text("{:.3g}", r["sigma0"].number()), millimetres(r["range_sigma_m"].number()));
  if (r["roughness_m"].number() > 0) {
    html += fmt::format(
        "<p>Of that, {} mm are due to the ground itself, which departs from a plane within each "
        "cell; it is the same for all strips, and the uncertainties account for it.</p>\n",
        millimetres(r["roughness_m"].number()));
  }
  return html;
}

std::string corrections_html(const View& r, Figures& figures) {
  if (!r["converged"].flag()) return kNotConverged;
  const View late = r["attitude_delay_s"];
  const NumberText delay = number_text(1e3 * late["value"].number(), 1e3 * late["sigma"].number());
  return fmt::format(
             "<p>Position and attitude are corrected at {} knots, points in time {} s apart, and "
             "linearly between. σ is their remaining uncertainty. Corrections should be about as "
             "large as the trajectory's stated errors; where they jump or are larger, a warning "
             "appears and the uncertainties account for it.</p>\n"
             "<p>According to the strips, attitudes are {} ± {} ms later than positions.</p>\n",
             count_text(r["knots"].count()),
             finite_text("{:.3g}", r["page"]["knot_spacing_s"].number()), delay.value,
             delay.sigma) +
         charts_html(r["charts"]["corrections"].json(), figures);
}

}  // namespace

std::string flight_page(const View& r) {
  Figures figures;
  const auto drawn = [&](const char* name) -> const Json& { return r["charts"][name].json(); };
  const std::string head = verdict_html(flight_verdict(r)) +
                           overview_html(flight_numbers(r), drawn("differences"), figures);
  Sections sections;
  sections.add("How well the beams are known", directions_html(r), Sections::Shown::unfolded);
  sections.add("Mount, ranges and clock", mount_html(r), Sections::Shown::unfolded);
  sections.add("What this flight does not determine", not_told_html(r));
  sections.add("Known ground", control_html(r));
  sections.add("Strips before and after",
               pairs_html(r) + charts_html(drawn("differences"), figures, 1));
  sections.add("The flight", strips_html(r, figures));
  sections.add("Ground", shots_html(r) + charts_html(drawn("ground"), figures));
  sections.add("Residuals", drawn("residuals").empty() ? "<p>There are none to draw.</p>\n"
                                                       : charts_html(drawn("residuals"), figures));
  sections.add("Corrections of the trajectory", corrections_html(r, figures));
  sections.add("Prisms", prisms_html(r));
  add_end(sections, r);
  return page_html("risley calibrate, in flight" + title_of(r), flight_subject(r), head, sections,
                   figures);
}

}  // namespace risley::report
