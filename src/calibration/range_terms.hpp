// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <vector>

#include "risley/calibration/planar_adjustment.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::calibration {

/// The range errors in addition to the constant one that walls can determine, with their priors:
/// from the preset, or else 20 mm near the sensor, 0.3 of a footprint's depth, 10 mm per decade of
/// intensity and 10 mm between emitters.
/// @param intensities  whether shots have them
std::vector<RangeTerm> range_terms_of(const sensors::Sensor& sensor, bool intensities);

/// Inputs of one shot's range errors. The range is the predicted one: the noise of a measured one
/// would be in the term as in the residual, and bias it.
struct TermShot {
  Vector3<double> direction, normal;  ///< of beam and plane, unit vectors, sensor frame
  double range = 0;                   ///< m
  double intensity = -1;              ///< as reported; negative: not known
  int beam = 0;                       ///< emitter, from 0
};

/// @param origin, direction  of the shot's beam
TermShot term_shot(const RangedShots& shots, std::size_t shot, const Vector3<double>& origin,
                   const Vector3<double>& direction, const Plane& plane);

/// d range / d term of one shot.
double range_share(const PlanarProblem& problem, const RangeTerm& term, const TermShot& shot);

/// All range errors of one shot in a problem, including the constant one, m.
double range_error(const PlanarProblem& problem, const TermShot& shot);

/// The share that every shot of a view has in each of a problem's terms.
void fill_range_terms(const PlanarProblem& problem, std::size_t view, RangedShots& shots);

/// Prior knowledge of the sizes of a sensor's prisms.
std::vector<SizePrior> size_priors(const sensors::Sensor& sensor);

/// The same geometry with a value for every prism.
PrismGeometry one_size_each(const PrismGeometry& geometry, int prisms);

}  // namespace risley::calibration
