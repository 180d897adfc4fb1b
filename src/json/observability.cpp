// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/observability.hpp"

#include <cmath>

#include "risley/json/results.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

/// Null for one emitter.
Json emitters_json(const estimation::EmitterComparison& emitters, TrainShape shape) {
  if (emitters.bounds.empty()) return nullptr;
  Json parameters = Json::object(), untold = Json::array();
  for (const auto& bounds : emitters.bounds) {
    const double unit = find_parameter(bounds.name, shape).si_per_unit;
    parameters[bounds.name] = {{"sigma", number_or_null(bounds.all / unit)},
                               {"sigma_directions_known", number_or_null(bounds.known / unit)},
                               {"sigma_alone", number_or_null(bounds.alone / unit)}};
  }
  for (const auto& weak : emitters.untold_alone) untold.push_back(weak_direction_json(weak));
  return {{"count", emitters.emitters},
          {"alone", emitters.alone + 1},
          {"parameters", parameters},
          {"unobservable_alone", untold}};
}

}  // namespace

Json of(const jobs::JudgedObservability& judged) {
  const estimation::Observability& o = judged.observability;
  const TrainShape shape = judged.shape;
  Json parameters = Json::object(), matrix = Json::array(), unobservable = Json::array();
  for (const auto& quantity : o.quantities) {
    const double unit = find_parameter(quantity.name, shape).si_per_unit;
    Json one = {{"sigma", number_or_null(quantity.sigma / unit)},
                {"sensitivity", deg(quantity.sensitivity) * unit},
                {"free", quantity.free},
                {"most_correlated", quantity.twins.front().first},
                {"correlation", quantity.twins.front().second}};
    parameters[quantity.name] = one;
  }
  for (Eigen::Index i = 0; i < o.correlation.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < o.correlation.cols(); ++j) row.push_back(o.correlation(i, j));
    matrix.push_back(row);
  }
  for (const auto& weak : o.unobservable) unobservable.push_back(weak_direction_json(weak));
  return {{"parameters", parameters},
          {"correlation", {{"names", o.correlation_names}, {"matrix", matrix}}},
          {"unobservable", unobservable},
          {"emitters", emitters_json(o.emitters, shape)},
          {"observations", o.shots},
          {"duration_s", o.duration},
          {"rate_hz", o.rate},
          {"frame", nullptr},
          {"slips", nullptr},
          {"words", judged.words},
          {"warnings", of(judged.warnings)}};
}

}  // namespace risley::json
