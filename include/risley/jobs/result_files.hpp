// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/jobs/provenance.hpp"

namespace risley::jobs {

/// Which rotor states are written.
enum class StatesRows {
  none,
  knots,  ///< one shot per knot (batch estimator), or the shots used (filter)
  all,    ///< all shots
};

/// Where a job leaves its results. All appear together at its end, or, when it fails or is
/// cancelled, none; a folder that it made for them is gone then, too. A calibration of an earlier
/// run goes when this run's numbers failed: what failed is no calibration.
struct ResultFiles {
  std::string folder;  ///< calibration.yaml, states.nc; empty: nothing is written
  StatesRows states = StatesRows::knots;
  Provenance provenance;  ///< goes into the files, together with the inputs' SHA-256
};

}  // namespace risley::jobs
