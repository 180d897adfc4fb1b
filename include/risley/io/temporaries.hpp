// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// Registers a file or folder that its owner will remove or rename.
void note_temporary(const std::string& path);
/// It has been removed or renamed.
void forget_temporary(const std::string& path);

/// Removes all of them, for a process that ends without running destructors. Any thread that
/// creates another one blocks from then on.
void remove_temporaries();

}  // namespace risley::io
