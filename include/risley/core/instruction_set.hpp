// SPDX-FileCopyrightText: 2026 The risley authors
// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace risley {

/// Instruction sets that kernels exist in; baseline is what the compiler targets by default.
enum class InstructionSet { baseline, avx2, avx512 };

/// "baseline", "avx2" or "avx512".
std::string to_string(InstructionSet set);

/// The instruction sets that this binary holds and this processor supports, best last: none if the
/// binary was built for another kind of processor (RISLEY_INSTRUCTION_SETS).
const std::vector<InstructionSet>& available_instruction_sets();

/// The last of available_instruction_sets(). @throws Error when there is none
InstructionSet best_instruction_set();

/// @throws InvalidArgument when this binary does not hold it or this processor does not support it,
/// and as best_instruction_set()
void check_available(InstructionSet set);

/// The copies of one kernel, a function of plain arguments: nullptr if the binary lacks it, and the
/// next narrower one is used. A kernel for another device would be one more copy.
template <class Function>
struct KernelCopies {
  Function* baseline;
  Function* avx2;
  Function* avx512;

  /// The copy to call. @throws InvalidArgument as check_available()
  Function& at(InstructionSet set) const {
    check_available(set);
    if (set == InstructionSet::avx512 && avx512 != nullptr) return *avx512;
    if (set != InstructionSet::baseline && avx2 != nullptr) return *avx2;
    return *baseline;
  }
};

/// Declares the copies of a kernel within its layer's namespace: RISLEY_DECLARE_KERNEL(void
/// add(const AddArguments&)). Its source is compiled once per set: cmake/RisleySimdKernels.cmake.
#define RISLEY_DECLARE_KERNEL(...) \
  namespace kernel_baseline {      \
  __VA_ARGS__;                     \
  }                                \
  namespace kernel_avx2 {          \
  __VA_ARGS__;                     \
  }                                \
  namespace kernel_avx512 {        \
  __VA_ARGS__;                     \
  }

// cmake/RisleySimdKernels.cmake defines the choice of RISLEY_INSTRUCTION_SETS.
#ifdef RISLEY_HOLDS_BASELINE
#define RISLEY_BASELINE_COPY(function) &kernel_baseline::function
#else
#define RISLEY_BASELINE_COPY(function) nullptr
#endif
#ifdef RISLEY_HOLDS_AVX2
#define RISLEY_AVX2_COPY(function) &kernel_avx2::function
#else
#define RISLEY_AVX2_COPY(function) nullptr
#endif
#ifdef RISLEY_HOLDS_AVX512
#define RISLEY_AVX512_COPY(function) &kernel_avx512::function
#define RISLEY_NARROW_AVX2_COPY(function) &kernel_avx2::function
#else
#define RISLEY_AVX512_COPY(function) nullptr
#define RISLEY_NARROW_AVX2_COPY(function) RISLEY_AVX2_COPY(function)
#endif

/// The copies of a declared kernel, by its name.
#define RISLEY_KERNEL_COPIES(function)                                                       \
  risley::KernelCopies<decltype(kernel_baseline::function)> {                                \
    RISLEY_BASELINE_COPY(function), RISLEY_AVX2_COPY(function), RISLEY_AVX512_COPY(function) \
  }
/// The same for a kernel that cannot use eight lanes: AVX-512 uses its AVX2 version.
#define RISLEY_NARROW_KERNEL_COPIES(function)                                  \
  risley::KernelCopies<decltype(kernel_baseline::function)> {                  \
    RISLEY_BASELINE_COPY(function), RISLEY_NARROW_AVX2_COPY(function), nullptr \
  }

}  // namespace risley
