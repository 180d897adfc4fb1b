// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/calibration_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "risley/calibration/surface_steps.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/report/number_text.hpp"

#include "report/charts.hpp"
#include "report/html.hpp"
#include "report/page_parts.hpp"

namespace risley::report {
namespace {

using calibration::CalibratedPlane;
using calibration::Calibration;
using calibration::DatumKind;
using calibration::DirectionErrors;
using calibration::FormalDatum;
using calibration::PriorTest;
using calibration::SamplePoint;
using calibration::SurfaceStep;
using calibration::ThicknessProfile;

constexpr double kMillimetres = 1000.0;
constexpr std::size_t kMostPoints = 3000;       // per scatter diagram
constexpr std::size_t kMostViewPoints = 8000;   // of all recordings in one kind of view
constexpr std::size_t kFewestViewPoints = 800;  // of one recording in it
constexpr int kFewestInCell = 5;    // points that make a mean over a cell of the field of view
constexpr int kDotsAcrossCell = 3;  // that fill a cell in a diagram
constexpr std::array<const char*, 5> kPlaneColours = {"a", "b", "c", "d", "bad"};
constexpr const char* kClutterColour = "ink";

std::string millimetres(double metres) { return finite_text("{:.1f}", kMillimetres * metres); }
std::string degrees(double radians) { return finite_text("{:.3g}", degrees_from_radians(radians)); }

bool is_sigma(double sigma) { return std::isfinite(sigma) && sigma > 0; }

/// A sigma that was never computed is zero.
std::string sigma_degrees(double sigma) { return is_sigma(sigma) ? degrees(sigma) : "–"; }

std::string recording_name(const CalibrationPageInput& input, std::size_t recording) {
  if (recording < input.recordings.size()) return input.recordings[recording];
  return fmt::format("recording {}", recording + 1);
}

std::size_t recording_count(const CalibrationPageInput& input) {
  std::size_t count = input.recordings.size();
  for (const SamplePoint& point : input.calibration.sample) {
    count = std::max(count, point.recording + 1);
  }
  return count;
}

std::string plane_name(const Calibration& c, std::size_t plane) {
  return plane < c.planes.size() ? c.planes[plane].name : fmt::format("plane {}", plane + 1);
}

/// Pitch and yaw together: what moves where the sensor looks.
double boresight_sigma(const FormalDatum& datum) {
  return std::hypot(datum.sigma_pitch, datum.sigma_yaw);
}

bool has_poor_datum(const Calibration& c) {
  return !(boresight_sigma(c.datum) <= calibration::kPoorDatum);
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
  return "no outside reference fixes the sensor's frame, only the shape of its bundle of beams";
}

std::string boresight_advice_html(const Calibration& c) {
  return fmt::format(
      "<p><b>Absolute boresight must not be trusted from these walls:</b> pitch and yaw, which all "
      "beams share, have a formal sigma of {}° together, and more than {:.2g}° is poor. The shape "
      "of the bundle, and with it the flatness of point clouds, does not suffer. Set-ups that "
      "help:</p>{}",
      sigma_degrees(boresight_sigma(c.datum)), degrees_from_radians(calibration::kPoorDatum),
      list_html(
          {"a wall that is steeply tilted against the axis of view, 50 to 65 degrees, and "
           "fills the whole field of view",
           "a longer range to the walls",
           "the body flipped by 180 degrees against a stop between two recordings, given with "
           "--stations",
           "walls whose normals are known in the sensor's frame, given with --planes"}));
}

Verdict verdict_of(const CalibrationPageInput& input) {
  const Calibration& c = input.calibration;
  Verdict verdict;
  verdict.converged = c.converged;
  verdict.reason = c.reason;
  verdict.warnings = c.warnings;
  verdict.warnings.insert(verdict.warnings.end(), input.warnings.begin(), input.warnings.end());
  verdict.facts =
      c.planes.empty()
          ? "No wall was used."
          : fmt::format(
                "The walls are {} mm thick before and {} mm after the calibration (root mean "
                "square distance "
                "of {} points from {} planes); {}; formal sigma of roll {}°, pitch {}° and yaw "
                "{}°.",
                millimetres(c.rms_before), millimetres(c.rms_after), c.points, c.planes.size(),
                datum_text(c.datum_kind), sigma_degrees(c.datum.sigma_roll),
                sigma_degrees(c.datum.sigma_pitch), sigma_degrees(c.datum.sigma_yaw));
  verdict.healthy = "Healthy: the walls are flat in this calibration.";
  verdict.mend_html =
      "look at the views below whether what was taken for walls are walls; record walls that fill "
      "the field of view, more of them, from nearer and farther and steeply tilted; hold "
      "parameters that these walls do not tell (<code>--fix</code>); and check known normals and "
      "stations, if any were given.";
  verdict.use_html =
      "nothing. Any command takes <code>calibration.yaml</code> with <code>--sensor</code>.";
  if (c.converged && has_poor_datum(c)) verdict.care_html = boresight_advice_html(c);
  return verdict;
}

std::string subject_text(const CalibrationPageInput& input) {
  const Calibration& c = input.calibration;
  std::string text;
  for (const std::string& name : input.recordings) text += (text.empty() ? "" : ", ") + name;
  text += fmt::format(
      "{}{} observations, {} of them used. Sensor {}{} with {} prisms, from the preset {}",
      text.empty() ? "" : ": ", input.observations, c.points, c.sensor.name,
      c.sensor.serial.empty() ? "" : " " + c.sensor.serial, c.sensor.prisms(), input.nominal.name);
  text += c.method == calibration::CalibrationMethod::paper
              ? "; by the paper's unweighted distances from planes"
              : "; by an adjustment of all recordings together";
  return text + ".";
}

/// Value at a row of a vector that may be too short, as it is when nothing was adjusted.
double at(const Eigen::VectorXd& values, std::size_t row) {
  const auto i = static_cast<Eigen::Index>(row);
  return i < values.size() ? values[i] : std::numeric_limits<double>::quiet_NaN();
}

/// Sigma of a row of the covariance; zero where there is none.
double sigma_at(const Eigen::MatrixXd& covariance, std::size_t row) {
  const auto i = static_cast<Eigen::Index>(row);
  if (i >= covariance.rows() || !(covariance(i, i) > 0)) return 0;
  return std::sqrt(covariance(i, i));
}

std::string to_place_of(double value, double sigma) {
  return std::isfinite(value) ? text_to_place_of(value, sigma) : "–";
}

std::string parameter_row(const CalibrationPageInput& input, std::size_t row) {
  const Calibration& c = input.calibration;
  const ParameterInfo& info = find_parameter(c.free[row].name, c.sensor.prisms());
  const double scale = 1.0 / info.si_per_unit;
  const double value = scale * at(c.parameters, row), sigma = scale * sigma_at(c.covariance, row);
  const double believed = scale * c.believed.get(info.name);
  std::string html =
      fmt::format("<tr>{}<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                  parameter_head(info), to_place_of(value, sigma),
                  is_sigma(sigma) ? number_text(value, sigma).sigma : "–", escape_html(info.unit),
                  finite_text("{:.7g}", scale * input.nominal.get(info.name)),
                  finite_text("{:.7g}", believed), to_place_of(value - believed, sigma));
  if (input.truth && input.truth->sensor) {
    const double truth = scale * input.truth->sensor->get(info.name);
    const double ratio =
        is_sigma(sigma) ? (value - truth) / sigma : std::numeric_limits<double>::quiet_NaN();
    html += fmt::format("<td>{}</td><td>{}</td><td{}>{}</td>", to_place_of(truth, sigma),
                        to_place_of(value - truth, sigma),
                        std::abs(ratio) > kFarOff ? " class=\"far\"" : "",
                        finite_text("{:.2f}", ratio));
  }
  return html + "</tr>\n";
}

std::string parameters_html(const CalibrationPageInput& input) {
  const Calibration& c = input.calibration;
  const bool truth = input.truth && input.truth->sensor;
  std::string html =
      "<h2>Parameters</h2>\n<div class=\"wide\"><table><thead><tr><th>parameter</th><th>value</th>"
      "<th>σ</th><th>unit</th><th>nominal</th><th>believed</th><th>difference</th>";
  if (truth) html += "<th>truth</th><th>error</th><th>error / σ</th>";
  html += "</tr></thead><tbody>\n";
  for (std::size_t row = 0; row < c.free.size(); ++row) html += parameter_row(input, row);
  if (c.range_offset_sigma > 0) {
    const double value = kMillimetres * c.range_offset;
    const double sigma = kMillimetres * c.range_offset_sigma;
    const std::string shown = to_place_of(value, sigma);
    html += fmt::format(
        "<tr><th scope=\"row\">range offset, which the sensor adds to every "
        "range</th><td>{}</td><td>{}</td><td>mm</td><td>0</td><td>0</td><td>{}</td>{}</"
        "tr>\n",
        shown, is_sigma(sigma) ? number_text(value, sigma).sigma : "–", shown,
        truth ? "<td></td><td></td><td></td>" : "");
  }
  return html +
         "</tbody></table></div>\n<p class=\"note\">σ is one standard deviation, everything "
         "included. Nominal: the preset. Believed: what the sensor computed its directions with "
         "when it recorded. Difference: value minus believed.</p>\n";
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

std::string prior_tests_html(const std::vector<PriorTest>& tests) {
  if (tests.empty()) return "";
  std::string html =
      "<h3>What was known before, against the data</h3>\n<div class=\"wide\"><table><thead><tr>"
      "<th>known</th><th>kind</th><th>misfit, deg</th><th>χ²</th><th>degrees of freedom</th>"
      "<th>critical χ²</th><th>verdict</th></tr></thead><tbody>\n";
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
         "</tbody></table></div>\n<p class=\"note\">Misfit: the rotation between what was said and "
         "what the adjustment found. A sound station or normal exceeds the critical value once in "
         "10,000. Not tested: the data have nothing to say of it.</p>\n";
}

std::string unobservable_html(const Calibration& c) {
  if (c.unobservable.empty()) return "";
  std::vector<std::string> items;
  for (const estimation::WeakDirection& weak : c.unobservable) {
    items.push_back(fmt::format("{}: its sigma stays {}", direction_text(weak),
                                finite_text("{:.2g}", weak.sigma)));
  }
  return "<h3>What stays unobservable</h3>\n<p>The walls do not tell these combinations of "
         "parameters (in units of 1 degree, or 0.01 of an index).</p>\n" +
         list_html(items) + "\n";
}

std::string datum_html(const CalibrationPageInput& input) {
  const Calibration& c = input.calibration;
  std::string html = fmt::format(
      "<h2>Datum</h2>\n<p>In this calibration {}.</p>\n"
      "<div class=\"wide\"><table><thead><tr><th>formal sigma of the beams, deg</th><th>shape</th>"
      "<th>gauge</th><th>total</th><th>roll</th><th>pitch</th><th>yaw</th></tr></thead><tbody>\n",
      datum_text(c.datum_kind));
  html += formal_datum_row("everything included", c.datum);
  html +=
      formal_datum_row("without the common errors of the rotation angles", c.datum_without_common);
  html +=
      "</tbody></table></div>\n<p class=\"note\">Shape: what bends the bundle of beams; walls see "
      "it. Gauge: the rotation that all beams share, roll, pitch and yaw about X, Y and Z; only "
      "something from outside, or the bundle's shape, tells it. Both are root mean squares over "
      "the beams.</p>\n";
  if (input.truth) {
    html +=
        "<h3>Against the truth</h3>\n<div class=\"wide\"><table><thead><tr>"
        "<th>error of the beams, deg</th><th>shape</th><th>gauge</th><th>total</th><th>roll</th>"
        "<th>pitch</th><th>yaw</th><th>azimuth<br>RMSE</th><th>zenith<br>RMSE</th>"
        "<th>azimuth<br>bias</th><th>zenith<br>bias</th></tr></thead><tbody>\n";
    html += direction_errors_row("before", input.truth->before);
    html += direction_errors_row("after", input.truth->after);
    html +=
        "</tbody></table></div>\n<p class=\"note\">RMSE: root mean square error. Bias: mean error. "
        "Roll, pitch and yaw: the shared rotation that explains most of the errors.</p>\n";
  }
  return html + unobservable_html(c) + prior_tests_html(c.prior_tests);
}

std::string planes_html(const CalibrationPageInput& input) {
  const Calibration& c = input.calibration;
  if (c.planes.empty()) return "<h2>Walls</h2>\n<p>There are none.</p>\n";
  std::string html =
      "<h2>Walls</h2>\n<div class=\"wide\"><table><thead><tr><th>plane</th><th>recording</th>"
      "<th>normal azimuth,<br>deg</th><th>zenith,<br>deg</th><th>distance,<br>m</th><th>points</th>"
      "<th>outliers</th><th>RMS before,<br>mm</th><th>after,<br>mm</th><th>range σ,<br>mm</th></tr>"
      "</thead><tbody>\n";
  for (const CalibratedPlane& plane : c.planes) {
    const SphericalAngles<double> normal = angles_from_direction(plane.normal);
    html += fmt::format(
        "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
        "<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
        escape_html(plane.name), escape_html(recording_name(input, plane.recording)),
        finite_text("{:.2f}", degrees_from_radians(normal.azimuth)),
        finite_text("{:.2f}", degrees_from_radians(normal.zenith)),
        finite_text("{:.3f}", plane.distance), plane.points, plane.outliers,
        millimetres(plane.rms_before), millimetres(plane.rms), millimetres(plane.range_sigma));
  }
  html +=
      "</tbody></table></div>\n<p class=\"note\">Normals and distances are seen from the sensor "
      "(X forward, Y left, Z up). RMS: root mean square distance of the points from the plane, "
      "before with the believed parameters and a plane fitted to them. Outliers: shots near the "
      "plane that were not used. Range σ: noise of one range that the residuals show.</p>\n";
  html += fmt::format(
      "<p>Residuals scatter {} times as much as the stated range noise promises. Means over cells "
      "of one degree have {} times the variance that noise gives them; 1 is a flat wall.{}</p>\n",
      finite_text("{:.3g}", c.sigma0), finite_text("{:.3g}", c.unevenness),
      c.variance_factor == 1
          ? ""
          : fmt::format(" For uneven walls every variance on this page was multiplied by {}.",
                        finite_text("{:.3g}", c.variance_factor)));
  return html;
}

std::string steps_html(const CalibrationPageInput& input) {
  const Calibration& c = input.calibration;
  if (c.planes.empty()) return "";
  if (c.steps.empty()) return "<p>No step stands off a wall.</p>\n";
  std::vector<std::string> items;
  for (const SurfaceStep& step : c.steps) {
    items.push_back(fmt::format(
        "{} in {}: {} mm {} the sensor, about {}° wide, around azimuth {}° and zenith {}°, {} "
        "points",
        plane_name(c, step.plane), recording_name(input, step.recording),
        millimetres(std::abs(step.height)), step.height < 0 ? "towards" : "away from",
        finite_text("{:.1f}", degrees_from_radians(step.size)),
        finite_text("{:.1f}", degrees_from_radians(step.azimuth)),
        finite_text("{:.1f}", degrees_from_radians(step.zenith)), step.points));
  }
  return "<h3>Steps on the walls</h3>\n<p>These regions stand off their wall, as a door frame or a "
         "picture does; their shots were left out.</p>\n" +
         list_html(items) + "\n";
}

/// Value of a sample point in the unit of an axis.
using PointValue = std::function<double(const SamplePoint&)>;

double azimuth_degrees(const SamplePoint& p) { return degrees_from_radians(p.azimuth); }
double zenith_degrees(const SamplePoint& p) { return degrees_from_radians(p.zenith); }
double before_millimetres(const SamplePoint& p) { return kMillimetres * p.before; }
double after_millimetres(const SamplePoint& p) { return kMillimetres * p.after; }

/// All diagrams of the page.
class CalibrationCharts {
 public:
  explicit CalibrationCharts(const CalibrationPageInput& input)
      : input_(input), c_(input.calibration) {
    for (const SamplePoint& point : c_.sample) {
      if (point.plane >= 0) on_walls_.push_back(&point);
    }
  }

  const Figures& figures() const { return figures_; }

  std::string thickness() {
    std::string html;
    for (const ThicknessProfile& profile : c_.profiles) html += thickness_over(profile);
    if (!on_walls_.empty()) {
      html += distances();
      html += distances_over_azimuth();
      html += signs();
    }
    if (html.empty()) return "<p>There are no points to draw.</p>\n";
    return "<div class=\"charts\">\n" + html + "</div>\n";
  }

  std::string views() {
    if (c_.sample.empty()) return "<p>There are no points to draw.</p>\n";
    std::string html = "<div class=\"charts\">\n";
    const std::size_t recordings = recording_count(input_);
    for (std::size_t i = 0; i < recordings; ++i) {
      const View view(c_, i, recordings);
      if (view.empty()) continue;
      const std::string name = recording_name(input_, i);
      html += figures_.add(view.chart("Field of view: " + name, "azimuth, deg", azimuth_degrees,
                                      "zenith, deg", zenith_degrees));
      html += figures_.add(view.chart_with_sensor(
          "From above: " + name, "X (forward), m", [](const SamplePoint& p) { return p.point.x; },
          "Y (left), m", [](const SamplePoint& p) { return p.point.y; },
          "Forward is to the left, the sensor's left is below."));
      html += figures_.add(view.chart_with_sensor(
          "From the side: " + name, "X (forward), m",
          [](const SamplePoint& p) { return p.point.x; }, "below the sensor (−Z), m",
          [](const SamplePoint& p) { return -p.point.z; }, "Forward is to the left, up is up."));
    }
    return html + "</div>\n";
  }

 private:
  /// The sample points of one recording, thinned and split by plane.
  class View {
   public:
    View(const Calibration& c, std::size_t recording, std::size_t recordings) {
      std::vector<const SamplePoint*> points;
      for (const SamplePoint& point : c.sample) {
        if (point.recording == recording) points.push_back(&point);
      }
      const std::size_t most = std::max(kMostViewPoints / recordings, kFewestViewPoints);
      std::map<int, std::vector<const SamplePoint*>> by_plane;
      for (const std::size_t i : every_nth(points.size(), most)) {
        by_plane[std::max(points[i]->plane, -1)].push_back(points[i]);
      }
      const auto clutter = by_plane.find(-1);
      std::size_t colour = 0;
      for (const auto& [plane, members] : by_plane) {
        if (plane < 0) continue;
        groups_.push_back({plane_name(c, static_cast<std::size_t>(plane)),
                           kPlaneColours[colour++ % kPlaneColours.size()], members});
      }
      if (clutter != by_plane.end())
        groups_.push_back({"no plane", kClutterColour, clutter->second});
      note_ = every_nth_note(points.size(), most, "sample points");
      if (colour > kPlaneColours.size()) {
        note_ += fmt::format(" Colours repeat after {} planes.", kPlaneColours.size());
      }
    }

    bool empty() const { return groups_.empty(); }

    Chart chart(std::string title, std::string x_label, const PointValue& x, std::string y_label,
                const PointValue& y) const {
      Chart chart{std::move(title), std::move(x_label), std::move(y_label), {}, note_,
                  ChartKind::map};
      for (const Group& group : groups_) {
        Series series{group.name, group.colour, SeriesKind::points, {}, {}};
        for (const SamplePoint* point : group.points) {
          const double px = x(*point), py = y(*point);
          if (!std::isfinite(px + py)) continue;
          series.x.push_back(px);
          series.y.push_back(py);
        }
        chart.series.push_back(std::move(series));
      }
      return chart;
    }

    Chart chart_with_sensor(std::string title, std::string x_label, const PointValue& x,
                            std::string y_label, const PointValue& y,
                            const std::string& orientation) const {
      Chart result = chart(std::move(title), std::move(x_label), x, std::move(y_label), y);
      result.series.push_back({"sensor", "ink", SeriesKind::points, {0.0}, {0.0}});
      result.note += " " + orientation;
      return result;
    }

   private:
    struct Group {
      std::string name, colour;
      std::vector<const SamplePoint*> points;
    };
    std::vector<Group> groups_;
    std::string note_;
  };

  static std::string variable_text(const std::string& variable) {
    constexpr std::string_view kRotationAngle = "rotation_angle_";
    if (variable == "incidence") return "angle of incidence";
    if (variable.starts_with(kRotationAngle)) {
      return "rotation angle of prism " + variable.substr(kRotationAngle.size());
    }
    std::string text = variable;
    std::replace(text.begin(), text.end(), '_', ' ');
    return text;
  }

  std::string thickness_over(const ThicknessProfile& profile) {
    const bool turn = profile.variable.starts_with("rotation_angle");
    // Middle of every bin, in the order of the axis.
    std::vector<std::pair<double, std::size_t>> bins;
    for (std::size_t i = 0; i < profile.count.size(); ++i) {
      const double middle = 0.5 * (profile.from[i] + profile.to[i]);
      if (!std::isfinite(middle)) continue;
      bins.emplace_back(degrees_from_radians(turn ? wrap_to_two_pi(middle) : middle), i);
    }
    std::sort(bins.begin(), bins.end());
    std::size_t fewest = 0, most = 0;
    for (const std::size_t count : profile.count) {
      if (count == 0) continue;
      fewest = fewest == 0 ? count : std::min(fewest, count);
      most = std::max(most, count);
    }
    const auto line = [&](const char* label, const char* colour,
                          const std::vector<double>& values) {
      Series series{label, colour, SeriesKind::line, {}, {}};
      for (const auto& [x, i] : bins) {
        series.x.push_back(x);
        series.y.push_back(kMillimetres * values[i]);
      }
      return series;
    };
    const std::string what = variable_text(profile.variable);
    return figures_.add(
        {"Thickness over the " + what,
         what + ", deg",
         "distance from the plane, mm",
         {line("RMS after", "a", profile.rms_after), line("RMS before", "b", profile.rms_before),
          line("mean after", "c", profile.mean_after),
          line("mean before", "d", profile.mean_before)},
         fmt::format("All points in {} bins, which hold {} to {} points; empty bins "
                     "leave a gap. A calibrated sensor has means near 0.",
                     bins.size(), fewest, most),
         turn ? ChartKind::full_turn : ChartKind::plain});
  }

  std::string sample_note() const {
    return fmt::format("Of the {} used points the {} that stand in an evenly spread sample. ",
                       c_.points, on_walls_.size());
  }

  std::string distances() {
    std::vector<double> before, after;
    for (const SamplePoint* point : on_walls_) {
      before.push_back(point->before);
      after.push_back(point->after);
    }
    // Both share their bins, or their heights could not be compared.
    const estimation::Moments moments_before = estimation::moments(before);
    const estimation::Moments moments_after = estimation::moments(after);
    estimation::Moments both;
    both.std = std::fmax(moments_before.rms, moments_after.rms);
    Chart chart{"Histogram of the distances from the planes",
                "distance from the plane, mm",
                "points",
                {histogram("after", "a", after, {}, both, kMillimetres).front(),
                 histogram("before", "b", before, {}, both, kMillimetres).front()},
                sample_note() + fmt::format("Root mean square {} mm before, {} mm after. The "
                                            "outermost bins hold everything beyond.",
                                            millimetres(moments_before.rms),
                                            millimetres(moments_after.rms))};
    return figures_.add(chart);
  }

  std::string distances_over_azimuth() {
    Series before{"before", "b", SeriesKind::points, {}, {}};
    Series after{"after", "a", SeriesKind::points, {}, {}};
    for (const std::size_t i : every_nth(on_walls_.size(), kMostPoints)) {
      const SamplePoint& point = *on_walls_[i];
      const auto add = [&point](Series& series, double distance) {
        if (!std::isfinite(distance + point.azimuth)) return;
        series.x.push_back(azimuth_degrees(point));
        series.y.push_back(distance);
      };
      add(before, before_millimetres(point));
      add(after, after_millimetres(point));
    }
    return figures_.add({"Distances from the planes over the azimuth",
                         "azimuth, deg",
                         "distance from the plane, mm",
                         {after, before},
                         every_nth_note(on_walls_.size(), kMostPoints, "sample points on planes")});
  }

  /// Where in the field of view points lie beyond their planes, and where before them.
  std::string signs() {
    struct Cell {
      int count = 0;
      double sum = 0;
    };
    std::map<std::pair<long, long>, Cell> cells;
    double squares = 0;
    std::size_t points = 0;
    for (const SamplePoint* point : on_walls_) {
      if (!std::isfinite(point->after + point->azimuth + point->zenith)) continue;
      Cell& cell = cells[{std::lround(std::floor(point->azimuth / calibration::kSurfaceCell)),
                          std::lround(std::floor(point->zenith / calibration::kSurfaceCell))}];
      ++cell.count;
      cell.sum += point->after;
      squares += point->after * point->after;
      ++points;
    }
    Series beyond{"beyond the plane", "a", SeriesKind::points, {}, {}};
    Series before{"before the plane", "bad", SeriesKind::points, {}, {}};
    double mean_squares = 0, noise_squares = 0;
    std::size_t means = 0;
    for (const auto& [place, cell] : cells) {
      if (cell.count < kFewestInCell) continue;
      const double mean = cell.sum / cell.count;
      add_cell(mean > 0 ? beyond : before, static_cast<double>(place.first),
               static_cast<double>(place.second));
      mean_squares += mean * mean;
      noise_squares += squares / static_cast<double>(points) / cell.count;
      ++means;
    }
    if (means == 0) return "";
    const std::string note = fmt::format(
        "Means of {} sample points over cells of one degree; cells with fewer than {} points are "
        "left out, the others are squares of dots. The {} means have a root mean square of {} mm, "
        "where noise alone would leave about {} mm. Patches of one colour are walls that are not "
        "flat, or beams that are still bent.",
        points, kFewestInCell, means,
        finite_text("{:.2f}", kMillimetres * std::sqrt(mean_squares / static_cast<double>(means))),
        finite_text("{:.2f}",
                    kMillimetres * std::sqrt(noise_squares / static_cast<double>(means))));
    return figures_.add({"Sign of what is left, all recordings together",
                         "azimuth, deg",
                         "zenith, deg",
                         {beyond, before},
                         note,
                         ChartKind::map});
  }

  /// A cell as dots that fill it: the size of a dot is not ours to choose.
  static void add_cell(Series& series, double column, double row) {
    const double width = degrees_from_radians(calibration::kSurfaceCell);
    for (int i = 0; i < kDotsAcrossCell; ++i) {
      for (int j = 0; j < kDotsAcrossCell; ++j) {
        series.x.push_back(width * (column + (i + 0.5) / kDotsAcrossCell));
        series.y.push_back(width * (row + (j + 0.5) / kDotsAcrossCell));
      }
    }
  }

  const CalibrationPageInput& input_;
  const Calibration& c_;
  std::vector<const SamplePoint*> on_walls_;
  Figures figures_;
};

}  // namespace

std::string calibration_page(const CalibrationPageInput& input) {
  const Calibration& c = input.calibration;
  CalibrationCharts charts(input);
  std::string body = verdict_html(verdict_of(input));
  body += parameters_html(input);
  body += datum_html(input);
  body += planes_html(input) + steps_html(input);
  body += "<h2>Thickness of the walls</h2>\n" + charts.thickness();
  body += "<h2>What was taken for a wall</h2>\n" + charts.views();
  body += correlation_html(c.free, c.covariance, c.sensor.prisms());
  body += provenance_html(input.provenance);
  std::string title = "risley calibrate";
  if (!input.recordings.empty()) title += ": " + input.recordings.front();
  if (input.recordings.size() > 1)
    title += fmt::format(" and {} more", input.recordings.size() - 1);
  return page_html(title, subject_text(input), body, charts.figures());
}

}  // namespace risley::report
