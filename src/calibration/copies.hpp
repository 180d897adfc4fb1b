// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "risley/calibration/plane_points.hpp"

namespace risley::calibration {

/// Rejects recordings that hold the same shots, whatever their formats and times: counted twice,
/// they would make every sigma too small. Rotors that turn freely do not return to the same angles
/// with the same ranges.
/// @throws InvalidArgument for a recording nine tenths of which are in another one
void require_no_copies(const std::vector<RangedRecording>& recordings);

}  // namespace risley::calibration
