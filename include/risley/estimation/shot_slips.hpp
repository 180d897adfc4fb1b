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

/// What the rotors say of the count of a recording's shots.
struct ShotCount {
  /// The rotors could be followed; otherwise nothing is known.
  bool followed = false;
  /// Where the count is wrong, in ascending order.
  std::vector<recordings::ShotSlip> slips;
  /// Emitter of shots 0, 1, ... of the mended count, one entry per emitter; empty where the file
  /// names the emitters or there is only one.
  std::vector<std::uint8_t> firing_order;
};

/// Finds slips of the shot count: where shots are missing from a recording, every later time is too
/// early, and the phases of all rotors jump by the same time, which no motor does. The rotors are
/// followed from a stretch without slips in both directions; where they leave their prediction, the
/// number of shots that brings them back is looked for. Where it cannot be found, the recording is
/// to be cut. docs/theory/slips.md
/// @throws InvalidArgument for columns of different lengths, a shot rate that is not above 0
ShotCount find_slips(const CountedShots& shots, const sensors::Sensor& sensor,
                     const Progress& progress = {});

}  // namespace risley::estimation
