// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace risley::io {

/// Refuses JSON in which lists and objects are nested deeper than any program writes them: whatever
/// parses it, or only frees it, does so level by level on the stack.
/// @param path  for messages  @throws FileError with the place of the first that is too deep
void require_shallow_json(const std::string& path, std::string_view text);

}  // namespace risley::io
