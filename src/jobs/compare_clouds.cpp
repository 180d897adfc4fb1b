// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/jobs/compare_clouds.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include <fmt/format.h>

#include "risley/cloud/cloud_file.hpp"
#include "risley/core/error.hpp"

namespace risley::jobs {

bool are_clouds(const std::vector<std::string>& names) {
  const auto clouds = std::ranges::count_if(names, [](const std::string& name) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(name, ignored) && cloud::is_las_file(name);
  });
  if (clouds == 0) return false;
  if (names.size() != 2) {
    throw InvalidArgument(fmt::format(
        "{} clouds among {} names, allowed two clouds, or results alone", clouds, names.size()));
  }
  return true;
}

ComparedClouds compare_clouds(const CompareCloudsOptions& options, const Progress& progress) {
  const cloud::CloudFile a(options.a), b(options.b);
  return {options.a, options.b, options.change,
          a.size(),  b.size(),  cloud::surface_change(a, b, options.change, progress)};
}

}  // namespace risley::jobs
