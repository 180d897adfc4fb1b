// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/cloud/point_distribution.hpp"

namespace risley::app {

void print_distribution(const cloud::PointDistributionSummary& distribution);

}  // namespace risley::app
