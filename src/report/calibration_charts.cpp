// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/error.hpp"
#include "risley/estimation/diagnostics.hpp"
#include "risley/report/chart.hpp"
#include "risley/report/html.hpp"

#include "report/pages.hpp"

namespace risley::report {
namespace {

using calibration::Calibration;
using calibration::ThicknessProfile;
using jobs::CalibratedRecordings;
using jobs::SamplePoint;
using json::Json;

constexpr std::size_t kMostWallPoints = 3000;   // per scatter diagram
constexpr std::size_t kMostViewPoints = 8000;   // of all recordings in one kind of view
constexpr std::size_t kFewestViewPoints = 800;  // of one recording in it
constexpr double kShownThickness = 0.03;        // of walls in three dimensions, share of the range
constexpr std::array<const char*, 5> kPlaneColours = {"a", "b", "c", "d", "bad"};
constexpr const char* kClutterColour = "ink";

/// Values of the free parameters by name, in the units of files.
/// @param values  the object that has them: a sensor, a train
template <class Values>
Json values_json(const Calibration& c, const Values& values) {
  Json object = Json::object();
  for (const estimation::FreeParameter& free : c.free) {
    object[free.name] = in_file_unit(free.name, values.get(free.name), c.sensor.shape());
  }
  return object;
}

std::string recording_name(const CalibratedRecordings& input, std::size_t recording) {
  if (recording < input.recordings.size()) return file_name(input.recordings[recording].path);
  return fmt::format("recording {}", recording + 1);
}

std::size_t recording_count(const CalibratedRecordings& input) {
  std::size_t count = input.recordings.size();
  for (const SamplePoint& point : input.details->sample) {
    count = std::max(count, point.recording + 1);
  }
  return count;
}

std::string plane_name(const Calibration& c, std::size_t plane) {
  return plane < c.planes.size() ? c.planes[plane].name : fmt::format("plane {}", plane + 1);
}

/// Value of a sample point in the unit of an axis.
using PointValue = std::function<double(const SamplePoint&)>;

double azimuth_degrees(const SamplePoint& p) { return degrees_from_radians(p.azimuth); }
double zenith_degrees(const SamplePoint& p) { return degrees_from_radians(p.zenith); }
double before_millimetres(const SamplePoint& p) { return kMillimetres * p.before; }
double after_millimetres(const SamplePoint& p) { return kMillimetres * p.after; }

/// Cells of the field of view, coloured by values in the displayed unit.
Chart map_of_cells(std::string title, std::string note, const jobs::FieldCells& cells,
                   const std::vector<double>& values, double unit, bool all_around) {
  Series series{"", "ink", SeriesKind::cells, {}, {}};
  series.cell_width = series.cell_height = degrees_from_radians(cells.side);
  for (std::size_t i = 0; i < values.size(); ++i) {
    series.x.push_back(degrees_from_radians(cells.azimuth[i]));
    series.y.push_back(degrees_from_radians(cells.zenith[i]));
    series.value.push_back(unit * values[i]);
  }
  return view_of_directions({std::move(title), {}, {}, {series}, std::move(note)}, all_around);
}

/// All diagrams of the page.
class CalibrationCharts {
 public:
  explicit CalibrationCharts(const CalibratedRecordings& input)
      : input_(input), c_(input.calibration) {
    for (const SamplePoint& point : input_.details->sample) {
      if (point.plane >= 0) on_walls_.push_back(&point);
    }
  }

  std::vector<Chart> thickness() const {
    std::vector<Chart> charts;
    for (const ThicknessProfile& profile : c_.profiles) charts.push_back(thickness_over(profile));
    if (on_walls_.empty()) return charts;
    charts.push_back(distances());
    charts.push_back(distances_over_azimuth());
    for (Chart& chart : cell_means()) charts.push_back(std::move(chart));
    return charts;
  }

  std::vector<Chart> views() const {
    std::vector<Chart> charts;
    const std::size_t recordings = recording_count(input_);
    for (std::size_t i = 0; i < recordings; ++i) {
      const View view(input_, i, recordings);
      if (view.empty()) continue;
      const std::string name = recording_name(input_, i);
      charts.push_back(view_of_directions(
          view.chart("Field of view: " + name, {}, azimuth_degrees, {}, zenith_degrees),
          all_around()));
      charts.push_back(view.chart_with_sensor(
          "From above: " + name, "right of the sensor (−Y), m",
          [](const SamplePoint& p) { return -p.point.y; }, "ahead of it (X), m",
          [](const SamplePoint& p) { return p.point.x; }, "Ahead is up, as on a map."));
      charts.push_back(view.chart_with_sensor(
          "From the side: " + name, "ahead of the sensor (X), m",
          [](const SamplePoint& p) { return p.point.x; }, "above it (Z), m",
          [](const SamplePoint& p) { return p.point.z; }, "Seen from the right of the sensor."));
    }
    return charts;
  }

  /// Errors of reported directions over the field of view.
  std::vector<Chart> pointing() const {
    if (!input_.details->pointing) return {};
    const jobs::PointingField& field = *input_.details->pointing;
    const auto chart = [&](std::string title, const std::vector<double>& errors,
                           const std::string& note) {
      Chart result =
          map_of_cells(std::move(title),
                       fmt::format("Angle between the direction that the sensor reports and that "
                                   "of this calibration, {}; means over cells of {:.3g} degree.",
                                   note, degrees_from_radians(field.cells.side)),
                       field.cells, errors, degrees_from_radians(1.0), all_around());
      result.value_label = "error, deg";
      const double largest = *std::max_element(errors.begin(), errors.end());
      result.value_range = {0.0, degrees_from_radians(largest)};
      return result;
    };
    return {chart("Error of reported directions over the field of view", field.total,
                  "everything included"),
            chart("The same without the rotation common to all beams", field.shape,
                  "after the best common rotation of all beams")};
  }

  /// The walls in space, before and after, with their thickness enlarged.
  std::vector<Chart> walls() const {
    std::vector<Chart> charts;
    for (const jobs::WallsInSpace& walls : input_.details->walls) {
      for (Chart& chart : walls_in_space(walls)) charts.push_back(std::move(chart));
    }
    return charts;
  }

  /// Errors of beams with known truth. [B21 Fig. 12]
  std::vector<Chart> truth() const {
    if (!input_.truth || !input_.details->beam_errors) return {};
    const jobs::BeamComparison& t = *input_.truth;
    const jobs::BeamErrorMoments& moments = *input_.details->beam_errors;
    std::vector<Chart> charts;
    const auto degrees_text = [](double angle) {
      return finite_text("{:.3g}", degrees_from_radians(angle));
    };
    const auto add = [&](const char* title, const char* colour, const std::vector<double>& errors,
                         const estimation::Moments& m) {
      if (errors.empty()) return;
      charts.push_back({title, "computed minus true, deg", "beams",
                        histogram("errors", colour, errors, {}, m, kDegreesPerRadian),
                        fmt::format("{} beams: mean {}°, standard deviation {}°, root mean "
                                    "square {}°. The outermost bins hold everything beyond 4.5 "
                                    "standard deviations.",
                                    count_text(m.count), degrees_text(m.mean), degrees_text(m.std),
                                    degrees_text(m.rms))});
    };
    add("Errors of the azimuth before", "b", t.azimuth_before, moments.azimuth_before);
    add("Errors of the zenith angle before", "b", t.zenith_before, moments.zenith_before);
    add("Errors of the azimuth after", "a", t.azimuth_after, moments.azimuth_after);
    add("Errors of the zenith angle after", "a", t.zenith_after, moments.zenith_after);
    return charts;
  }

 private:
  bool all_around() const { return c_.sensor.train.layout().axis_up; }

  /// The sample points of one recording, thinned and split by plane.
  class View {
   public:
    View(const CalibratedRecordings& input, std::size_t recording, std::size_t recordings) {
      std::vector<const SamplePoint*> points;
      for (const SamplePoint& point : input.details->sample) {
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
        groups_.push_back({plane_name(input.calibration, static_cast<std::size_t>(plane)),
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
      Chart chart{std::move(title), std::move(x_label), std::move(y_label), {}, note_};
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
      result.kind = ChartKind::ground;
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
      return fmt::format("rotation angle of prism {}", prism_capital(variable.back() - 'a'));
    }
    std::string text = variable;
    std::replace(text.begin(), text.end(), '_', ' ');
    return text;
  }

  static Chart thickness_over(const ThicknessProfile& profile) {
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
    return {"Thickness over the " + what,
            what + ", deg",
            "distance from the plane, mm",
            {line("RMS after", "a", profile.rms_after), line("RMS before", "b", profile.rms_before),
             line("mean after", "c", profile.mean_after),
             line("mean before", "d", profile.mean_before)},
            fmt::format("All points in {} bins of {} to {} points each; empty bins leave a gap. "
                        "Distances are positive beyond the plane as seen from the sensor; a "
                        "calibrated sensor has means near 0.",
                        bins.size(), count_text(fewest), count_text(most)),
            turn ? ChartKind::full_turn : ChartKind::plain};
  }

  std::string sample_note() const {
    return fmt::format("An evenly spread sample: {1} of the {0} used points. ",
                       count_text(c_.points), count_text(input_.details->points_on_planes));
  }

  Chart distances() const {
    std::vector<double> before, after;
    for (const SamplePoint* point : on_walls_) {
      before.push_back(point->before);
      after.push_back(point->after);
    }
    // Both share their bins, so that their heights can be compared.
    const estimation::Moments& moments_before = input_.details->distances_before;
    const estimation::Moments& moments_after = input_.details->distances_after;
    estimation::Moments both;
    both.std = std::fmax(moments_before.rms, moments_after.rms);
    Chart chart{"Histogram of the distances from the planes",
                "distance from the plane, mm",
                "points",
                {histogram("after", "a", after, {}, both, kMillimetres).front(),
                 histogram("before", "b", before, {}, both, kMillimetres).front()},
                sample_note() + fmt::format("Root mean square {} mm before, {} mm after. The "
                                            "outermost bins hold all larger distances.",
                                            millimetres(moments_before.rms),
                                            millimetres(moments_after.rms))};
    return chart;
  }

  Chart distances_over_azimuth() const {
    Series before{"before", "b", SeriesKind::points, {}, {}};
    Series after{"after", "a", SeriesKind::points, {}, {}};
    for (const std::size_t i : every_nth(on_walls_.size(), kMostWallPoints)) {
      const SamplePoint& point = *on_walls_[i];
      const auto add = [&point](Series& series, double distance) {
        if (!std::isfinite(distance + point.azimuth)) return;
        series.x.push_back(azimuth_degrees(point));
        series.y.push_back(distance);
      };
      add(before, before_millimetres(point));
      add(after, after_millimetres(point));
    }
    return {"Distances from the planes over the azimuth",
            "azimuth, deg",
            "distance from the plane, mm",
            {after, before},
            every_nth_note(on_walls_.size(), kMostWallPoints, "sample points on planes")};
  }

  /// Distances of points from their planes over the field of view, beyond or in front.
  std::vector<Chart> cell_means() const {
    if (!input_.details->field) return {};
    const jobs::WallField& field = *input_.details->field;
    const auto chart = [&](const char* when, const std::vector<double>& means, double rms) {
      Chart result = map_of_cells(
          fmt::format("Mean distance from the planes over the field of view, {}", when),
          fmt::format("Means of {} sample points over cells of {:.3g} degree, all recordings "
                      "together; cells with fewer than {} points are omitted. The {} means have "
                      "a root mean square of {:.2f} mm, where noise alone would leave about "
                      "{:.2f} mm. Red: beyond the plane as seen from the sensor, blue: in front "
                      "of it. Patches of one colour are walls that are not flat, or beams that "
                      "are off.",
                      count_text(field.points), degrees_from_radians(field.cells.side),
                      field.fewest_points, count_text(means.size()), kMillimetres * rms,
                      kMillimetres * field.noise),
          field.cells, means, kMillimetres, all_around());
      result.value_label = "mean distance, mm";
      result.palette = Palette::diverging;
      double largest = 0;
      for (const auto* both : {&field.mean_before, &field.mean_after}) {
        for (const double mean : *both) largest = std::max(largest, std::abs(mean));
      }
      result.value_range = {-kMillimetres * largest, kMillimetres * largest};
      return result;
    };
    return {chart("before", field.mean_before, field.rms_before),
            chart("after", field.mean_after, field.rms_after)};
  }

  std::vector<Chart> walls_in_space(const jobs::WallsInSpace& walls) const {
    if (walls.patches.empty()) return {};
    const double enlarged =
        walls.rms_before > 0
            ? std::pow(10.0,
                       std::floor(std::log10(kShownThickness * walls.farthest / walls.rms_before)))
            : 1.0;
    const auto chart = [&](const char* when, double jobs::WallPatch::*distance) {
      Series series{"", "a", SeriesKind::points, {}, {}};
      for (const jobs::WallPatch& patch : walls.patches) {
        const Vector3<double> at =
            patch.foot + enlarged * (patch.*distance) * c_.planes[patch.plane].normal;
        series.x.push_back(at.x);
        series.y.push_back(at.y);
        series.z.push_back(at.z);
        series.value.push_back(kMillimetres * (patch.*distance));
      }
      Chart result{fmt::format("Walls {} the calibration: {}", when,
                               recording_name(input_, walls.recording)),
                   "X (forward), m",
                   "Y (left), m",
                   {series},
                   fmt::format("Each dot is the mean of the {} sample points of a wall within one "
                               "degree, {} dots; cells with fewer than {} points are omitted. "
                               "Distances from the planes are drawn {:.0f} times as large; red is "
                               "beyond the plane as seen from the sensor, blue in front of it. "
                               "Drag to rotate.",
                               count_text(walls.points), count_text(series.x.size()),
                               walls.fewest_points, enlarged),
                   ChartKind::space};
      result.z_label = "Z (up), m";
      result.value_label = "mean distance from the plane, mm";
      result.palette = Palette::diverging;
      result.value_range = {-kMillimetres * walls.largest, kMillimetres * walls.largest};
      return result;
    };
    return {chart("before", &jobs::WallPatch::before), chart("after", &jobs::WallPatch::after)};
  }

  const CalibratedRecordings& input_;
  const Calibration& c_;
  std::vector<const SamplePoint*> on_walls_;
};

}  // namespace

Report report_of(const CalibratedRecordings& found) {
  if (!found.details) throw InvalidArgument("a report needs a result with details");
  const Calibration& c = found.calibration;
  Json page = page_of(c.sensor.shape(), found.recordings);
  page["nominal"] = values_json(c, found.nominal);
  page["believed"] = values_json(c, c.believed);
  page["true"] = found.truth ? values_json(c, found.truth->truth) : Json();
  page["correlation"] = correlation_json(c.free, c.covariance);
  page["datum_without_common"] = json::of(c.datum_without_common);
  const CalibrationCharts charts(found);
  return finished_report("calibrate", json::of(found), page,
                         {{"truth", charts_json(charts.truth())},
                          {"pointing", charts_json(charts.pointing())},
                          {"thickness", charts_json(charts.thickness())},
                          {"walls", charts_json(charts.walls())},
                          {"views", charts_json(charts.views())}},
                         found.provenance);
}

}  // namespace risley::report
