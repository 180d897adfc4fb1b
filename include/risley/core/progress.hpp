// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>

namespace risley {

/// How a long computation tells its caller where it stands: called with a fraction in [0, 1],
/// from one thread at a time. An empty function is allowed and means nobody is watching.
using Progress = std::function<void(double fraction)>;

inline void report_progress(const Progress& progress, double fraction) {
  if (progress) progress(fraction);
}

}  // namespace risley
