// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include "risley/scenes/furniture.hpp"
#include "risley/scenes/terrain.hpp"

namespace risley::scenes {

/// Replaces what a ray met so far where it meets this box or person before; with neither, within
/// kFarthestHit. A ray that begins within one ends at its inner side.
/// @param surface  its number in the scene
void meet_box(const SceneBox& box, std::size_t surface, const Vector3<double>& origin,
              const Vector3<double>& direction, std::optional<Hit>& nearest);
/// @param time  s
void meet_person(const Person& person, std::size_t surface, const Vector3<double>& origin,
                 const Vector3<double>& direction, double time, std::optional<Hit>& nearest);

}  // namespace risley::scenes
