// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstddef>
#include <utility>

#include "risley/jobs/beam_origins.hpp"
#include "risley/jobs/compare_clouds.hpp"
#include "risley/jobs/compare_results.hpp"
#include "risley/jobs/compare_units.hpp"

#include "json/parts.hpp"

namespace risley::json {
Json of(const jobs::ResultComparison& compared) {
  Json differences = Json::object();
  for (const jobs::ParameterDifference& one : compared.parameters) {
    const double unit = jobs::file_unit_of(one.name, compared.b.shape()).si_per_unit;
    differences[one.name] = {{"value", one.difference / unit}, {"sigma", one.sigma / unit}};
  }
  return {{"same_unit", compared.same_unit},
          {"directions", pointing_json(compared.beams)},
          {"differences", differences}};
}

namespace {

Json pair_json(const jobs::ComparedPair& pair, const jobs::ComparedUnits& compared) {
  const jobs::ChangeTest& change = pair.comparison.change;
  Json json = {{"a", compared.results[pair.a]},
               {"b", compared.results[pair.b]},
               {"changed", pair.changed},
               {"p_value", change.degrees_of_freedom > 0 ? Json(change.p_value) : Json(nullptr)},
               {"chi2", change.chi2},
               {"degrees_of_freedom", change.degrees_of_freedom}};
  json.update(of(pair.comparison));
  return json;
}

Json unit_json(const jobs::ComparedUnit& unit, const jobs::ComparedUnits& compared) {
  Json results = Json::array();
  for (const std::size_t result : unit.results) results.push_back(compared.results[result]);
  return {{"serial", unit.serial},
          {"sensor", unit.sensor},
          {"results", std::move(results)},
          {"changed", unit.changed}};
}

Json fleet_json(const jobs::ComparedFleet& one, const jobs::ComparedUnits& compared) {
  const jobs::Fleet& fleet = one.fleet;
  Json parameters = Json::object(), units = Json::array();
  for (const jobs::FleetParameter& parameter : fleet.parameters) {
    const double unit = jobs::file_unit_of(parameter.name, fleet.shape).si_per_unit;
    parameters[parameter.name] = {{"middle", parameter.middle / unit},
                                  {"spread", parameter.spread / unit}};
  }
  for (std::size_t i = 0; i < one.units.size(); ++i) {
    const jobs::ComparedUnit& unit = compared.units[one.units[i]];
    const jobs::FleetUnit& found = fleet.units[i];
    Json robust_z = Json::object();
    for (std::size_t k = 0; k < found.robust_z.size(); ++k) {
      const double z = found.robust_z[k];
      if (std::isfinite(z)) robust_z[fleet.parameters[k].name] = z;
    }
    units.push_back(
        {{"serial", unit.serial},
         {"result", compared.results[unit.results.back()]},
         {"outlier", found.outlier},
         {"p_value", found.tested ? Json(found.p_value) : Json(nullptr)},
         {"worst", found.tested ? Json(fleet.parameters[found.worst].name) : Json(nullptr)},
         {"worst_robust_z", found.tested ? Json(found.worst_z) : Json(nullptr)},
         {"worst_is_combined", found.worst_is_combined},
         {"robust_z", std::move(robust_z)},
         {"directions", pointing_json(found.beams)}});
  }
  return {{"sensor", compared.units[one.units.front()].sensor},
          {"parameters", std::move(parameters)},
          {"units", std::move(units)}};
}

}  // namespace

Json of(const jobs::ComparedUnits& compared) {
  Json pairs = Json::array(), units = Json::array(), fleets = Json::array();
  Json left_out = Json::array();
  for (const jobs::ComparedPair& pair : compared.pairs) pairs.push_back(pair_json(pair, compared));
  for (const jobs::ComparedUnit& unit : compared.units) units.push_back(unit_json(unit, compared));
  for (const jobs::ComparedFleet& fleet : compared.fleets) {
    fleets.push_back(fleet_json(fleet, compared));
  }
  for (const jobs::LeftOut& one : compared.left_out) {
    left_out.push_back({{"input", one.name}, {"reason", one.reason}, {"failed", one.failed}});
  }
  return {{"pairs", std::move(pairs)},           {"units", std::move(units)},
          {"fleets", std::move(fleets)},         {"left_out", std::move(left_out)},
          {"false_alarm", compared.false_alarm}, {"least_p_value", compared.least_p_value}};
}

Json of(const jobs::BeamOrigins& found) {
  return {{"beams", found.map.beams},
          {"cells", found.map.size()},
          {"y_m", {{"min", found.least_y}, {"max", found.greatest_y}}},
          {"z_m", {{"min", found.least_z}, {"max", found.greatest_z}}}};
}

Json of(const jobs::ComparedClouds& compared) {
  const cloud::SurfaceChange& change = compared.change;
  Json cells = Json::array();
  for (const cloud::SurfaceCell& cell : change.cells) {
    cells.push_back({{"place_m", vector_json(cell.place)},
                     {"normal", vector_json(cell.normal)},
                     {"distance_m", cell.distance},
                     {"sigma_m", cell.sigma},
                     {"significant", cell.significant},
                     {"points", {cell.points_a, cell.points_b}}});
  }
  return {{"a", {{"path", compared.a}, {"points", compared.points_a}}},
          {"b", {{"path", compared.b}, {"points", compared.points_b}}},
          {"cell_size_m", compared.options.cell},
          {"reach_m", compared.options.reach},
          {"false_alarm", compared.options.false_alarm},
          {"detection_sigmas", change.critical},
          {"significant", change.significant},
          {"uneven", change.uneven},
          {"unseen", change.unseen},
          {"shared_factors", change.shared},
          {"cells", cells},
          {"warnings", of(change.warnings)}};
}

}  // namespace risley::json
