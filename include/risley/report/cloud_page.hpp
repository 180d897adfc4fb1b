// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>

#include "risley/cloud/make_cloud.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// Most points on a page of a cloud: some 5 bytes of the page each.
inline constexpr std::size_t kCloudPagePoints = 6'000'000;

/// One self-contained HTML page of a point cloud: a viewer of the points, their uncertainty and its
/// causes, and the shots without a point.
/// @param cloud       with a sample of its points
/// @param recording  its source
/// @param provenance  how to reproduce it: name and value pairs
/// @throws InvalidArgument for a cloud without a sample
std::string cloud_page(const cloud::CloudSummary& cloud, const std::string& recording,
                       const jobs::Provenance& provenance);

}  // namespace risley::report
