// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

namespace risley {

/// x^2
constexpr double square(double x) { return x * x; }

}  // namespace risley
