// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include "risley/core/progress.hpp"
#include "risley/identification/identify.hpp"
#include "risley/identification/shot_grid.hpp"
#include "risley/identification/train_fit.hpp"

namespace risley::identification {

/// First row at or after a time, s.
std::size_t row_at(const ShotGrid& grid, double time);

/// Effective number of independent shots, given correlated neighbouring residuals.
double correlation_factor(const TrainFit& fit);

/// Difference of the two fits' chi squared, in units of the better one's residual.
double chi2_excess(const TrainFit& worse, const TrainFit& better);

/// A model of part of a grid, fitted to all of it with that description of the rotors' motion.
std::optional<TrainFit> fit_whole(const ShotGrid& grid, const TrainModel& model,
                                  const TrainFreedom& freedom, const Motion& motion, int iterations,
                                  const Progress& progress);

/// Chooses the description of the rotors' motion by evidence: from long segments to short ones,
/// until two in a row are worse; then the same with jumps between them.
Motion choose_motion(const ShotGrid& grid, const TrainModel& model, const TrainFreedom& freedom,
                     const Progress& progress);

}  // namespace risley::identification
