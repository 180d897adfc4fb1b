// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace risley::report {

/// Text as HTML, inside elements and quoted attributes.
std::string escape_html(std::string_view text);

/// 1234567 as "1 234 567", with non-breaking spaces.
std::string count_text(std::uint64_t count);

/// A number as text, never as a power of ten, and a dash for a non-finite one.
/// @param format  of fmt, such as "{:.3g}"
std::string finite_text(std::string_view format, double value);

/// Millimetres in a metre.
inline constexpr double kMillimetres = 1000.0;
/// A length in metres as millimetres with one decimal, or a dash without a value.
std::string millimetres(double metres);

}  // namespace risley::report
