// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include "risley/core/angle.hpp"

namespace risley::estimation {

/// 1 sigma of the frame's turn about the optical axis found by the start's lines, rad: as wide as
/// the priors of the parameters.
inline constexpr double kFrameSigma = radians_from_degrees(1.0);

}  // namespace risley::estimation
