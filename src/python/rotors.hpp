// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "risley/estimation/estimate.hpp"

#include "python/bind.hpp"

namespace risley::python {

/// The motion of an estimate's rotors, without its recording.
struct RotorMotion {
  estimation::RotorTrajectory trajectory;
  std::vector<std::int64_t> shot_time_ns;  ///< of the used shots
  std::vector<unsigned char> outlier;      ///< not 0 if such a shot was rejected
};

std::shared_ptr<RotorMotion> motion_of(const estimation::Estimate& estimate);

}  // namespace risley::python
