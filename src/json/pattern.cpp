// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "risley/core/angle.hpp"
#include "risley/jobs/write_pattern.hpp"
#include "risley/json/results.hpp"
#include "risley/sensors/pattern_coverage.hpp"

#include "json/parts.hpp"

namespace risley::json {
Json of(const sensors::PatternCoverage& coverage) {
  Json after = Json::array();
  for (const sensors::CoverageAfter& one : coverage.after) {
    Json rings = Json::array();
    for (const double density : one.ring_density) rings.push_back(density * kSquareDegree);
    after.push_back(
        {{"time_s", one.time},
         {"shots", one.shots},
         {"covered", one.covered},
         {"density_per_deg2",
          {{"mean", one.mean_density * kSquareDegree},
           {"min", one.least_density * kSquareDegree},
           {"max", one.greatest_density * kSquareDegree}}},
         {"density_per_sr", {{"mean", one.mean_density}}},
         {"gap_deg", deg(one.gap)},
         {"gap_at", {{"azimuth_deg", deg(one.gap_azimuth)}, {"zenith_deg", deg(one.gap_zenith)}}},
         {"ring_density_per_deg2", rings}});
  }
  Json covers = Json::object();
  for (const int percent : sensors::kToldShares) {
    covers[fmt::format("{}", percent)] = coverage.time_to_cover(0.01 * percent);
  }
  Json field = {{"after_s", coverage.field_after},
                {"deg2", coverage.field_solid_angle / kSquareDegree},
                {"sr", coverage.field_solid_angle},
                {"half_angle_deg", deg(coverage.field_half_angle)}};
  if (coverage.all_around) {
    field["elevation_deg"] = {{"min", 90 - deg(coverage.field_half_angle)},
                              {"max", 90 - deg(coverage.field_inner_angle)}};
  }
  return {{"cell_deg", deg(coverage.cell)},
          {"ring_deg", deg(coverage.ring)},
          {"field_of_view", field},
          {"time_to_cover_s", covers},
          {"after", after}};
}

Json of(const jobs::WrittenPattern& written) {
  Json json = {{"rows", written.rows},
               {"blocked", written.blocked},
               {"sensor", written.sensor},
               {"format", written.format},
               {"firing", written.firing},
               {"output", written.output},
               {"not_carried", written.not_carried}};
  if (written.helios) {
    json["residual"] = {{"rms_deg", deg(written.helios->rms)},
                        {"worst_deg", deg(written.helios->worst)},
                        {"shots", written.helios->compared},
                        {"time_lag_s", written.helios->time_lag},
                        {"turn_deg",
                         {{"y", deg(written.helios->turn[0])},
                          {"x", deg(written.helios->turn[1])},
                          {"z", deg(written.helios->turn[2])}}}};
  }
  return json;
}

}  // namespace risley::json
