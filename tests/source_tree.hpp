// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace risley {

/// Path of a file of the repository, named as seen from its root: "data/hall.yaml". Where the
/// repository lies is known to source_tree.cpp alone, so that another clone need not compile the
/// tests again.
std::string in_source_tree(const std::string& name);

}  // namespace risley
