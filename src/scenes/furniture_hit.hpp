// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>

#include "risley/scenes/furniture.hpp"
#include "risley/scenes/terrain.hpp"

namespace risley::scenes {

/// Replaces a ray's previous hit by this box if that is nearer, and within kFarthestHit. A ray that
/// begins within a box ends at its inner side.
/// @param surface  number of the box in the scene
void meet_box(const SceneBox& box, std::size_t surface, const Vector3<double>& origin,
              const Vector3<double>& direction, std::optional<Hit>& nearest);
/// The same for a person. @param time  s
void meet_person(const Person& person, std::size_t surface, const Vector3<double>& origin,
                 const Vector3<double>& direction, double time, std::optional<Hit>& nearest);

}  // namespace risley::scenes
