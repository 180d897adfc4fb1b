// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/report/change_page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "risley/core/median.hpp"
#include "risley/core/text.hpp"
#include "risley/report/html.hpp"
#include "risley/report/page_parts.hpp"
#include "risley/report/point_viewer.hpp"

namespace risley::report {
namespace {

using cloud::SurfaceCell;
using jobs::ComparedClouds;

/// Level of detection of a share of the cells, m.
double detection_at(const ComparedClouds& compared, double share) {
  std::vector<double> levels;
  for (const SurfaceCell& cell : compared.change.cells) {
    levels.push_back(compared.change.critical * cell.sigma);
  }
  return quantile(levels, share);
}

std::string share_text(const ComparedClouds& compared) {
  return fmt::format("{:.1f} %", 100 * compared.change.significant);
}

PointViewer viewer_of(const ComparedClouds& compared) {
  const std::vector<SurfaceCell>& cells = compared.change.cells;
  const Eigen::Vector3d origin = cells.front().place.array().round();
  std::array<std::vector<float>, 3> place;
  std::vector<float> distance, levels, detection;
  for (const SurfaceCell& cell : cells) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      place[static_cast<std::size_t>(axis)].push_back(
          static_cast<float>(cell.place[axis] - origin[axis]));
    }
    const double level = compared.change.critical * cell.sigma;
    distance.push_back(static_cast<float>(kMillimetres * cell.distance));
    levels.push_back(static_cast<float>(cell.distance / level));
    detection.push_back(static_cast<float>(kMillimetres * level));
  }
  PointsToView view{
      {"x", "y", "z"}, {origin.x(), origin.y(), origin.z()}, place[0], place[1], place[2]};
  const double widest = std::max(1.0, 3 * kMillimetres * detection_at(compared, 0.5));
  view.colourings = {
      colouring_between("distance over the level of detection (beyond ±1: changed)", levels,
                        {-3, 3}, Palette::diverging),
      colouring_between("distance, mm", distance, {-widest, widest}, Palette::diverging),
      colouring_between("level of detection, mm", detection,
                        {0, kMillimetres * detection_at(compared, 0.98)})};
  view.height_at = view.colourings.size();
  view.dot = compared.options.cell;
  view.words = change_words(compared) + ".";
  view.note = fmt::format("Each of the {} dots is a cell.", count_text(cells.size()));
  return PointViewer(view);
}

std::string changed_html(const ComparedClouds& compared) {
  std::vector<const SurfaceCell*> changed;
  for (const SurfaceCell& cell : compared.change.cells) {
    if (cell.significant) changed.push_back(&cell);
  }
  if (changed.empty()) return "<p>No cell has changed beyond the level of detection.</p>\n";
  constexpr std::size_t kMostRows = 50;
  std::ranges::sort(changed, [](const SurfaceCell* a, const SurfaceCell* b) {
    return std::abs(a->distance / a->sigma) > std::abs(b->distance / b->sigma);
  });
  std::string html =
      "<div class=\"wide\"><table><thead><tr><th>x, m</th><th>y, m</th><th>z, m</th><th>distance, "
      "mm</th><th>± σ, mm</th><th>in sigmas</th></tr></thead><tbody>\n";
  for (std::size_t i = 0; i < std::min(kMostRows, changed.size()); ++i) {
    const SurfaceCell& cell = *changed[i];
    html += fmt::format(
        "<tr><td>{:.2f}</td><td>{:.2f}</td><td>{:.2f}</td><td>{:.1f}</td><td>{:.1f}</td><td>{:.1f}"
        "</td></tr>\n",
        cell.place.x(), cell.place.y(), cell.place.z(), 1e3 * cell.distance, 1e3 * cell.sigma,
        cell.distance / cell.sigma);
  }
  return html + "</tbody></table></div>\n" +
         (changed.size() > kMostRows
              ? fmt::format("<p class=\"note\">The {} surest of {} cells.</p>\n", kMostRows,
                            count_text(changed.size()))
              : "");
}

}  // namespace

std::string change_words(const ComparedClouds& compared) {
  const cloud::SurfaceChange& change = compared.change;
  return fmt::format(
      "{} of {} cells of {:g} m have changed beyond the level of detection ({:g} % would by "
      "chance), which is {:.1f} mm for half of the cells, {:.1f} mm for 95 %",
      share_text(compared), grouped(change.cells.size()), compared.options.cell,
      100 * compared.options.false_alarm, 1e3 * detection_at(compared, 0.5),
      1e3 * detection_at(compared, 0.95));
}

std::string change_page(const ComparedClouds& compared, const jobs::Provenance& provenance) {
  const cloud::SurfaceChange& change = compared.change;
  Figures figures;
  std::string head = overview_html(
      {{share_text(compared), "of the cells have changed beyond the level of detection"},
       {fmt::format("{:.1f} mm", 1e3 * detection_at(compared, 0.5)), "level of detection, median"},
       {count_text(change.cells.size()), "cells with a distance"}},
      std::vector<Chart>{}, figures);
  head += care_html(change.warnings);
  Sections sections;
  sections.add("Cells that have changed", changed_html(compared), Sections::Shown::unfolded);
  sections.add(
      "What was compared",
      fmt::format("<p>{} points of {} and {} of {}. Cells with too few points in one of them: {}; "
                  "cells that are not a surface: {}; common factors of one calibration in both, "
                  "which mostly cancel: {}. Distances are along the normals of the first "
                  "cloud.</p>\n",
                  count_text(compared.points_a), escape_html(compared.a),
                  count_text(compared.points_b), escape_html(compared.b), count_text(change.unseen),
                  count_text(change.uneven), change.shared));
  sections.add(kHowToRepeat, provenance_html(provenance));
  const PointViewer viewer = viewer_of(compared);
  return page_html("Change of a surface", change_words(compared) + ".", head, sections, figures,
                   &viewer);
}

}  // namespace risley::report
