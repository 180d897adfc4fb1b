// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/sensors/sensor.hpp"

#include <nlohmann/json.hpp>

#include "risley/json/results.hpp"

namespace risley::json {
Json of(const sensors::Sensor& sensor) {
  return {{"name", sensor.name},
          {"model", sensor.model},
          {"face_order", to_string(sensor.train.face_order())},
          {"prisms", sensor.prisms()},
          {"emitters", sensor.train.emitters()}};
}

}  // namespace risley::json
