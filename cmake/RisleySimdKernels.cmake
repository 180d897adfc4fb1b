# SPDX-FileCopyrightText: 2026 The risley authors
# SPDX-License-Identifier: MIT
# The batch kernel is one source, compiled once per instruction set into the same binary; the
# dispatcher in src/optics/batch.cpp picks one at run time. Only these files get wide-instruction
# flags, and tests/architecture checks that nothing compiled with them can leak into the rest.
set(kernel ${PROJECT_SOURCE_DIR}/src/optics/batch_kernel.cpp)

function(risley_add_kernel name)
  add_library(risley_kernel_${name} OBJECT ${kernel})
  risley_target_defaults(risley_kernel_${name})
  target_include_directories(risley_kernel_${name} PRIVATE
                             ${PROJECT_SOURCE_DIR}/include
                             ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(risley_kernel_${name} PRIVATE xsimd)
  target_compile_definitions(risley_kernel_${name} PRIVATE RISLEY_KERNEL=${name}
    # xsimd's plain functions for huge angles do not name their instruction set themselves.
    __ieee754_rem_pio2=ieee754_rem_pio2_${name} __kernel_rem_pio2=kernel_rem_pio2_${name})
  target_compile_options(risley_kernel_${name} PRIVATE ${ARGN})
  target_sources(risley_optics PRIVATE $<TARGET_OBJECTS:risley_kernel_${name}>)
endfunction()

risley_add_kernel(baseline)
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
  target_compile_definitions(risley_optics PRIVATE RISLEY_HAS_X86_KERNELS)
  risley_add_kernel(avx2 -mavx2 -mfma)
  # gcc 12 takes variables of its own avx512 header for uninitialised (gcc.gnu.org/PR105593).
  risley_add_kernel(avx512 -mavx512f -mavx512dq -mavx512bw -mavx512cd -mavx512vl -mfma
                    -Wno-uninitialized -Wno-maybe-uninitialized)
endif()
