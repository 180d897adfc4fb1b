// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/free_parameters.hpp"
#include "risley/estimation/normal_equations.hpp"
#include "risley/estimation/rotor_process.hpp"
#include "risley/estimation/rotor_trajectory.hpp"
#include "risley/estimation/weak_directions.hpp"

namespace risley::estimation {

/// How well one parameter of one prism is determined, given what is known of the emitters:
/// Cramer-Rao bounds with the free parameters and this one, SI units; infinite where no such data
/// determine it.
struct EmitterBounds {
  std::string name;
  double all = 0;    ///< all emitters, their directions as free as they are
  double known = 0;  ///< the same shots with the emitters' directions known
  /// As many shots of one emitter alone, with what is free for a sensor that has only one.
  double alone = 0;
};

/// What several emitters behind the same prisms determine and one of them does not.
struct EmitterComparison {
  int emitters = 0;  ///< that fired
  int alone = 0;     ///< the one that is taken alone, from 0: the one nearest to the axis
  std::vector<EmitterBounds> bounds;  ///< each prism's own glass, wedge and tilts
  /// Combinations of free parameters that the shots of one emitter do not determine.
  std::vector<WeakDirection> untold_alone;
};

/// @param series   shots, as accumulate() takes them
/// @param knots    of the series, at the linearisation point
/// @param free     what is free with all emitters
/// @param weights  of single shots
/// @param factor   that all information is multiplied by: shots that one shot stands for
/// @return without bounds where fewer than two emitters fired
/// @throws Cancelled, InvalidArgument as accumulate()
EmitterComparison compare_emitters(const AngleSeries& series, const RotorTrajectory& knots,
                                   const PrismTrain& train, std::span<const RotorProcess> process,
                                   const std::vector<FreeParameter>& free,
                                   const ShotWeights& weights, double factor,
                                   const Progress& progress = {});

/// The same in sentences: which parameters only several emitters determine, which they determine
/// better, and which would be known better if the emitters' directions were known.
std::vector<std::string> emitter_words(const EmitterComparison& comparison);

}  // namespace risley::estimation
