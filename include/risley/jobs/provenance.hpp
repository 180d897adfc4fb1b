// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "risley/core/progress.hpp"
#include "risley/recordings/source.hpp"

namespace risley::jobs {

/// Name and value pairs such as command, version, seed, input_sha256: how to make a result again.
using Provenance = std::vector<std::pair<std::string, std::string>>;

/// Appends name and SHA-256 of every input: "input", "input_sha256", "input_2", ...; of a folder of
/// ROS 2 those of each of its files, of columns in memory the name alone.
/// @throws FileError, Cancelled
Provenance with_inputs(Provenance provenance, const std::vector<recordings::Source>& inputs,
                       const Progress& progress = {});

}  // namespace risley::jobs
