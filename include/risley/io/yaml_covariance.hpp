// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>

#include "risley/algebra/named_covariance.hpp"
#include "risley/io/yaml_map.hpp"

namespace risley::io {

/// SI units per unit of the file of the quantity of that name.
/// @throws InvalidArgument for a name that is not allowed
using ScaleOfName = std::function<long double(const std::string& name)>;

/// Reads
///
///     covariance:
///       names: [prism_tilt_a_vertical_deg, range_offset_m]
///       matrix:
///         - [1.0e-6, 0]
///         - [0, 4.0e-6]
///
/// where element [i][j] is in the unit of names[i] times the unit of names[j].
/// @throws FileError with the line for names that are not allowed or repeated and a matrix that is
/// not a covariance of them
algebra::NamedCovariance read_covariance(const YamlMap& root, const ScaleOfName& scale_of);

/// The same as text; reading it gives the same bits.
/// @throws InvalidArgument as ScaleOfName, for a matrix of another size and non-finite numbers
std::string covariance_text(const algebra::NamedCovariance& covariance,
                            const ScaleOfName& scale_of);

}  // namespace risley::io
