// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/beam_origin_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "risley/core/angle.hpp"

#include "report/page_parts.hpp"

namespace risley::report {
namespace {

constexpr double kMillimetres = 1e3;
constexpr std::array kColours{"b", "c", "ink", "d", "bad"};

/// One map in classes of equal width.
Chart map_chart(const BeamOriginMap& map, const char* title, const std::vector<double>& values) {
  const auto [least, greatest] = std::minmax_element(values.begin(), values.end());
  const double width = (*greatest - *least) / static_cast<double>(kColours.size());
  Chart chart{title, "azimuth, deg", "zenith, deg", {}, {}, ChartKind::map};
  for (std::size_t k = 0; k < kColours.size(); ++k) {
    const double from = *least + width * static_cast<double>(k);
    chart.series.push_back(
        {fmt::format("{:.1f} to {:.1f} mm", kMillimetres * from, kMillimetres * (from + width)),
         kColours[k],
         SeriesKind::points,
         {},
         {}});
  }
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double place = width > 0 ? (values[i] - *least) / width : 0.0;
    Series& series = chart.series[std::min(static_cast<std::size_t>(place), kColours.size() - 1)];
    series.x.push_back(degrees_from_radians(map.azimuth[i]));
    series.y.push_back(degrees_from_radians(map.zenith[i]));
  }
  return chart;
}

std::vector<double> difference(const std::vector<double>& greatest,
                               const std::vector<double>& least) {
  std::vector<double> result(greatest.size());
  std::transform(greatest.begin(), greatest.end(), least.begin(), result.begin(), std::minus<>());
  return result;
}

}  // namespace

std::string beam_origin_page(const BeamOriginMap& map, const sensors::Sensor& sensor,
                             const std::vector<std::pair<std::string, std::string>>& provenance) {
  Figures figures;
  std::string body = fmt::format(
      "<p>Prisms {} mm thick with perpendicular faces {} mm apart shift the beam sideways. {} "
      "beams, "
      "cells of {} degree.</p>\n",
      kMillimetres * sensor.prism_thickness, kMillimetres * sensor.prism_spacing, map.beams,
      degrees_from_radians(map.cell));
  if (map.size() > 0) {
    body += "<h2>Horizontal (Y)</h2>\n";
    body += figures.add(map_chart(map, "Least Y of the beam's origin", map.least_y));
    body += figures.add(map_chart(map, "Greatest Y of the beam's origin", map.greatest_y));
    body += figures.add(
        map_chart(map, "Y: greatest minus least", difference(map.greatest_y, map.least_y)));
    body += "<h2>Vertical (Z)</h2>\n";
    body += figures.add(map_chart(map, "Least Z of the beam's origin", map.least_z));
    body += figures.add(map_chart(map, "Greatest Z of the beam's origin", map.greatest_z));
    body += figures.add(
        map_chart(map, "Z: greatest minus least", difference(map.greatest_z, map.least_z)));
  }
  body += provenance_html(provenance);
  return page_html(
      "Where beams start: " + sensor.name,
      "How far the point where the beam leaves the last prism lies beside the origin of "
      "the sensor's frame, over its field of view.",
      body, figures);
}

}  // namespace risley::report
