// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/provenance.hpp"
#include "risley/optics/beam_origin_map.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::report {

/// One self-contained HTML page with the maps of [B21 Fig. A1]: least and greatest Y and Z of the
/// beam's origin over the field of view, and their difference.
/// @param provenance  how to reproduce it: name and value pairs
std::string beam_origin_page(const BeamOriginMap& map, const sensors::Sensor& sensor,
                             const jobs::Provenance& provenance);

}  // namespace risley::report
