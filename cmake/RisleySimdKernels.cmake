# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# A kernel (src/<layer>/<name>_kernel.cpp) is one source, compiled once per instruction set into the
# same binary; the code beside it picks one at run time. Only these files get wide-instruction flags,
# and tests/architecture checks that nothing compiled with them can leak into the rest.
set(known_sets baseline)
set(flags_baseline "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  list(APPEND known_sets avx2 avx512)
  set(flags_avx2 -mavx2 -mfma)
  # gcc 12 takes variables of its own avx512 header for uninitialised (gcc.gnu.org/PR105593).
  set(flags_avx512 -mavx512f -mavx512dq -mavx512bw -mavx512cd -mavx512vl -mfma
                   -Wno-uninitialized -Wno-maybe-uninitialized)
endif()
set(held_sets ${RISLEY_INSTRUCTION_SETS})
if(held_sets STREQUAL all)
  set(held_sets ${known_sets})
elseif(native IN_LIST held_sets)
  if(CMAKE_CROSSCOMPILING)
    message(FATAL_ERROR "RISLEY_INSTRUCTION_SETS = native asks the processor that builds; for another "
                        "one, name its sets: ${known_sets}, or all")
  endif()
  try_run(status compiled SOURCES ${CMAKE_CURRENT_LIST_DIR}/best_instruction_set.cpp
          CMAKE_FLAGS -DINCLUDE_DIRECTORIES=${PROJECT_SOURCE_DIR}/src
          COMPILE_OUTPUT_VARIABLE errors RUN_OUTPUT_VARIABLE best_set)
  if(NOT compiled OR NOT status EQUAL 0)
    message(FATAL_ERROR "RISLEY_INSTRUCTION_SETS = native: ${CMAKE_CURRENT_LIST_DIR}/best_instruction_set.cpp "
                        "did not run (${status}). Name sets instead: ${known_sets}, or all\n${errors}")
  endif()
  list(TRANSFORM held_sets REPLACE "^native$" "${best_set}")
  list(REMOVE_DUPLICATES held_sets)
endif()
if(NOT held_sets)
  message(FATAL_ERROR "RISLEY_INSTRUCTION_SETS is empty, allowed: all, native, or a list of ${known_sets}")
endif()
foreach(set IN LISTS held_sets)
  if(NOT set IN_LIST known_sets)
    message(FATAL_ERROR "RISLEY_INSTRUCTION_SETS = ${set}, allowed: all, native, or a list of ${known_sets}")
  endif()
endforeach()

# For sources that choose among the copies (risley/core/instruction_set.hpp).
list(TRANSFORM held_sets TOUPPER OUTPUT_VARIABLE RISLEY_HELD_SETS)
list(TRANSFORM RISLEY_HELD_SETS PREPEND RISLEY_HOLDS_)

# Kernels whose lanes are parts of one shot: AVX-512 runs their copy for AVX2, and its eight lanes would
# be mostly empty.
set(RISLEY_NARROW_KERNELS filter_kernel.cpp)

# Adds some kernels to a target, as object libraries named after it.
function(risley_add_kernels_to owner)
  foreach(set IN LISTS known_sets)
    set(kernels ${ARGN})
    set(narrow "/(${RISLEY_NARROW_KERNELS})$")
    if(set STREQUAL avx2 AND NOT set IN_LIST held_sets AND avx512 IN_LIST held_sets)
      list(FILTER kernels INCLUDE REGEX ${narrow})
    elseif(NOT set IN_LIST held_sets)
      set(kernels "")
    elseif(set STREQUAL avx512)
      list(FILTER kernels EXCLUDE REGEX ${narrow})
    endif()
    if(NOT kernels)
      continue()
    endif()
    set(target ${owner}_kernels_${set})
    add_library(${target} OBJECT ${kernels})
    risley_target_defaults(${target})
    set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden UNITY_BUILD OFF)
    target_include_directories(${target} PRIVATE ${PROJECT_SOURCE_DIR}/include
                                                 ${PROJECT_SOURCE_DIR}/src)
    target_link_libraries(${target} PRIVATE risley_xsimd)
    target_compile_definitions(${target} PRIVATE RISLEY_KERNEL=${set}
      # xsimd's plain functions for huge angles do not name their instruction set themselves.
      __ieee754_rem_pio2=ieee754_rem_pio2_${set} __kernel_rem_pio2=kernel_rem_pio2_${set})
    # -O2 leaves small loops over batches as loops, and the batches in memory: with -O3 the batch
    # estimator's kernel takes 38 % less time with AVX2, 16 % with AVX-512.
    target_compile_options(${target} PRIVATE ${flags_${set}}
                                             "$<$<CONFIG:Release,RelWithDebInfo>:-O3>")
    target_sources(${owner} PRIVATE $<TARGET_OBJECTS:${target}>)
  endforeach()
endfunction()

function(risley_add_kernels layer)
  if(NOT TARGET risley_${layer})
    return()
  endif()
  file(GLOB kernels CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/${layer}/*_kernel.cpp)
  risley_add_kernels_to(risley_${layer} ${kernels})
  target_compile_definitions(risley_${layer} PRIVATE ${RISLEY_HELD_SETS})
endfunction()

# The one choice among them.
target_compile_definitions(risley_core PRIVATE ${RISLEY_HELD_SETS})

# It gives the same bits with every set. A pragma in the file would keep the compiler from putting
# the operators of batches where they are used.
set_source_files_properties(${PROJECT_SOURCE_DIR}/src/recordings/cartesian_kernel.cpp PROPERTIES
                            COMPILE_OPTIONS -ffp-contract=off)
risley_add_kernels(optics)
risley_add_kernels(recordings)
risley_add_kernels(sensors)
risley_add_kernels(estimation)
risley_add_kernels(calibration)
risley_add_kernels(cloud)
