// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include "risley/optics/beam_origin.hpp"
#include "risley/optics/prism_train.hpp"

namespace risley {

/// Instruction sets the batch kernels exist in; baseline is what the compiler targets by default.
enum class InstructionSet { baseline, avx2, avx512 };

std::string to_string(InstructionSet set);

/// The instruction sets this binary holds and this processor runs, best last.
const std::vector<InstructionSet>& available_instruction_sets();

/// Columns that a batch evaluation fills. Every non-empty span must hold one value per shot; an
/// empty one is not computed.
struct DirectionColumns {
  std::span<double> x, y, z;          ///< unit vector, sensor frame
  std::span<double> azimuth, zenith;  ///< rad
  /// Where the beam leaves the last face, m, sensor frame: all three or none.    [B21 App. A]
  std::span<double> origin_x{}, origin_y{}, origin_z{};
  PrismGeometry geometry{};  ///< of the prisms, for the origin
};

/// Where many shots of one train point. A shot that does not get through is NaN in every column.
/// @param rotation_angles  one column per prism in beam order, rad, all of the same length. The
///                         sines are most accurate below a few thousand turns: pass wrapped angles
/// @param set              instruction set, for tests and benchmarks; default the best available
/// @return number of shots that are not valid
/// @throws InvalidArgument when column counts or lengths differ
std::size_t observe_batch(const PrismTrain& train,
                          std::span<const std::span<const double>> rotation_angles,
                          const DirectionColumns& out);
std::size_t observe_batch(const PrismTrain& train,
                          std::span<const std::span<const double>> rotation_angles,
                          const DirectionColumns& out, InstructionSet set);

/// Azimuth, zenith and their gradients for many shots, columns as in Gradient: first the flat
/// parameters, then the rotation angles.
struct LinearisationColumns {
  std::span<double> azimuth, zenith;                   ///< [shots], rad
  std::vector<std::span<double>> d_azimuth, d_zenith;  ///< [parameter_count + prisms][shots]
};

/// As observe_batch, with derivatives.
std::size_t linearise_batch(const PrismTrain& train,
                            std::span<const std::span<const double>> rotation_angles,
                            const LinearisationColumns& out);
std::size_t linearise_batch(const PrismTrain& train,
                            std::span<const std::span<const double>> rotation_angles,
                            const LinearisationColumns& out, InstructionSet set);

}  // namespace risley
