// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <xsimd/xsimd.hpp>

#include "risley/core/scalar.hpp"

namespace risley {

template <class Number, class Arch>
struct SineCosine<xsimd::batch<Number, Arch>> {
  using Batch = xsimd::batch<Number, Arch>;
  static std::pair<Batch, Batch> of(const Batch& angle) { return xsimd::sincos(angle); }
};

}  // namespace risley
