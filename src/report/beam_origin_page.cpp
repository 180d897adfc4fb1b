// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/beam_origin_page.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/core/number_text.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"
#include "risley/sensors/prism_sizes.hpp"

namespace risley::report {
namespace {

/// One map. Values of both signs have colours that are neutral at 0.
Chart map_chart(const BeamOriginMap& map, const char* title, const std::vector<double>& values) {
  const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
  Series cells{"", "ink", SeriesKind::cells, {}, {}};
  cells.cell_width = cells.cell_height = degrees_from_radians(map.cell);
  for (std::size_t i = 0; i < map.size(); ++i) {
    cells.x.push_back(degrees_from_radians(map.azimuth[i]));
    cells.y.push_back(degrees_from_radians(map.zenith[i]));
    cells.value.push_back(kMillimetres * values[i]);
  }
  Chart chart{
      title,
      "azimuth, deg",
      "zenith, deg",
      {cells},
      fmt::format("From {:.1f} to {:.1f} mm.", kMillimetres * *least, kMillimetres * *greatest),
      ChartKind::map};
  chart.value_label = "mm";
  if (*least < 0) {
    const double most = kMillimetres * std::max(-*least, *greatest);
    chart.palette = Palette::diverging;
    chart.value_range = {-most, most};
  }
  return chart;
}

std::vector<double> difference(const std::vector<double>& greatest,
                               const std::vector<double>& least) {
  std::vector<double> result(greatest.size());
  std::transform(greatest.begin(), greatest.end(), least.begin(), result.begin(), std::minus<>());
  return result;
}

/// Thicknesses or spacings of prisms in beam order, with their uncertainty: "7 ± 1".
std::string millimetres_text(const sensors::Sensor& sensor, bool thickness) {
  const std::vector<double>& values =
      thickness ? sensor.geometry.thickness : sensor.geometry.spacing;
  std::string text;
  for (const PrismSize& size :
       values.size() > 1 ? own_prism_sizes(sensor.prisms()) : shared_prism_sizes()) {
    if (size.rate.thickness.empty() == thickness) continue;
    text += fmt::format("{}{}", text.empty() ? "" : ", ",
                        kMillimetres * sensors::prism_size(sensor, size));
    const double sigma = sensors::prism_size_sigma(sensor, size);
    if (sigma > 0) text += fmt::format(" ± {}", plain_text(kMillimetres * sigma, 2));
  }
  return text;
}

}  // namespace

std::string beam_origin_page(const BeamOriginMap& map, const sensors::Sensor& sensor,
                             const jobs::Provenance& provenance) {
  Figures figures;
  const std::string head = fmt::format(
      "<p>Prisms {} mm thick with perpendicular faces {} mm apart shift the beam sideways. {} "
      "beams, cells of {} degree.</p>\n",
      millimetres_text(sensor, true), millimetres_text(sensor, false), count_text(map.beams),
      degrees_from_radians(map.cell));
  Sections sections;
  if (map.size() > 0) {
    sections.add("Horizontal (Y)",
                 charts_html({map_chart(map, "Smallest Y of the beam's origin", map.least_y),
                              map_chart(map, "Largest Y of the beam's origin", map.greatest_y),
                              map_chart(map, "Y: largest minus smallest",
                                        difference(map.greatest_y, map.least_y))},
                             figures),
                 Sections::Shown::unfolded);
    sections.add("Vertical (Z)",
                 charts_html({map_chart(map, "Smallest Z of the beam's origin", map.least_z),
                              map_chart(map, "Largest Z of the beam's origin", map.greatest_z),
                              map_chart(map, "Z: largest minus smallest",
                                        difference(map.greatest_z, map.least_z))},
                             figures),
                 Sections::Shown::unfolded);
  }
  sections.add(kHowToRepeat, provenance_html(provenance));
  return page_html("Where beams start: " + sensor.name,
                   "Distance across the optical axis from the origin of the sensor's frame to the "
                   "point where the beam leaves the last prism, over the field of view.",
                   head, sections, figures);
}

}  // namespace risley::report
