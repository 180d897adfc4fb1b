// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace risley::report {

/// Text as HTML, inside elements and quoted attributes.
std::string escape_html(std::string_view text);

/// 1234567 as "1 234 567", with spaces that do not break.
std::string count_text(std::uint64_t count);

/// Text as a quoted JSON string that may stand inside a script element.
std::string json_string(std::string_view text);

/// Significant digits that a diagram needs of numbers: seven, and more where they differ little
/// beside their size, as the speeds of a steady rotor do.
int digits_of(const std::vector<double>& values);

/// Numbers as a JSON array, with so many digits; a value that is not finite becomes null.
std::string json_numbers(const std::vector<double>& values);

}  // namespace risley::report
