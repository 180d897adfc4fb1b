// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
// The only place that queries the processor's capabilities. CMake queries them too:
// cmake/best_instruction_set.cpp.
#pragma once

namespace risley {

#if defined(__x86_64__)
inline bool processor_runs_avx2() {
  __builtin_cpu_init();
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
}

inline bool processor_runs_avx512() {
  return processor_runs_avx2() && __builtin_cpu_supports("avx512f") &&
         __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512vl");
}
#else
inline bool processor_runs_avx2() { return false; }
inline bool processor_runs_avx512() { return false; }
#endif

}  // namespace risley
