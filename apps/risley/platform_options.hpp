// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/CLI.hpp>

#include "risley/jobs/moving_platform.hpp"

namespace risley::app {

/// Options that say how a sensor moved: trajectory, mount, and how wrong the trajectory may be.
void add_platform_options(CLI::App& verb, jobs::PlatformFiles& files);

}  // namespace risley::app
