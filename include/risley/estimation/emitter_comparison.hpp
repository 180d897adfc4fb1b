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

/// How well one parameter of one prism is determined, depending on the knowledge of the emitters:
/// Cramer-Rao bounds with the free parameters and this one, SI units; infinite if no such data
/// determine it.
struct EmitterBounds {
  std::string name;
  double all = 0;    ///< all emitters, with as many free directions as they have
  double known = 0;  ///< the same shots with the emitters' directions known
  /// The same number of shots, all from one emitter, with the free parameters of a sensor with one
  /// emitter.
  double alone = 0;
};

/// Parameters that several emitters behind the same prisms determine and one of them does not.
struct EmitterComparison {
  int emitters = 0;                   ///< that fired
  int alone = 0;                      ///< the single one, from 0: the one nearest to the axis
  std::vector<EmitterBounds> bounds;  ///< each prism's own glass, wedge and tilts
  /// Combinations of free parameters that the shots of one emitter do not determine.
  std::vector<WeakDirection> untold_alone;
};

/// @param series  shots, as for accumulate()
/// @param knots    of the series, at the linearisation point
/// @param free  the free parameters with all emitters
/// @param weights  of single shots
/// @param factor  multiplies all information: number of shots that one shot represents
/// @return without bounds if fewer than two emitters fired
/// @throws Cancelled, InvalidArgument as accumulate()
EmitterComparison compare_emitters(const AngleSeries& series, const RotorTrajectory& knots,
                                   const PrismTrain& train, std::span<const RotorProcess> process,
                                   const std::vector<FreeParameter>& free,
                                   const ShotWeights& weights, double factor,
                                   const Progress& progress = {});

/// The same in sentences: parameters that only several emitters determine, those that they
/// determine better, and those that known emitter directions would improve.
std::vector<std::string> emitter_words(const EmitterComparison& comparison);

}  // namespace risley::estimation
