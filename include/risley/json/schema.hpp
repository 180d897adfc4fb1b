// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "risley/json/results.hpp"

namespace risley::json {

/// Holds JSON of a file against a schema of docs/schemas, as far as the library carries it.
/// Understands the words of JSON Schema that these use; names that a schema does not know pass.
/// @param schema  such as "estimate.json#/$defs/found"
/// @param path    of the file, for messages
/// @throws FileError naming the first place that is missing or wrong, and what is expected there
void require_schema(const Json& value, const std::string& schema, const std::string& path);

}  // namespace risley::json
