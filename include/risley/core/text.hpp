// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley {

/// The same with the letters A to Z in lower case, for endings of file names.
std::string lower_case(std::string text);

}  // namespace risley
