// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "risley/calibration/trajectory_knots.hpp"
#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/report/chart.hpp"
#include "risley/report/html.hpp"
#include "risley/trajectories/error_process.hpp"

#include "report/pages.hpp"

namespace risley::report {
namespace {

using calibration::FlightCalibration;
using calibration::FlightUnknowns;
using calibration::TrajectoryKnots;
using jobs::CalibratedFlight;
using jobs::FlightDetails;
using jobs::FlightGround;
using jobs::FlightStrip;
using jobs::StripDifferences;
using json::Json;

constexpr std::size_t kMostTimes = 1200;  // of a line along time
constexpr double kShownPart = 0.95;       // of the values of a map between the ends of its colours
constexpr double kLeastShown = 1e-4;      // m
constexpr std::array<const char*, 5> kStripColours = {"a", "b", "c", "d", "bad"};

/// Display of the correction of one error of the trajectory.
struct DrawnCorrection {
  trajectories::PoseError error;
  const char *title, *label;
  double scale;  ///< to the units of the axis
};
constexpr std::array<DrawnCorrection, trajectories::kPoseErrors> kDrawnCorrections = {{
    {trajectories::PoseError::north, "Correction to the north", "correction, mm", kMillimetres},
    {trajectories::PoseError::east, "Correction to the east", "correction, mm", kMillimetres},
    {trajectories::PoseError::up, "Correction of the height", "correction, mm", kMillimetres},
    {trajectories::PoseError::tilt_north, "Correction of the tilt about north", "correction, deg",
     kDegreesPerRadian},
    {trajectories::PoseError::tilt_east, "Correction of the tilt about east", "correction, deg",
     kDegreesPerRadian},
    // Corrections are rotations about up, headings about down.
    {trajectories::PoseError::heading, "Correction of the heading", "correction, deg",
     -kDegreesPerRadian},
}};

/// Row of the corrections for an error.
Eigen::Index row_of(trajectories::PoseError error) {
  int row = 0;
  while (calibration::error_of(row) != error) ++row;
  return row;
}

double nominal_of(const sensors::Sensor& nominal, const std::string& name, std::size_t unknown) {
  const auto place = static_cast<int>(unknown);
  if (place == FlightUnknowns::range_offset()) return nominal.range_offset;
  return place < FlightUnknowns::parameter(0) ? kUnknown : nominal.get(name);
}

/// True value of the unknown; a boresight relative to the given mount.
double true_value(const CalibratedFlight& input, const std::string& name, std::size_t unknown) {
  const jobs::FlightTruth& truth = *input.truth;
  const auto place = static_cast<int>(unknown);
  if (place >= FlightUnknowns::parameter(0)) return truth.sensor.get(name);
  if (place == FlightUnknowns::clock_offset()) return truth.mount.clock_offset.value;
  if (place == FlightUnknowns::range_offset()) return truth.sensor.range_offset;
  if (place >= FlightUnknowns::lever_arm(0)) {
    return truth.mount.lever_arm[unknown - static_cast<std::size_t>(FlightUnknowns::lever_arm(0))]
        .value;
  }
  const Eigen::AngleAxisd turn(
      Eigen::Matrix3d(input.mount.nominal.transpose() * body_from_sensor(truth.mount)));
  return turn.angle() * turn.axis()[place];
}

double seconds_between(std::int64_t begin_ns, std::int64_t end_ns) {
  return 1e-9 * static_cast<double>(end_ns - begin_ns);
}

double median_spacing(const TrajectoryKnots& knots) {
  std::vector<double> spacings;
  for (const TrajectoryKnots::Interval& interval : knots.intervals) {
    spacings.push_back(seconds_between(interval.begin_ns, interval.end_ns));
  }
  if (spacings.empty()) return 0;
  const auto middle = spacings.begin() + static_cast<std::ptrdiff_t>(spacings.size() / 2);
  std::nth_element(spacings.begin(), middle, spacings.end());
  return *middle;
}

std::string strip_name(std::size_t strip) { return fmt::format("strip {}", strip + 1); }

/// A size that most of the values do not exceed, not 0.
double shown_size(std::vector<double> values) {
  std::erase_if(values, [](double value) { return !std::isfinite(value); });
  if (values.empty()) return kLeastShown;
  for (double& value : values) value = std::abs(value);
  const auto at = values.begin() +
                  static_cast<std::ptrdiff_t>(kShownPart * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return std::max(*at, kLeastShown);
}

/// All diagrams of the page.
class FlightCharts {
 public:
  explicit FlightCharts(const CalibratedFlight& input)
      : c_(input.calibration), details_(*input.details) {}

  std::vector<Chart> strips() const {
    if (details_.strips.empty()) return {};
    Chart chart{"The strips from above", "east, m", "north, m", {}, {}, ChartKind::ground};
    for (std::size_t i = 0; i < details_.strips.size(); ++i) {
      const FlightStrip& strip = details_.strips[i];
      chart.series.push_back({strip_name(strip.strip), kStripColours[i % kStripColours.size()],
                              SeriesKind::line, strip.east, strip.north});
    }
    chart.note = "Positions of the trajectory, in metres from the middle of the flight.";
    if (details_.strips.size() < details_.strip_count) {
      chart.note += fmt::format(" The first {} of {} strips are drawn.", details_.strips.size(),
                                details_.strip_count);
    }
    if (details_.strips.size() > kStripColours.size()) {
      chart.note += fmt::format(" Colours repeat after {} strips.", kStripColours.size());
    }
    return {chart};
  }

  std::vector<Chart> differences() const {
    std::vector<Chart> charts;
    const FlightGround& ground = details_.ground;
    if (!ground.east.empty()) {
      add_differences(charts, "All strips", ground.east, ground.north, ground.before, ground.after,
                      false);
    }
    for (const StripDifferences& pair : details_.pairs) {
      add_differences(charts,
                      fmt::format("Strip {} minus strip {}", pair.second + 1, pair.first + 1),
                      pair.east, pair.north, pair.before, pair.after, true);
    }
    return charts;
  }

  std::vector<Chart> ground() const {
    const FlightGround& g = details_.ground;
    if (g.east.empty()) return {};
    std::vector<Chart> charts;
    Chart roughness = map("How rough the ground is", g.east, g.north,
                          scaled(g.roughness, kMillimetres), "scatter about the planes, mm");
    roughness.value_range = {0.0, kMillimetres * shown_size(g.roughness)};
    roughness.note +=
        " Scatter of the points about a plane in each cell, 1 sigma. Smooth ground shows the "
        "noise of the ranges; bushes, edges and steps show more, and their cells are not used.";
    charts.push_back(std::move(roughness));
    Chart slope = map("How steep the ground is", g.east, g.north,
                      scaled(g.slope, kDegreesPerRadian), "slope, deg");
    slope.note +=
        " Slopes in many directions reveal shifts of strips and a rotation about the vertical.";
    charts.push_back(std::move(slope));
    Chart strips = map("How many strips saw it", g.east, g.north, g.strips, "strips");
    strips.note += " Only ground that two or more strips cover is used.";
    charts.push_back(std::move(strips));
    return charts;
  }

  std::vector<Chart> residuals() const {
    if (c_.piece_time.empty()) return {};
    // The mean of squares of several pieces, never across two strips.
    const std::size_t stride = (c_.piece_time.size() + kMostTimes - 1) / kMostTimes;
    Series rms{"residuals, RMS", "a", SeriesKind::line, {}, {}};
    std::size_t strip = strip_at(c_.piece_time.front());
    for (std::size_t i = 0; i < c_.piece_time.size();) {
      const std::size_t own = strip_at(c_.piece_time[i]);
      if (own != strip) add_break(rms, c_.piece_time[i]);
      strip = own;
      double time = 0, squares = 0;
      std::size_t count = 0;
      for (; i < c_.piece_time.size() && count < stride && strip_at(c_.piece_time[i]) == own; ++i) {
        time += c_.piece_time[i];
        squares += c_.piece_rms[i] * c_.piece_rms[i];
        ++count;
      }
      rms.x.push_back(time / static_cast<double>(count));
      rms.y.push_back(kMillimetres * std::sqrt(squares / static_cast<double>(count)));
    }
    Chart chart{"Residuals along time",
                "time, s",
                "residual of a range, mm",
                {rms},
                fmt::format("Root mean square of measured minus predicted ranges, {} pieces of "
                            "the flight{}. The line is the noise of one range over the whole "
                            "flight.",
                            count_text(c_.piece_time.size()),
                            stride > 1 ? fmt::format(", {} together", stride) : "")};
    if (std::isfinite(c_.range_sigma)) {
      chart.series.push_back({"noise of a range",
                              "ink",
                              SeriesKind::line,
                              {c_.piece_time.front(), c_.piece_time.back()},
                              {kMillimetres * c_.range_sigma, kMillimetres * c_.range_sigma}});
    }
    return {chart};
  }

  std::vector<Chart> corrections() const {
    const TrajectoryKnots& knots = c_.model.knots;
    const auto columns = static_cast<Eigen::Index>(knots.size());
    if (columns == 0 || c_.model.corrections.cols() != columns ||
        c_.correction_sigma.cols() != columns ||
        c_.model.corrections.rows() != calibration::kCorrections ||
        c_.correction_sigma.rows() != calibration::kCorrections) {
      return {};
    }
    const std::size_t stride = (knots.size() + kMostTimes - 1) / kMostTimes;
    std::vector<std::size_t> kept;
    for (std::size_t i = 0; i < knots.size(); ++i) {
      const bool end = i == 0 || i + 1 == knots.size() || knots.strip[i] != knots.strip[i - 1] ||
                       knots.strip[i + 1] != knots.strip[i];
      if (end || i % stride == 0) kept.push_back(i);
    }
    std::vector<Chart> charts;
    for (const DrawnCorrection& drawn : kDrawnCorrections) {
      const Eigen::Index row = row_of(drawn.error);
      Series value{"correction", "a", SeriesKind::line, {}, {}};
      Series above{"± σ", "ink", SeriesKind::line, {}, {}}, below = above;
      for (std::size_t k = 0; k < kept.size(); ++k) {
        const auto knot = static_cast<Eigen::Index>(kept[k]);
        const double time = seconds_between(knots.time_ns.front(), knots.time_ns[kept[k]]);
        if (k > 0 && knots.strip[kept[k]] != knots.strip[kept[k - 1]]) {
          for (Series* series : {&value, &above, &below}) add_break(*series, time);
        }
        const double own = drawn.scale * c_.model.corrections(row, knot);
        const double sigma = std::abs(drawn.scale) * c_.correction_sigma(row, knot);
        for (Series* series : {&value, &above, &below}) series->x.push_back(time);
        value.y.push_back(own);
        above.y.push_back(own + sigma);
        below.y.push_back(own - sigma);
      }
      // One series, so that the legend has one entry.
      add_break(above, above.x.back());
      above.x.insert(above.x.end(), below.x.begin(), below.x.end());
      above.y.insert(above.y.end(), below.y.begin(), below.y.end());
      charts.push_back(
          {drawn.title,
           "time, s",
           drawn.label,
           {above, value},
           kept.size() == knots.size()
               ? fmt::format("All {} knots are drawn.", count_text(knots.size()))
               : fmt::format("One in {1} of the {0} knots is drawn, and the ends of strips.",
                             count_text(knots.size()), stride)});
    }
    return charts;
  }

 private:
  static void add_break(Series& series, double time) {
    series.x.push_back(time);
    series.y.push_back(kUnknown);
  }

  static std::vector<double> scaled(std::vector<double> values, double scale) {
    for (double& value : values) value *= scale;
    return values;
  }

  /// Strip at a time since the first shot; in a turn the previous one.
  std::size_t strip_at(double time) const {
    const TrajectoryKnots& knots = c_.model.knots;
    if (knots.size() == 0) return 0;
    const std::int64_t time_ns =
        knots.time_ns.front() + static_cast<std::int64_t>(std::llround(1e9 * time));
    const auto behind = std::upper_bound(knots.time_ns.begin(), knots.time_ns.end(), time_ns);
    const auto at = behind == knots.time_ns.begin() ? 0 : behind - knots.time_ns.begin() - 1;
    return knots.strip[static_cast<std::size_t>(at)];
  }

  /// ", colours in mm" of "difference, mm".
  static std::string unit_words(const std::string& label) {
    const std::size_t comma = label.rfind(", ");
    return comma == std::string::npos ? "" : ", colours in " + label.substr(comma + 2);
  }

  /// Squares that have a value.
  Chart map(std::string title, const std::vector<double>& east, const std::vector<double>& north,
            const std::vector<double>& values, std::string value_label) const {
    Series cells{"", "ink", SeriesKind::cells, {}, {}};
    cells.cell_width = cells.cell_height = details_.square_size;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!std::isfinite(values[i])) continue;
      cells.x.push_back(east[i]);
      cells.y.push_back(north[i]);
      cells.value.push_back(values[i]);
    }
    Chart chart{std::move(title), "east, m", "north, m", {std::move(cells)}, {}, ChartKind::ground};
    chart.note = fmt::format("Squares of {:g} m{}.", details_.square_size, unit_words(value_label));
    chart.value_label = std::move(value_label);
    return chart;
  }

  /// Before and after in the same colours, and after with a separate colour scale; on the same
  /// squares if there are any.
  void add_differences(std::vector<Chart>& charts, const std::string& name,
                       const std::vector<double>& east, const std::vector<double>& north,
                       std::vector<double> before, std::vector<double> after, bool signs) const {
    const auto known = [&](std::size_t i) { return std::isfinite(before[i] + after[i]); };
    std::size_t common = 0;
    for (std::size_t i = 0; i < east.size(); ++i) common += known(i) ? 1 : 0;
    for (std::size_t i = 0; i < east.size() && common > 0; ++i) {
      if (!known(i)) before[i] = after[i] = kUnknown;
    }
    const double fine = kMillimetres * shown_size(after);
    const double coarse = std::max(fine, kMillimetres * shown_size(before));
    const auto add = [&](const char* when, const std::vector<double>& values, double size,
                         const char* colours) {
      Chart chart =
          map(fmt::format("{}, {}", name, when), east, north, scaled(values, kMillimetres),
              signs ? "difference, mm" : "RMS difference, mm");
      if (signs) chart.note += " Red: the first strip named lies above the other, blue: below.";
      chart.note += colours;
      chart.palette = signs ? Palette::diverging : Palette::sequential;
      chart.value_range = {signs ? -size : 0.0, size};
      charts.push_back(std::move(chart));
    };
    add("before", before, coarse, " One square in twenty exceeds the range of the colours.");
    add("after", after, coarse, " The same colours as before.");
    add("after, finer colours", after, fine,
        " The same differences, each with its own colour scale.");
  }

  const FlightCalibration& c_;
  const FlightDetails& details_;
};

}  // namespace

Report report_of(const CalibratedFlight& found) {
  if (!found.details) throw InvalidArgument("a report needs a result with details");
  const FlightCalibration& c = found.calibration;
  const TrainShape shape = c.sensor.shape();
  Json page = page_of(shape, found.recordings);
  Json nominal = Json::object(), truth = Json::object(), axes = Json::array();
  std::vector<std::string> names;  // what has a sigma
  std::vector<Eigen::Index> rows;
  for (std::size_t i = 0; i < c.unknowns.size(); ++i) {
    const calibration::FlightUnknown& own = c.unknowns[i];
    const auto in_unit = [&](double value) { return in_file_unit(own, value, shape); };
    nominal[own.name] = in_unit(nominal_of(found.nominal, own.name, i));
    if (found.truth) truth[own.name] = in_unit(true_value(found, own.name, i));
    const auto row = static_cast<Eigen::Index>(i);
    if (!(c.covariance(row, row) > 0)) continue;
    names.push_back(own.name);
    rows.push_back(row);
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d row = found.mount.nominal.row(axis);
    axes.push_back({row.x(), row.y(), row.z()});
  }
  page["mount"] = {{"name", found.mount.name},
                   {"reference_point", found.mount.reference_point},
                   {"body_from_sensor", axes}};
  page["nominal"] = nominal;
  page["true"] = found.truth ? truth : Json();
  page["correlation"] = correlation_json(names, c.covariance(rows, rows));
  page["knot_spacing_s"] = median_spacing(c.model.knots);
  page["strips"] = Json::array();
  for (const FlightStrip& strip : found.details->strips) {
    page["strips"].push_back({{"strip", strip.strip + 1},
                              {"begin_s", strip.begin},
                              {"duration_s", strip.duration},
                              {"course_deg", degrees_from_radians(strip.course)},
                              {"speed_m_per_s", strip.speed},
                              {"range_m", strip.range},
                              {"sway_deg", degrees_from_radians(strip.sway)}});
  }
  const FlightCharts charts(found);
  return finished_report("calibrate", json::of(found), page,
                         {{"strips", charts_json(charts.strips())},
                          {"differences", charts_json(charts.differences())},
                          {"ground", charts_json(charts.ground())},
                          {"residuals", charts_json(charts.residuals())},
                          {"corrections", charts_json(charts.corrections())}},
                         found.provenance);
}

}  // namespace risley::report
