// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "risley/estimation/packet_places.hpp"

namespace risley::estimation {

/// Places that need no model of the sensor: all of complete packets and, for a single emitter,
/// those of runs of shots that continue smoothly from the end of a packet to the beginning of the
/// next. All others are recordings::kNoPlace.
/// @param shot_rate  within packets, Hz
std::vector<std::uint8_t> evident_places(const PacketShots& shots, double shot_rate, int emitters);

}  // namespace risley::estimation
