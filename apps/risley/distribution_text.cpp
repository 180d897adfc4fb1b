// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "distribution_text.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "table.hpp"

namespace risley::app {
namespace {

using cloud::PointDistributionSummary;
using cloud::StripDistribution;

Json strip_json(const StripDistribution& s) {
  Json places = Json::object(), densities = Json::array();
  for (std::size_t k = 0; k < s.place_density.size(); ++k) {
    places[fmt::format("{:g}", cloud::kSwathPlaces[k])] = number_or_null(s.place_density[k]);
  }
  Json largest = Json::array();
  for (const double diameter : s.largest_empty) largest.push_back(number_or_null(diameter));
  return {{"strip", s.strip},
          {"name", s.name},
          {"points", s.points},
          {"length_m", s.length},
          {"height_m", number_or_null(s.height)},
          {"swath_m", s.width},
          {"dense_swath_m", number_or_null(s.dense_width)},
          {"nominal_density_per_m2", number_or_null(s.density)},
          {"nominal_spacing_m", number_or_null(s.spacing)},
          {"middle_density_per_m2", number_or_null(s.middle_density)},
          {"density_at_share_of_half_swath_per_m2", places},
          {"cell_variation", number_or_null(s.cell_variation)},
          {"cells_covered", number_or_null(s.cells_covered)},
          {"spacing_cells_covered", number_or_null(s.spacing_cells_covered)},
          {"empty_share", number_or_null(s.empty_share)},
          {"largest_empty_m", largest},
          {"seen_in_full_m2", s.whole_ground},
          {"circles_looked_for_m2", s.circles_ground},
          {"profile",
           {{"stripe_m", s.profile.stripe},
            {"across_m", s.profile.across},
            {"density_per_m2", s.profile.density}}}};
}

std::string number(const char* format, double value) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : "-";
}

}  // namespace

Json distribution_json(const PointDistributionSummary& d) {
  Json strips = Json::array();
  for (const StripDistribution& strip : d.strips) strips.push_back(strip_json(strip));
  return {{"empty_circle_m", d.empty_circle},
          {"density_cell_m", d.density_cell},
          {"points", d.points},
          {"points_of_no_strip", d.other_points},
          {"area_m2", d.area},
          {"aggregate_density_per_m2", number_or_null(d.density)},
          {"aggregate_spacing_m", number_or_null(d.spacing)},
          {"low_density_per_m2", number_or_null(d.low_density)},
          {"median_density_per_m2", number_or_null(d.median_density)},
          {"cells_covered", number_or_null(d.covered)},
          {"overlap", number_or_null(d.overlap)},
          {"strips", strips}};
}

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
      "spacing with a point; empty: places about which a circle of {:g} m holds no point\n",
      d.empty_circle);
  say("all strips: {} points per m2 (ANPD), {} m apart (ANPS), on {:.0f} m2; {} % of its cells of "
      "{:g} m hold a point, {} % points of several\n",
      number("{:.1f}", d.density), number("{:.3f}", d.spacing), d.area,
      number("{:.1f}", 100 * d.covered), d.density_cell, number("{:.1f}", 100 * d.overlap));
}

}  // namespace risley::app
