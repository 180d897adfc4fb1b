// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// Run by CMake for RISLEY_INSTRUCTION_SETS=native: prints the best instruction set of this processor.
#include <cstdio>

#include "core/processor.hpp"

int main() {
  const char* const best = risley::processor_runs_avx512() ? "avx512"
                           : risley::processor_runs_avx2() ? "avx2"
                                                           : "baseline";
  return std::fputs(best, stdout) < 0;
}
