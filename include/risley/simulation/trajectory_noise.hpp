// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "risley/trajectories/error_process.hpp"
#include "risley/trajectories/trajectory.hpp"

namespace risley::simulation {

/// The user's version of a true trajectory: positions moved along north, east and up, and bodies
/// turned about north, east and down at their place, by errors of the model (stated minus true).
/// Gauss-Markov parts begin in their steady state at the first record. Accuracies are those of the
/// model, white parts included, and velocities stay true. Same seed, same bits.
/// @throws InvalidArgument as trajectories::ErrorProcess
trajectories::Trajectory with_errors(const trajectories::Trajectory& truth,
                                     const trajectories::ErrorModel& model, std::uint64_t seed);

}  // namespace risley::simulation
