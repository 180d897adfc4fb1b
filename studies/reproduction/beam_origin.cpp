// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Appendix A of the paper: where beams leave the sensor. Table A1 and Fig. A1.
#include "risley/optics/beam_origin.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/direction.hpp"
#include "risley/optics/beam_origin_map.hpp"

#include "reproduction/reproduce.hpp"

namespace risley::reproduction {
namespace {

constexpr double kMillimetres = 1e3;
/// The paper's grid of 0.333 degree, both ends of the turn included.
constexpr std::size_t kSteps = 1081;
constexpr double kMapCell = radians_from_degrees(0.5);

struct PapersBeam {
  const char *name, *rotation_angle_a, *rotation_angle_b, *azimuth, *zenith, *y, *z;
};
constexpr std::array kBeams{
    PapersBeam{"beam 1", "96.667", "233.000", "1.99", "83.03", "3.0", "0.8"},
    PapersBeam{"beam 2", "231.667", "95.333", "1.98", "83.03", "-2.1", "2.3"}};

Row at_digits(std::string term, std::string unit, const char* paper, double ours) {
  Row row{std::move(term), std::move(unit), printed(paper), ours};
  row.checks = {at_printed_digits(*row.paper, ours)};
  return row;
}

Table table_a1(const ReproduceOptions& options) {
  Table table{"table_a1",
              "Table A1: two beams of one direction that start at different points",
              "The ideal sensor at the paper's rotation angles, prisms of the preset's size (7 mm "
              "thick, perpendicular faces 30 mm apart).",
              {}};
  const PrismTrain ideal = options.type.train.without_errors();
  for (const PapersBeam& beam : kBeams) {
    const std::array angles{radians_from_degrees(printed(beam.rotation_angle_a).value),
                            radians_from_degrees(printed(beam.rotation_angle_b).value)};
    const Ray ray = emergent_ray(ideal, options.type.geometry, angles);
    const SphericalAngles<double> direction = angles_from_direction(ray.direction);
    const std::string name = beam.name;
    table.rows.push_back(at_digits(name + ", azimuth", "deg", beam.azimuth,
                                   degrees_from_radians(direction.azimuth)));
    table.rows.push_back(
        at_digits(name + ", zenith", "deg", beam.zenith, degrees_from_radians(direction.zenith)));
    table.rows.push_back(
        at_digits(name + ", Y correction", "mm", beam.y, kMillimetres * ray.origin.y));
    table.rows.push_back(
        at_digits(name + ", Z correction", "mm", beam.z, kMillimetres * ray.origin.z));
  }
  return table;
}

double least(const std::vector<double>& column) {
  return *std::min_element(column.begin(), column.end());
}
double greatest(const std::vector<double>& column) {
  return *std::max_element(column.begin(), column.end());
}

report::Chart map_chart(const BeamOriginMap& map, const char* title,
                        const std::vector<double>& values) {
  report::Series cells{"mm", "a", report::SeriesKind::cells, {}, {}};
  cells.cell_width = cells.cell_height = degrees_from_radians(map.cell);
  for (std::size_t i = 0; i < map.size(); ++i) {
    cells.x.push_back(degrees_from_radians(map.azimuth[i]));
    cells.y.push_back(degrees_from_radians(map.zenith[i]));
    cells.value.push_back(kMillimetres * values[i]);
  }
  return field_of_view_chart(fmt::format("{}, mm", title), std::move(cells));
}

std::vector<double> difference(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> result(a.size());
  std::transform(a.begin(), a.end(), b.begin(), result.begin(), std::minus<>());
  return result;
}

Table figure_a1(const BeamOriginMap& map) {
  Table table{
      "figure_a1",
      "Fig. A1: corrections of Y and Z over the field of view",
      "All pairs of rotation angles in steps of 0.333 degree through the ideal model, least "
      "and greatest correction of every half degree of the field of view.",
      {}};
  const Printed upper = printed("4.5");
  const char* note =
      "The paper says 'upwards of 4.5 mm', the end of its colour scale. The model with 7 mm and 30 "
      "mm reaches 4.37 mm on all four sides.";
  const auto extreme = [&](const char* term, double metres) {
    Row row{term, "mm", upper, kMillimetres * std::abs(metres)};
    row.checks = {within("ours", row.ours, 4.0, upper.value,
                         "the paper's 4.5 mm as an upper bound, nearly reached")};
    row.note = note;
    table.rows.push_back(row);
  };
  extreme("largest correction towards -Y", least(map.least_y));
  extreme("largest correction towards +Y", greatest(map.greatest_y));
  extreme("largest correction towards -Z", least(map.least_z));
  extreme("largest correction towards +Z", greatest(map.greatest_z));
  Row beams{"pairs of rotation angles", "1", {}, static_cast<double>(map.beams)};
  beams.checks = {within("ours", beams.ours, 1081.0 * 1081.0, 1081.0 * 1081.0,
                         "0 to 360 degrees in steps of 0.333, both ends, every beam gets through")};
  table.rows.push_back(beams);
  const double range = kMillimetres * greatest(difference(map.greatest_y, map.least_y));
  Row varies{"largest range of Y within one cell of directions", "mm", {}, range};
  varies.checks = {
      at_least("ours", range, 5.1, "Table A1's two beams of one direction are 5.1 mm apart in Y")};
  table.rows.push_back(varies);
  return table;
}

}  // namespace

Reproduction beam_origin_errors(const ReproduceOptions& options) {
  const BeamOriginMap map =
      beam_origin_map(options.type.train.without_errors(), options.type.geometry, kSteps, kMapCell);
  Figure figure{"figure_a1", "figure_a1", "Fig. A1: corrections over the field of view", {}};
  figure.charts = {map_chart(map, "(a) least Y", map.least_y),
                   map_chart(map, "(b) greatest Y", map.greatest_y),
                   map_chart(map, "(c) range of Y", difference(map.greatest_y, map.least_y)),
                   map_chart(map, "(d) least Z", map.least_z),
                   map_chart(map, "(e) greatest Z", map.greatest_z),
                   map_chart(map, "(f) range of Z", difference(map.greatest_z, map.least_z))};
  return {{table_a1(options), figure_a1(map)}, {figure}};
}

}  // namespace risley::reproduction
