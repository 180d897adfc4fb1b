// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/json/results.hpp"

namespace risley::json {

/// Validates JSON of a file against a schema of docs/schemas, as far as the library includes it.
/// Supports the keywords of JSON Schema used there; names that a schema does not list are accepted.
/// @param schema  such as "estimate.json#/$defs/found"
/// @param path    of the file, for messages
/// @throws FileError naming the first place that is missing or wrong, and the expected value
void require_schema(const Json& value, const std::string& schema, const std::string& path);

}  // namespace risley::json
