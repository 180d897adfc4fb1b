// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/io/yaml_map.hpp"
#include "risley/scenes/terrain.hpp"

#include "scenes/scene_fields.hpp"

namespace risley::scenes {

/// The terrain of a scene file.
/// @param map    the section
/// @param names  of the scene's planes; those of the terrain are added
/// @throws FileError with the line
Terrain read_terrain(const io::YamlMap& map, Names& names);

}  // namespace risley::scenes
