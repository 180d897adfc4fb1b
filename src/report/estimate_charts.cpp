// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/report/chart.hpp"
#include "risley/report/html.hpp"

#include "report/pages.hpp"

namespace risley::report {
namespace {

using estimation::Estimate;
using estimation::Moments;
using estimation::RotorStates;
using jobs::EstimatedRecording;
using json::Json;

constexpr std::size_t kMostShotPoints = 4000;  // per scatter diagram
constexpr std::size_t kMostMapPoints = 9000;   // of the scan pattern
constexpr double kPatternDuration = 0.09;      // s, as in [B21 Fig. 2a]

/// Of a rotor in titles.
char capital(std::size_t rotor) { return prism_capital(static_cast<int>(rotor)); }
/// Colour of a rotor in diagrams.
std::string colour_of(std::size_t rotor) {
  return std::string(1, prism_letter(static_cast<int>(rotor)));
}

/// The starting values of an estimation by name, in the estimate's speed combination and the units
/// of files; none for angles.
Json nominal_json(const EstimatedRecording& found) {
  const Estimate& e = found.estimate;
  Json values = Json::object();
  for (const estimation::EstimatedValue& value : e.values) {
    const ParameterInfo& info = find_parameter(value.name, e.sensor.shape());
    if (info.kind == ParameterKind::rotation_angle) continue;
    const auto& combination = e.sensor.combination;
    const bool turned =
        info.kind == ParameterKind::angular_velocity && combination && found.nominal.combination;
    values[info.name] =
        (turned ? with_combination(found.nominal, *combination) : found.nominal).get(info.name) /
        info.si_per_unit;
  }
  return values;
}

/// Makes all diagrams.
class EstimateCharts {
 public:
  explicit EstimateCharts(const EstimatedRecording& input)
      : input_(input), states_(input.estimate.states) {}

  /// Every parameter from pieces of the recording alone, about the estimate of all.
  std::vector<Chart> pieces() const {
    if (!input_.details->pieces) return {};
    const estimation::PiecewiseEstimate& pieces = *input_.details->pieces;
    const Estimate& e = input_.estimate;
    std::vector<Chart> charts;
    for (std::size_t k = 0; k < e.free.size() && pieces.size() > 0; ++k) {
      const ParameterInfo& info = find_parameter(e.free[k].name, e.sensor.shape());
      const double scale = 1.0 / info.si_per_unit;
      const double all = e.parameters[static_cast<Eigen::Index>(k)];
      Series points{"pieces", "a", SeriesKind::points, {}, {}};
      Series whiskers{"± σ of a piece", "a", SeriesKind::line, {}, {}};
      for (std::size_t i = 0; i < pieces.size(); ++i) {
        const double y = scale * (pieces.value[k][i] - all), sigma = scale * pieces.sigma[k][i];
        points.x.push_back(pieces.time[i]);
        points.y.push_back(y);
        for (const double end : {y - sigma, y + sigma, kUnknown}) {
          whiskers.x.push_back(pieces.time[i]);
          whiskers.y.push_back(end);
        }
      }
      Chart chart{info.long_name,
                  "time, s",
                  fmt::format("difference from the estimate, {}", info.unit),
                  {whiskers, points, level("all shots", "ink", 0.0)},
                  {}};
      for (const estimation::TruthComparison& one : truths()) {
        if (one.name == info.name && std::isfinite(one.truth)) {
          chart.series.push_back(level("truth", "c", scale * (one.truth - all)));
        }
      }
      charts.push_back(chart);
    }
    return charts;
  }

  std::vector<Chart> rotors() const {
    std::vector<Chart> charts;
    std::vector<Chart> distributions;
    for (std::size_t rotor = 0; rotor < states_.angular_velocity.size(); ++rotor) {
      const jobs::RotorSpeed& speed = input_.details->speeds[rotor];
      const std::string label =
          fmt::format("angular velocity minus {:.5f}, deg/s", degrees_from_radians(speed.mean));
      charts.push_back({fmt::format("Angular velocity of prism {}", capital(rotor)),
                        "time, s",
                        label,
                        {line(rotor, speed.change)},
                        peak_line_note(states_.size(), "knots")});
      if (!(speed.moments.std > 0)) continue;  // it stood still
      distributions.push_back(distribution(
          fmt::format("Distribution of the angular velocity of prism {}", capital(rotor)), label,
          colour_of(rotor), speed.change, speed.moments, "velocity"));
    }
    charts.insert(charts.end(), distributions.begin(), distributions.end());
    if (!input_.evaluation) return charts;
    const auto& errors = input_.evaluation->rotation_angle_error;
    for (std::size_t rotor = 0; rotor < errors.size(); ++rotor) {
      charts.push_back({fmt::format("Error of the rotation angle of prism {}", capital(rotor)),
                        "time, s",
                        "estimate minus truth, deg",
                        {line(rotor, errors[rotor])},
                        peak_line_note(states_.size(), "knots")});
    }
    for (std::size_t rotor = 0; rotor < errors.size(); ++rotor) {
      charts.push_back(
          distribution(fmt::format("Distribution of the error of the rotation angle of prism {}",
                                   capital(rotor)),
                       "estimate minus truth, deg", colour_of(rotor), errors[rotor],
                       input_.details->rotation_angle_errors[rotor], "error"));
    }
    return charts;
  }

  std::vector<Chart> residuals() const {
    const estimation::ShotResiduals all = estimation::residuals_of_shots(input_.estimate);
    const Estimate& e = input_.estimate;
    std::vector<Chart> charts{
        over_time("Azimuth residuals over time", all.azimuth, "a"),
        over_time("Zenith residuals over time", all.zenith, "b"),
        residual_histogram("Histogram of the azimuth residuals", all.azimuth, e.azimuth_moments,
                           "a"),
        residual_histogram("Histogram of the zenith residuals", all.zenith, e.zenith_moments, "b")};
    for (Chart& chart : maps(input_.details->residuals_over_field, "the field of view", {}, {})) {
      charts.push_back(view_of_directions(std::move(chart), all_around()));
    }
    for (std::size_t rotor = 0; rotor < states_.rotation_angle.size(); ++rotor) {
      charts.push_back(over_angle(rotor));
    }
    for (const jobs::PrismPairResiduals& pair : input_.details->residuals_over_angles) {
      const auto axis = [](int prism) {
        return fmt::format("rotation angle of prism {}, deg", prism_capital(prism));
      };
      for (Chart& chart :
           maps(pair.residuals,
                fmt::format("the angles of prisms {} and {}", prism_capital(pair.prism_x),
                            prism_capital(pair.prism_y)),
                axis(pair.prism_x), axis(pair.prism_y))) {
        chart.kind = ChartKind::two_turns;
        charts.push_back(std::move(chart));
      }
    }
    return charts;
  }

  std::vector<Chart> pattern() const {
    const estimation::AngleSeries& head = input_.head;
    const std::size_t rows = rows_until(kPatternDuration);
    Series shots{"", "a", SeriesKind::points, {}, {}};
    for (const std::size_t i : every_nth(rows, kMostMapPoints)) {
      shots.x.push_back(degrees_from_radians(head.azimuth[i]));
      shots.y.push_back(degrees_from_radians(head.zenith[i]));
    }
    return {view_of_directions(
                {fmt::format("Scan pattern of the first {} s, as recorded", kPatternDuration),
                 {},
                 {},
                 {shots},
                 every_nth_note(rows, kMostMapPoints)},
                all_around()),
            view_of_directions(density(), all_around())};
  }

 private:
  bool all_around() const { return input_.estimate.sensor.train.layout().axis_up; }

  std::vector<estimation::TruthComparison> truths() const {
    return input_.evaluation ? input_.evaluation->parameters
                             : std::vector<estimation::TruthComparison>();
  }

  Series level(const std::string& label, const std::string& colour, double value) const {
    const double end = shot_time(input_.estimate.series.size() - 1);
    return {label, colour, SeriesKind::line, {0.0, end}, {value, value}};
  }

  double time(std::size_t row) const {
    return 1e-9 * static_cast<double>(states_.time_ns[row] - states_.time_ns[0]);
  }
  double shot_time(std::size_t shot) const { return input_.estimate.series.time(shot); }

  std::size_t rows_until(double duration) const {
    std::size_t rows = 0;
    while (rows < input_.head.size() && input_.head.time(rows) <= duration) ++rows;
    return rows;
  }

  Series line(std::size_t rotor, const std::vector<double>& values) const {
    return peak_line(
        "", colour_of(rotor), states_.size(), [this](std::size_t i) { return time(i); },
        [&values](std::size_t i) { return degrees_from_radians(values[i]); });
  }

  Chart distribution(const std::string& title, const std::string& x_label,
                     const std::string& colour, const std::vector<double>& values,
                     const Moments& moments, const std::string& what) const {
    return {title, x_label, "knots",
            histogram(what, colour, values, states_.outlier, moments, kDegreesPerRadian),
            fmt::format("{} knots: mean {:.7g}, standard deviation {} deg{}. The outermost bins "
                        "hold everything beyond 4.5 standard deviations.",
                        count_text(moments.count), degrees_from_radians(moments.mean),
                        finite_text("{:.3g}", degrees_from_radians(moments.std)),
                        what == "velocity" ? "/s" : "")};
  }

  Chart over_time(const std::string& title, const std::vector<double>& residual,
                  const std::string& colour) const {
    Series used{"used", colour, SeriesKind::points, {}, {}};
    Series outliers{"outliers", "bad", SeriesKind::points, {}, {}};
    const std::size_t shots = residual.size();
    for (const std::size_t i : every_nth(shots, kMostShotPoints)) {
      if (input_.estimate.outlier[i] != 0) continue;
      used.x.push_back(shot_time(i));
      used.y.push_back(degrees_from_radians(residual[i]));
    }
    // Outliers are few and important: each is drawn as far as possible.
    std::vector<std::size_t> rows;
    for (std::size_t i = 0; i < shots; ++i) {
      if (input_.estimate.outlier[i] != 0 && std::isfinite(residual[i])) rows.push_back(i);
    }
    for (const std::size_t k : every_nth(rows.size(), kMostShotPoints)) {
      outliers.x.push_back(shot_time(rows[k]));
      outliers.y.push_back(degrees_from_radians(residual[rows[k]]));
    }
    std::string note = every_nth_note(shots, kMostShotPoints);
    if (!rows.empty()) {
      note += rows.size() == 1 ? " The outlier is drawn."
                               : " " + every_nth_note(rows.size(), kMostShotPoints, "outliers");
    }
    Chart chart{title, "time, s", "observed minus estimated, deg", {used}, note};
    if (!rows.empty()) chart.series.push_back(outliers);
    return chart;
  }

  Chart residual_histogram(const std::string& title, const std::vector<double>& residual,
                           const Moments& moments, const std::string& colour) const {
    return {title, "observed minus estimated, deg", "shots",
            histogram("residuals", colour, residual, input_.estimate.outlier, moments,
                      kDegreesPerRadian),
            "All shots except the outliers. The outermost bins hold everything beyond 4.5 "
            "standard deviations."};
  }

  /// Mean azimuth and zenith residuals over the cells of a plane.
  static std::vector<Chart> maps(const jobs::ResidualPlane& plane, const std::string& over,
                                 const std::string& x_label, const std::string& y_label) {
    const estimation::ResidualMap& map = plane.map;
    std::vector<Chart> charts;
    const auto add = [&](const char* what, const std::vector<double>& mean, double noise) {
      Series cells{"", "ink", SeriesKind::cells, {}, {}};
      cells.cell_width = cells.cell_height = degrees_from_radians(map.cell);
      double largest = 3.0 * degrees_from_radians(noise);  // a map of pure noise should look calm
      for (std::size_t i = 0; i < map.size(); ++i) {
        if (static_cast<double>(map.count[i]) < plane.fewest_shots) continue;
        cells.x.push_back(degrees_from_radians(map.x[i]));
        cells.y.push_back(degrees_from_radians(map.y[i]));
        cells.value.push_back(degrees_from_radians(mean[i]));
        largest = std::max(largest, std::abs(cells.value.back()));
      }
      Chart chart{
          fmt::format("Mean {} residuals over {}", what, over),
          x_label,
          y_label,
          {cells},
          fmt::format("Means of all {} used shots over cells of {:.3g}°; cells with fewer than {} "
                      "shots are omitted. Red: observed above estimated, blue: below. Noise "
                      "alone leaves about {}° in a cell.",
                      count_text(map.shots), degrees_from_radians(map.cell), plane.fewest_shots,
                      finite_text("{:.2g}", degrees_from_radians(noise)))};
      chart.value_label = "mean residual, deg";
      chart.palette = Palette::diverging;
      chart.value_range = {-largest, largest};
      charts.push_back(chart);
    };
    add("azimuth", map.mean_azimuth, plane.azimuth_noise);
    add("zenith", map.mean_zenith, plane.zenith_noise);
    return charts;
  }

  Chart over_angle(std::size_t rotor) const {
    const auto angle = [this, rotor](std::size_t i) {
      return degrees_from_radians(wrap_to_two_pi(states_.rotation_angle[rotor][i]));
    };
    Chart chart{fmt::format("Residuals over the rotation angle of prism {}", capital(rotor)),
                "rotation angle, deg",
                "observed minus estimated, deg",
                {},
                every_nth_note(states_.size(), kMostShotPoints / 2, "knots") +
                    " Lines: means over 5° of all used shots.",
                ChartKind::full_turn};
    const estimation::AngleProfile& profile = input_.estimate.residuals_over_angle[rotor];
    const auto add = [&](const std::string& name, const std::vector<double>& residual,
                         const std::string& colour) {
      Series points{name, colour, SeriesKind::points, {}, {}};
      for (const std::size_t i : every_nth(states_.size(), kMostShotPoints / 2)) {
        if (states_.outlier[i] != 0) continue;
        points.x.push_back(angle(i));
        points.y.push_back(degrees_from_radians(residual[i]));
      }
      chart.series.push_back(points);
    };
    const auto add_means = [&](const std::string& name, const std::vector<double>& mean,
                               const std::string& colour) {
      Series means{"mean of " + name, colour, SeriesKind::line, {}, {}};
      for (std::size_t bin = 0; bin < mean.size(); ++bin) {
        means.x.push_back(360.0 * (static_cast<double>(bin) + 0.5) /
                          static_cast<double>(mean.size()));
        means.y.push_back(degrees_from_radians(mean[bin]));
      }
      chart.series.push_back(means);
    };
    add("azimuth", states_.azimuth_residual, "a");
    add("zenith", states_.zenith_residual, "b");
    add_means("azimuth", profile.mean_azimuth, "ink");
    add_means("zenith", profile.mean_zenith, "c");
    return chart;
  }

  /// Shots per square degree.                                                      [B21 Fig. 2b]
  Chart density() const {
    const jobs::ShotDensity& density = input_.details->density;
    const double cell = degrees_from_radians(density.cell);
    Series cells{"", "ink", SeriesKind::cells, {}, {}};
    cells.cell_width = cells.cell_height = cell;
    for (std::size_t i = 0; i < density.x.size(); ++i) {
      cells.x.push_back(degrees_from_radians(density.x[i]));
      cells.y.push_back(degrees_from_radians(density.y[i]));
      // Cells of azimuth and zenith are narrower away from the horizon.
      const double narrowing = all_around() ? std::sin(density.y[i]) : 1.0;
      cells.value.push_back(density.shots[i] / (cell * cell * narrowing));
    }
    Chart chart{
        fmt::format("Density after {} s, as recorded", density.duration),
        {},
        {},
        {cells},
        fmt::format("All {} shots, counted over cells of {:.3g}°. The colours end at ten times "
                    "the mean density.",
                    count_text(density.total), cell)};
    chart.value_label = "shots per square degree";
    chart.value_range = {0.0, 10.0 * density.mean_per_cell / (cell * cell)};
    return chart;
  }

  const EstimatedRecording& input_;
  const RotorStates& states_;
};

}  // namespace

Report report_of(const EstimatedRecording& found) {
  if (!found.details) throw InvalidArgument("a report needs a result with details");
  const Estimate& e = found.estimate;
  Json page = page_of(e.sensor.shape(), {found.recording});
  page["nominal"] = nominal_json(found);
  page["correlation"] = correlation_json(e.free, e.covariance);
  page["advice"] = found.details->advice;
  page["usual_noise_deg"] = degrees_from_radians(e.usual_noise);
  page["pieces"] = nullptr;
  if (const auto& pieces = found.details->pieces) {
    page["pieces"] = {{"count", pieces->size()},
                      {"failed", pieces->failed},
                      {"duration_s", pieces->duration},
                      {"chi2_per_degree_of_freedom", pieces->chi2},
                      {"degrees_of_freedom", pieces->degrees_of_freedom}};
  }
  const EstimateCharts charts(found);
  return finished_report("estimate", json::of(found), page,
                         {{"parameters", charts_json(charts.pieces())},
                          {"rotors", charts_json(charts.rotors())},
                          {"residuals", charts_json(charts.residuals())},
                          {"pattern", charts_json(charts.pattern())}},
                         found.provenance);
}

}  // namespace risley::report
