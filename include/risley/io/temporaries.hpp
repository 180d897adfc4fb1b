// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley::io {

/// Keeps in mind a file or folder that its owner will remove or rename.
void note_temporary(const std::string& path);
/// It is gone, or has its final name.
void forget_temporary(const std::string& path);

/// Removes all of them, for a process that ends without its owners' help. Whoever makes another one
/// waits from then on.
void remove_temporaries();

}  // namespace risley::io
