// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string_view>

namespace risley {

// Preconditions of the libraries' entry points, checked once per call. Each throws InvalidArgument
// with the name of the argument, its value and unit, and the allowed range; NaN is never allowed.

/// "azimuth has 3 values, expected 4"
void require_length(std::string_view name, std::size_t length, std::size_t expected);
/// As require_length, for a column that may be empty.
void require_length_or_none(std::string_view name, std::size_t length, std::size_t expected);
/// The place of an element: "knot = 7, allowed 0 to 6"
void require_place(std::string_view name, std::size_t place, std::size_t size);
/// Rows [begin, end) of a column: "shots = [3, 9), allowed within [0, 8)"
void require_rows(std::string_view name, std::size_t begin, std::size_t end, std::size_t size);
/// A whole number: "passes = 0, allowed 1 or more"
void require_at_least(std::string_view name, long long value, long long least);

/// "noise = nan rad, allowed above 0"; infinite numbers are not allowed either.
/// @param unit  as written after the value; may be empty
void require_above(std::string_view name, double value, double limit, std::string_view unit = {});
/// A limit above 0 that may be infinite: "gate = nan, allowed above 0"
void require_threshold(std::string_view name, double value);
/// As require_above, with the limit itself.
void require_not_below(std::string_view name, double value, double limit,
                       std::string_view unit = {});
/// "share = 2, allowed 0 to 1"
void require_between(std::string_view name, double value, double lowest, double highest,
                     std::string_view unit = {});
/// "angle = inf rad, allowed finite"
void require_finite(std::string_view name, double value, std::string_view unit = {});
/// The length of a vector, up to a millionth: "direction has length 2, expected a unit vector"
void require_unit_length(std::string_view name, double length);

}  // namespace risley
