// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/campaign.hpp"

#include "json/parts.hpp"

namespace risley::json {
namespace {

Json banded_json(const jobs::BandedFigure& figure) {
  return {{"value", number_or_null(figure.value)},
          {"low", number_or_null(figure.low)},
          {"high", number_or_null(figure.high)},
          {"inside", figure.inside()}};
}

Json setting_json(const jobs::SettingSummary& summary) {
  Json grid = Json::object(), parameters = Json::object(), errors = Json::object();
  for (const auto& [name, value] : summary.grid) grid[name] = value;
  for (const jobs::ParameterSummary& one : summary.parameters) {
    const double unit = find_parameter(one.name, summary.shape).si_per_unit;
    parameters[one.name] = {{"cells", one.cells},
                            {"bias", one.bias / unit},
                            {"rmse", one.rmse / unit},
                            {"bound", one.bound / unit},
                            {"sigma", one.sigma / unit},
                            {"error_over_bound", banded_json(one.error_over_bound)},
                            {"within_two_sigma", banded_json(one.within_two_sigma)}};
  }
  for (const jobs::ErrorSummary& one : summary.errors) {
    errors[jobs::name_with_unit(one.name)] = {
        {"cells", one.cells}, {"rmse", deg(one.rms)}, {"sigma", number_or_null(deg(one.sigma))}};
  }
  return {{"grid", grid},
          {"cells", summary.cells},
          {"answered", summary.answered},
          {"error_over_bound", number_or_null(summary.error_over_bound)},
          {"nees_parameters", banded_json(summary.nees)},
          {"nees_rotation_angles", number_or_null(summary.nees_rotation_angles)},
          {"parameters", parameters},
          {"errors", errors}};
}

}  // namespace

Json of(const jobs::CampaignChunk& chunk) {
  return {{"cells", chunk.cells},
          {"done", chunk.cells},
          {"first", chunk.first},
          {"chunk", chunk.file},
          {"made_before", chunk.made_before}};
}

Json of(const jobs::CampaignResult& merged) {
  Json settings = Json::array(), missing = Json::array();
  for (const jobs::SettingSummary& one : merged.settings) settings.push_back(setting_json(one));
  for (const auto& [first, last] : merged.missing) missing.push_back({first, last});
  return {{"cells", merged.cells},           {"done", merged.done},
          {"table", merged.table},           {"missing", missing},
          {"warnings", of(merged.warnings)}, {"settings", settings}};
}

}  // namespace risley::json
