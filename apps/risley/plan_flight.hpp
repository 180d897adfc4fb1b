// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/moving_platform.hpp"
#include "risley/jobs/plan_flight.hpp"

#include "command.hpp"

namespace risley::app {

/// @param options  except those read from the files
/// @param plan      file
/// @param platform  mount and the errors of the trajectory; other members must be empty
/// @param scene     file of a terrain; may be empty
/// @param page      to write; may be empty
ExitStatus run_flight_plan(jobs::PlanFlightOptions options, const std::string& plan,
                           const jobs::PlatformFiles& platform, const std::string& scene,
                           const std::string& page, const CommonOptions& common);

}  // namespace risley::app
