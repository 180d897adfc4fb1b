// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "risley/optics/prism_train.hpp"

// What the kernels of optics are compared with, compiled for the processor that compiles it.
namespace risley::peers {

/// The model of a train of two prisms, PA-AP, as the paper writes it: Eq. (10-26) with Eigen's
/// rotations, one shot at a time.
/// @param a,b              rotation angles [shots], rad
/// @param azimuth,zenith   [shots], rad
void plain_directions(const PrismTrain& train, const double* a, const double* b, std::size_t shots,
                      double* azimuth, double* zenith);

/// Columns of jet_jacobians(): nine errors of the train and two rotation angles.
inline constexpr int kJetColumns = 11;

/// Both angles and their derivatives by forward-mode automatic differentiation of the library's
/// template.
/// @param every_shot  whether every shot gets its parameters anew, as a cost function of Ceres
///                    does, or all share what depends on the parameters alone
/// @param derivatives  nullptr, or where they go [shots][azimuth, zenith][kJetColumns]
/// @return some number made of all results
double jet_jacobians(const PrismTrain& train, const double* a, const double* b, std::size_t shots,
                     bool every_shot, double* derivatives = nullptr);

/// The place of the flat vector that a column belongs to; the two angles have none.
constexpr int jet_place(int column) {
  constexpr int kPlaces[kJetColumns - 2] = {
      place::incident_beam_horizontal(), place::incident_beam_vertical(),
      place::bearing_tilt_horizontal(0), place::bearing_tilt_vertical(0),
      place::prism_tilt_horizontal(0),   place::prism_tilt_vertical(0),
      place::prism_tilt_horizontal(1),   place::prism_tilt_vertical(1),
      place::refractive_index_air()};
  return kPlaces[column];
}

}  // namespace risley::peers
