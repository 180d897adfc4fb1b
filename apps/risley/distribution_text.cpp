// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "distribution_text.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "command.hpp"
#include "table.hpp"

namespace risley::app {
namespace {

using cloud::PointDistributionSummary;
using cloud::StripDistribution;

std::string number(const char* format, double value) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

}  // namespace

void print_distribution(const PointDistributionSummary& d) {
  Table table({"strip", "swath m", "density 1/m2", "spacing m", "middle", "0.5 R", "0.9 R", "edge",
               "dense m", "variation", "squares %", "empty %", "largest m"});
  constexpr std::size_t kHalf = 1, kOuter = 3, kEdge = 5;
  for (const StripDistribution& s : d.strips) {
    table.add(
        {s.name.empty() ? fmt::format("{}", s.strip) : s.name, number("{:.1f}", s.width),
         number("{:.0f}", s.density), number("{:.3f}", s.spacing),
         number("{:.0f}", s.middle_density), number("{:.0f}", s.place_density[kHalf]),
         number("{:.0f}", s.place_density[kOuter]), number("{:.0f}", s.place_density[kEdge]),
         number("{:.1f}", s.dense_width), number("{:.2f}", s.cell_variation),
         number("{:.1f}", 100 * s.spacing_cells_covered), number("{:.2f}", 100 * s.empty_share),
         number("{:.2f}", *std::max_element(s.largest_empty.begin(), s.largest_empty.end()))});
  }
  table.print();
  say("\nR: half the swath; dense: width with at least half the density; squares: of twice the "
      "spacing with a point; empty: places with no point within a circle of {:g} m\n",
      d.empty_circle);
  say("all strips: {} points per m2 (ANPD), {} m apart (ANPS), on {:.0f} m2; {} % of its cells of "
      "{:g} m hold a point, {} % points of several\n",
      number("{:.1f}", d.density), number("{:.3f}", d.spacing), d.area,
      number("{:.1f}", 100 * d.covered), d.density_cell, number("{:.1f}", 100 * d.overlap));
}

}  // namespace risley::app
