// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/CLI.hpp>

#include "risley/jobs/moving_platform.hpp"

namespace risley::app {

/// Options on the sensor's motion: trajectory, mount, and the trajectory's errors.
void add_platform_options(CLI::App& verb, jobs::PlatformFiles& files);

}  // namespace risley::app
