// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>

#include "risley/cloud/make_cloud.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// Points that a page of a cloud draws at most: some megabytes, which a telephone still turns.
inline constexpr std::size_t kCloudPagePoints = 40'000;

/// One self-contained HTML page of a point cloud: the points in three dimensions, how sure they are
/// and on what it depends, and what is not in the cloud.
/// @param cloud       with a sample of its points
/// @param recording   what it was made of
/// @param provenance  how to make it again: name and value pairs
/// @throws InvalidArgument for a cloud without a sample
std::string cloud_page(const cloud::CloudSummary& cloud, const std::string& recording,
                       const jobs::Provenance& provenance);

}  // namespace risley::report
