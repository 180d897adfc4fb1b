// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/estimation/weak_directions.hpp"

#include "command.hpp"

namespace risley::app {

/// {"direction": {NAME: weight}, "ratio", "sigma"}.
Json weak_direction_json(const estimation::WeakDirection& direction);

}  // namespace risley::app
