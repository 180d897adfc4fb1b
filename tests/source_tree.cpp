// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "source_tree.hpp"

namespace risley {

std::string in_source_tree(const std::string& name) {
  return std::string(RISLEY_SOURCE_DIR "/") + name;
}

}  // namespace risley
