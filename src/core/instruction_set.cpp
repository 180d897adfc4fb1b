// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/instruction_set.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/error.hpp"

namespace risley {

std::string to_string(InstructionSet set) {
  switch (set) {
    case InstructionSet::baseline:
      return "baseline";
    case InstructionSet::avx2:
      return "avx2";
    case InstructionSet::avx512:
      return "avx512";
  }
  return "unknown";
}

const std::vector<InstructionSet>& available_instruction_sets() {
  static const std::vector<InstructionSet> sets = [] {
    std::vector<InstructionSet> found{InstructionSet::baseline};
#ifdef RISLEY_HAS_X86_KERNELS
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
      found.push_back(InstructionSet::avx2);
      if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
          __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512cd") &&
          __builtin_cpu_supports("avx512vl")) {
        found.push_back(InstructionSet::avx512);
      }
    }
#endif
    return found;
  }();
  return sets;
}

InstructionSet best_instruction_set() { return available_instruction_sets().back(); }

void check_available(InstructionSet set) {
  const auto& sets = available_instruction_sets();
  if (std::find(sets.begin(), sets.end(), set) != sets.end()) return;
  std::vector<std::string> names;
  names.reserve(sets.size());
  for (const InstructionSet each : sets) names.push_back(to_string(each));
  throw InvalidArgument(fmt::format("instruction set = {}, this processor and binary allow {}",
                                    to_string(set), fmt::join(names, ", ")));
}

}  // namespace risley
