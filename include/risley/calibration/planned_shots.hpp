// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "risley/calibration/flight_shots.hpp"
#include "risley/core/progress.hpp"
#include "risley/scenes/terrain.hpp"
#include "risley/sensors/sensor.hpp"
#include "risley/trajectories/flight_plan.hpp"
#include "risley/trajectories/mount.hpp"

namespace risley::calibration {

/// A planned flight: a sensor on its mount follows the strips of a plan over a terrain. The values
/// of sensor and mount are the true ones.
struct PlannedFlight {
  sensors::Sensor sensor;
  trajectories::Mount mount;
  trajectories::FlightPlan plan;  ///< on the map of the terrain; its location does not matter
  scenes::TerrainParts terrain;
};

/// Some shots of a planned flight that end on the terrain.
struct PlannedPiece {
  FlightShots shots;            ///< strips from 0; ranges without noise, with the sensor's offset
  std::vector<double> x, y, z;  ///< their end points, on the map, m
  std::uint64_t fired = 0;      ///< of them, and of those that miss the terrain
};

/// Selection of a planned flight's shots, and their random numbers.
struct PlannedShotsOptions {
  /// Shots per second: chosen by chance among the sensor's, since every n-th would beat with the
  /// rotors. Empty: all of them.
  std::optional<double> rate;
  std::uint64_t seed = 0;
};

/// The flight of a plan with its times and places on the terrain's map, free of errors.
/// @throws InvalidArgument as require_flight_plan
trajectories::Flight flown(const PlannedFlight& planned);

/// Calls a function with the shots of all strips, in time order: rotors at constant speed, no
/// noise, no errors of the trajectory.
/// @param flight  of the same plan, see flown()
/// @throws InvalidArgument as require_flight_plan, require_mount, scenes::Terrain, for a sensor
/// without prisms or speeds and for a rate not above 0 or above the sensor's; Cancelled, and
/// exceptions of the function
void for_each_planned_piece(const PlannedFlight& planned, const trajectories::Flight& flight,
                            const PlannedShotsOptions& options,
                            const std::function<void(PlannedPiece&)>& function,
                            const Progress& progress = {});

}  // namespace risley::calibration
