// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "risley/json/results.hpp"
#include "risley/simulation/truth_file.hpp"

namespace risley::json {
namespace {

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }

}  // namespace

Json of(const simulation::SimulationResult& simulated) {
  Json truth = Json::object();
  for (const sensors::NamedValue& value : simulation::true_values(simulated)) {
    truth[value.name] = value.value;
  }
  Json json = {{"observations", simulated.observations},
               {"no_return", simulated.no_return},
               {"output", simulated.files.front()},
               {"truth_files", simulated.truth_files},
               {"files", simulated.files},
               {"truth", truth}};
  if (simulated.trajectory.empty()) return json;
  json["trajectory"] = simulated.trajectory;
  json["strips"] = Json::array();
  for (const trajectories::StripTimes& strip : simulated.strips) {
    json["strips"].push_back({{"name", strip.name},
                              {"begin_s", seconds(strip.begin_ns)},
                              {"end_s", seconds(strip.end_ns)}});
  }
  return json;
}

}  // namespace risley::json
