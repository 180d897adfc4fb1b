// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#include "risley/core/instruction_set.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "risley/core/error.hpp"

#include "core/processor.hpp"

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

namespace {

std::vector<InstructionSet> held_instruction_sets() {
  return {
#ifdef RISLEY_HOLDS_BASELINE
      InstructionSet::baseline,
#endif
#ifdef RISLEY_HOLDS_AVX2
      InstructionSet::avx2,
#endif
#ifdef RISLEY_HOLDS_AVX512
      InstructionSet::avx512,
#endif
  };
}

bool processor_runs(InstructionSet set) {
  switch (set) {
    case InstructionSet::baseline:
      return true;
    case InstructionSet::avx2:
      return processor_runs_avx2();
    case InstructionSet::avx512:
      return processor_runs_avx512();
  }
  return false;
}

std::string names(const std::vector<InstructionSet>& sets) {
  std::vector<std::string> found;
  found.reserve(sets.size());
  for (const InstructionSet set : sets) found.push_back(to_string(set));
  return fmt::format("{}", fmt::join(found, ", "));
}

}  // namespace

const std::vector<InstructionSet>& available_instruction_sets() {
  static const std::vector<InstructionSet> sets = [] {
    std::vector<InstructionSet> found = held_instruction_sets();
    std::erase_if(found, [](InstructionSet set) { return !processor_runs(set); });
    return found;
  }();
  return sets;
}

InstructionSet best_instruction_set() {
  if (available_instruction_sets().empty()) {
    throw Error(fmt::format(
        "instruction sets of this binary = {}, of which this processor supports none: build risley "
        "on this machine, or for all processors with cmake -DRISLEY_INSTRUCTION_SETS=all",
        names(held_instruction_sets())));
  }
  return available_instruction_sets().back();
}

void check_available(InstructionSet set) {
  best_instruction_set();  // or none at all
  const auto& sets = available_instruction_sets();
  if (std::find(sets.begin(), sets.end(), set) != sets.end()) return;
  throw InvalidArgument(fmt::format("instruction set = {}, this processor and binary allow {}",
                                    to_string(set), names(sets)));
}

}  // namespace risley
