// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/beam_origins.hpp"
#include "risley/jobs/compare_results.hpp"

#include "json/parts.hpp"

namespace risley::json {

Json of(const jobs::ResultComparison& compared) {
  Json differences = Json::object();
  for (const jobs::ParameterDifference& one : compared.parameters) {
    const bool in_metres = one.name == jobs::kRangeOffset;
    const double unit = in_metres ? 1 : find_parameter(one.name, compared.b.shape()).si_per_unit;
    differences[one.name] = {{"value", one.difference / unit}, {"sigma", one.sigma / unit}};
  }
  return {{"same_unit", compared.same_unit},
          {"directions", pointing_json(compared.beams)},
          {"differences", differences}};
}

Json of(const jobs::BeamOrigins& found) {
  return {{"beams", found.map.beams},
          {"cells", found.map.size()},
          {"y_m", {{"min", found.least_y}, {"max", found.greatest_y}}},
          {"z_m", {{"min", found.least_z}, {"max", found.greatest_z}}}};
}

}  // namespace risley::json
