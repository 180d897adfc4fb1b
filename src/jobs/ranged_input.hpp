// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "risley/calibration/plane_points.hpp"
#include "risley/core/progress.hpp"
#include "risley/estimation/estimate.hpp"
#include "risley/jobs/ranged_input.hpp"

namespace risley::jobs {

/// Callback for an estimate before it is reduced to its shots.
using EstimateTaker = std::function<void(const estimation::Estimate&, const Progress&)>;

/// @throws InvalidArgument for no recordings, one given twice, rate or noise out of range
void check_ranged_input(const RangedInputOptions& options);

/// Each held open.
std::vector<recordings::Source> held_open(std::vector<recordings::Source> sources);

/// Reads one recording, finds its rotation angles, and adds its properties other than the shots to
/// the result. Stages: reading, rotation angles.
/// @throws as read_for_estimation(), estimate(), ranged_recording(); the message names the file
/// @param source  the recording of that number, possibly held open
calibration::RangedRecording read_ranged(recordings::Source source,
                                         const RangedInputOptions& options, std::size_t number,
                                         RangedInput& result, const Progress& progress,
                                         const EstimateTaker& take = {});

}  // namespace risley::jobs
