// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace risley::hashes {

/// Bytes as text: four characters for every three, with padding.
std::string base64(std::string_view bytes);

}  // namespace risley::hashes
