// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "risley/estimation/estimate.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// How the rotors of an estimate moved, apart from its recording.
struct RotorMotion {
  estimation::RotorTrajectory trajectory;
  std::vector<std::int64_t> shot_time_ns;  ///< of the shots that were used
  std::vector<unsigned char> outlier;      ///< not 0 where such a shot was left out
};

std::shared_ptr<RotorMotion> motion_of(const estimation::Estimate& estimate);

}  // namespace risley::python
