// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/estimation/emitters_in_turn.hpp"
#include "risley/recordings/reader.hpp"
#include "risley/sensors/sensor.hpp"

namespace risley::estimation {

/// Evidence of the rotors on the count of a recording's shots.
struct ShotCount {
  /// The rotors could be followed; otherwise nothing is known.
  bool followed = false;
  /// Errors of the count, in ascending order.
  std::vector<recordings::ShotSlip> slips;
  /// Emitter of shots 0, 1, ... of the corrected count, one entry per emitter; empty if the file
  /// names the emitters or there is only one.
  std::vector<std::uint8_t> firing_order;
};

/// Finds slips of the shot count: where shots are missing from a recording, every later time is too
/// early, and the phases of all rotors jump by the same time, which no motor does. The rotors are
/// followed from a stretch without slips in both directions; when they leave their prediction, the
/// number of shots that restores it is searched. If it cannot be found, the recording must be cut.
/// docs/theory/slips.md
/// @throws InvalidArgument for columns of different lengths, a shot rate not above 0
ShotCount find_slips(const CountedShots& shots, const sensors::Sensor& sensor,
                     const Progress& progress = {});

}  // namespace risley::estimation
