// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace risley::report {

/// JavaScript that draws the diagrams which stand as JSON in the element "page-data".
std::string_view page_script();
/// Style sheet with a light and a dark set of colours.
std::string_view page_style();

}  // namespace risley::report
