// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace risley::io {

/// Rejects JSON with deeper nesting than any program writes: a parser, or its destructor, would
/// recurse level by level on the stack.
/// @param path  for messages @throws FileError with the place of the first level that is too deep
void require_shallow_json(const std::string& path, std::string_view text);

}  // namespace risley::io
