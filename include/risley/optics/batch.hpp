// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "risley/core/instruction_set.hpp"
#include "risley/optics/beam_origin.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley {

/// Columns that a batch evaluation fills. Every non-empty span must hold one value per shot; an
/// empty one is not computed.
struct DirectionColumns {
  std::span<double> x, y, z;          ///< unit vector, sensor frame
  std::span<double> azimuth, zenith;  ///< rad
  /// Where the beam leaves the last face, m, sensor frame: all three or none.    [B21 App. A]
  std::span<double> origin_x{}, origin_y{}, origin_z{};
  PrismGeometry geometry{};  ///< of the prisms, for the origin
};

/// Directions of many shots of one train. A shot that does not get through is NaN in every column.
/// @param rotation_angles  one column per prism in beam order, rad, all of the same length. Of any
///                         number of turns; a batch with an angle beyond 1e6 rad takes longer
/// @param beam  number of each shot's emitter, counted from 0; empty: all the first
/// @param set              instruction set, for tests and benchmarks; default the best available
/// @return number of shots that are not valid
/// @throws InvalidArgument when column counts or lengths differ, for a beam that the train does not
///         have, and as check_shape(), face_positions() and check_available()
std::size_t observe_batch(const PrismTrain& train,
                          std::span<const std::span<const double>> rotation_angles,
                          const DirectionColumns& out, std::span<const std::uint8_t> beam = {},
                          InstructionSet set = best_instruction_set());

/// @param beam   empty, or one number per shot, counted from 0
/// @throws InvalidArgument for another length or a beam that the train does not have, naming its
///         row
void check_beams(const PrismTrain& train, std::span<const std::uint8_t> beam, std::size_t shots);

/// Azimuth, zenith and their gradients for many shots: first by the flat parameters, those of all
/// emitters included, then by the rotation angles. An empty column of a gradient is not computed.
struct LinearisationColumns {
  std::span<double> azimuth, zenith;                   ///< [shots], rad
  std::vector<std::span<double>> d_azimuth, d_zenith;  ///< [parameter_count(shape) + prisms][shots]
};

/// As observe_batch, with derivatives.
/// @throws InvalidArgument as observe_batch(), and when azimuth, zenith or the place of a column is
///         missing
std::size_t linearise_batch(const PrismTrain& train,
                            std::span<const std::span<const double>> rotation_angles,
                            const LinearisationColumns& out,
                            std::span<const std::uint8_t> beam = {},
                            InstructionSet set = best_instruction_set());

}  // namespace risley
