// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/compare_clouds.hpp"
#include "risley/jobs/provenance.hpp"

namespace risley::report {

/// The answer in one sentence: how much of the surface has changed, and the smallest detectable
/// change.
std::string change_words(const jobs::ComparedClouds& compared);

/// One self-contained HTML page on the changes between two clouds: a viewer of the cells, coloured
/// by distance and by distance over the level of detection, and the detectable changes.
/// @param provenance  how to reproduce it: name and value pairs
std::string change_page(const jobs::ComparedClouds& compared, const jobs::Provenance& provenance);

}  // namespace risley::report
