// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/beam_origins.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/compare_series.hpp"

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

Json of(const jobs::ComparedSeries& series) {
  Json pairs = Json::array();
  for (const jobs::ComparedPair& pair : series.pairs) {
    const jobs::ChangeTest& change = pair.comparison.change;
    Json one = {{"a", series.results[pair.a]},
                {"b", series.results[pair.b]},
                {"changed", pair.changed},
                {"p_value", change.degrees_of_freedom > 0 ? Json(change.p_value) : Json(nullptr)},
                {"chi2", change.chi2},
                {"degrees_of_freedom", change.degrees_of_freedom}};
    one.update(of(pair.comparison));
    pairs.push_back(std::move(one));
  }
  return {{"pairs", pairs},
          {"false_alarm", series.false_alarm},
          {"least_p_value", series.least_p_value}};
}

Json of(const jobs::BeamOrigins& found) {
  return {{"beams", found.map.beams},
          {"cells", found.map.size()},
          {"y_m", {{"min", found.least_y}, {"max", found.greatest_y}}},
          {"z_m", {{"min", found.least_z}, {"max", found.greatest_z}}}};
}

}  // namespace risley::json
