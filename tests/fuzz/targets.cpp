// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "fuzz/targets.hpp"

#include <stdexcept>
#include <string>

namespace risley::fuzz {

const std::vector<Target>& all_targets() {
  static const std::vector<Target> all = [] {
    std::vector<Target> targets;
    for (const auto& group :
         {recording_targets(), decoder_targets(), netcdf_targets(), text_targets(),
          trajectory_targets(), command_targets(), wire_targets()}) {
      targets.insert(targets.end(), group.begin(), group.end());
    }
    return targets;
  }();
  return all;
}

const Target& target_of(std::string_view name) {
  std::string names;
  for (const Target& target : all_targets()) {
    if (target.name == name) return target;
    names += (names.empty() ? "" : ", ") + std::string(target.name);
  }
  throw std::invalid_argument("no target \"" + std::string(name) + "\", there are " + names);
}

}  // namespace risley::fuzz
