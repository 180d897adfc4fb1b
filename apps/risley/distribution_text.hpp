// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/cloud/point_distribution.hpp"

#include "command.hpp"

namespace risley::app {

Json distribution_json(const cloud::PointDistributionSummary& distribution);
void print_distribution(const cloud::PointDistributionSummary& distribution);

}  // namespace risley::app
