// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "risley/core/vector3.hpp"

namespace risley::jobs {

/// @throws InvalidArgument unless the file has the name of a simulation's truth
void check_truth_name(const std::string& truth);
/// The same of many. @throws InvalidArgument unless there is one for each recording
void check_truths(const std::vector<std::string>& truths, std::size_t recordings);
/// @param recorded, beams  recorded and true directions of the same shots, NaN where not known
/// @throws InvalidArgument when they are farther apart than any bent optics
void check_truth_is_of_recording(std::span<const Vector3<double>> recorded,
                                 std::span<const Vector3<double>> beams, const std::string& truth);
/// OUT.truth.nc of OUT.truth.yaml.
std::string truth_columns(const std::string& truth);
/// OUT.mount.truth.yaml of OUT.truth.yaml.
std::string truth_mount(const std::string& truth);

}  // namespace risley::jobs
