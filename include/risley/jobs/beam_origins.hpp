// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/optics/beam_origin_map.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::jobs {

/// Origins of a sensor's beams, on the paper's grids. [B21 App. A, Fig. A1]
struct BeamOrigins {
  BeamOriginMap map;
  double least_y = 0, greatest_y = 0, least_z = 0, greatest_z = 0;  ///< over the whole field, m
};

/// @throws EstimationError when no beam gets through the prisms
BeamOrigins beam_origins(const sensors::Sensor& sensor);

}  // namespace risley::jobs
