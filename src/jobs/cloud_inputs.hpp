// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <optional>

#include "risley/jobs/given.hpp"
#include "risley/jobs/provenance.hpp"
#include "risley/recordings/source.hpp"

/// Common parts of clouds of one recording and of several stations.
namespace risley::jobs {

/// The day on which a file was last changed, UTC: for a recording, usually the day it was made.
std::optional<std::chrono::sys_days> day_of(const recordings::Source& recording);

/// Provenance of a cloud: the inputs, and the calibration.
Provenance provenance_of_cloud(InputHashes& hashes, const Provenance& provenance,
                               const GivenSensor& calibration);

}  // namespace risley::jobs
