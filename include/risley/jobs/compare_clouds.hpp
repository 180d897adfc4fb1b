// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "risley/cloud/surface_change.hpp"
#include "risley/core/progress.hpp"

namespace risley::jobs {

/// The clouds to compare, and the settings.
struct CompareCloudsOptions {
  std::string a, b;  ///< paths of clouds in LAS, the earlier one first
  cloud::ChangeOptions change;
};

/// Changes between two clouds.
struct ComparedClouds {
  std::string a, b;  ///< as the options have them
  cloud::ChangeOptions options;
  std::size_t points_a = 0, points_b = 0;  ///< of the whole clouds
  cloud::SurfaceChange change;
};

/// Whether all names are clouds for compare_clouds(), and not results.
/// @throws InvalidArgument for clouds beside results, and for more or less than two clouds;
///         FileError
bool are_clouds(const std::vector<std::string>& names);

/// @throws InvalidArgument, FileError, Cancelled
ComparedClouds compare_clouds(const CompareCloudsOptions& options, const Progress& progress = {});

}  // namespace risley::jobs
