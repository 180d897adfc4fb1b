// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "observability_text.hpp"

namespace risley::app {

Json weak_direction_json(const estimation::WeakDirection& direction) {
  Json weights = Json::object();
  for (const auto& [name, weight] : direction.weights) weights[name] = weight;
  return {{"direction", weights}, {"ratio", direction.ratio}, {"sigma", direction.sigma}};
}

}  // namespace risley::app
