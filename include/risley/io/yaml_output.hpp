// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace risley::io {

/// A text between double quotes, as YAML reads it back.
std::string yaml_quoted(std::string_view text);

/// The shortest decimal which, read in extended precision and multiplied by the scale, gives
/// exactly this value.
/// @param scale  the value's units per unit of the file
/// @throws InvalidArgument for a non-finite value and a scale not above 0
std::string yaml_decimal(double value, long double scale = 1);

}  // namespace risley::io
