// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "reproduction/reproduce.hpp"

namespace risley::reproduction {

/// One self-contained HTML page: how many rows pass and which do not, then every table with its
/// bounds and reasons, and its diagrams.
/// @param provenance  how to make it again: name and value pairs
std::string reproduction_page(const Reproduction& reproduction,
                              const std::vector<std::pair<std::string, std::string>>& provenance);

}  // namespace risley::reproduction
