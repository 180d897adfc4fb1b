// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace risley::report {

/// Text as HTML, inside elements and quoted attributes.
std::string escape_html(std::string_view text);

/// Text as a quoted JSON string that may stand inside a script element.
std::string json_string(std::string_view text);

/// Numbers as a JSON array, with seven digits; a value that is not finite becomes null.
std::string json_numbers(const std::vector<double>& values);

}  // namespace risley::report
